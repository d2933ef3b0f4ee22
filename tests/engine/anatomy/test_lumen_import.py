"""Lumens from files: a surface, open or closed, a label map, and the air of a CT."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import SimpleITK
import trimesh

from vfix_engine.anatomy.labels.label_map import CroppedLabel
from vfix_engine.anatomy.labels.surfaces import surface_of
from vfix_engine.anatomy.lumen.closing import outwards, with_caps
from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.anatomy.lumen.smoothing import smoothed
from vfix_engine.anatomy.lumen.voxels import voxels_of
from vfix_engine.anatomy.lumen_import import LumenRequest, read_lumen
from vfix_engine.errors import FrameError, ImageError, InputError, MeshError
from vfix_engine.files.mesh_files import write_ply
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree

RADIUS, LENGTH = 15.0, 100.0
FULL_ML = np.pi * RADIUS**2 * LENGTH / 1000.0


def tube(ends: int = 2) -> TriangleMesh:
    """A tube along z with so many of its ends closed."""
    solid = trimesh.creation.cylinder(RADIUS, segment=[[0, 0, 0], [0, 0, LENGTH]], sections=48).subdivide()
    side = np.abs(solid.face_normals[:, 2]) < 0.5
    low = solid.triangles_center[:, 2] < 1.0
    kept = side | (low if ends == 1 else np.full(len(side), ends == 2))
    return TriangleMesh(np.asarray(solid.vertices), np.asarray(solid.faces)[kept])


@pytest.mark.parametrize(("ends", "openings"), [(2, 0), (1, 1), (0, 2)])
def test_openings_are_closed_by_caps_that_run_with_the_wall(ends: int, openings: int) -> None:
    found = with_caps(tube(ends))
    assert len(found.openings) == openings
    np.testing.assert_allclose(found.openings[:, 0], 2.0 * RADIUS, rtol=0.02)
    np.testing.assert_allclose(found.openings[:, 1], np.pi * RADIUS**2, rtol=0.02)
    whole = trimesh.Trimesh(found.mesh.vertices, found.mesh.faces)
    assert whole.is_watertight
    assert whole.is_winding_consistent
    assert found.mesh.volume_mm3 / 1000.0 == pytest.approx(FULL_ML, rel=0.01)


def test_a_surface_that_faces_inwards_is_turned() -> None:
    inside_out = TriangleMesh(tube().vertices, np.ascontiguousarray(tube().faces[:, ::-1]))
    mesh, turned = outwards(inside_out)
    assert (turned, outwards(tube())[1]) == (True, False)
    assert mesh.volume_mm3 == pytest.approx(-inside_out.volume_mm3)


def test_what_no_cap_is_meant_for_is_refused_with_what_to_do() -> None:
    wide = TriangleMesh(np.asarray(tube(0).vertices) * [5.0, 5.0, 1.0], tube(0).faces)
    with pytest.raises(MeshError, match=r"150 mm wide.*import the label map"):
        with_caps(wide)
    half = tube()
    lengthwise = half.vertices[half.faces].mean(axis=1)[:, 0] > 0.0
    with pytest.raises(MeshError, match="import the label map"):
        with_caps(TriangleMesh(half.vertices * [6.0, 6.0, 0.4], half.faces[lengthwise]))
    mixed = np.array(tube().faces)
    mixed[::7] = mixed[::7, ::-1]
    with pytest.raises(MeshError, match="face opposite ways"):
        with_caps(TriangleMesh(tube().vertices, mixed))


def test_smoothing_takes_the_steps_and_keeps_the_volume() -> None:
    k, j, i = np.mgrid[-12:13, -12:13, -12:13]
    ball = CroppedLabel(1, "", None, i**2 + j**2 + k**2 <= 100, np.zeros(3, np.int64), np.eye(4))
    steps = surface_of(ball).mesh
    smooth = smoothed(steps)
    spread = [np.linalg.norm(mesh.vertices - 12.0, axis=1).std() for mesh in (steps, smooth)]
    assert spread[1] < 0.6 * spread[0]
    assert smooth.volume_mm3 == pytest.approx(steps.volume_mm3, rel=0.01)


def test_an_open_surface_of_a_file_becomes_a_closed_lumen(tmp_path: Path) -> None:
    file = tmp_path / "wall.ply"
    write_ply(file, tube(1))
    found = read_lumen(LumenRequest(file))
    assert (found.source, found.volume, found.voxel_mm) == ("surface", None, None)
    assert "1 opening was closed by a cap; the widest is 30 mm across." in " ".join(found.notes)
    assert "70 ml" in found.notes[-1]
    with pytest.raises(InputError, match="this is a surface"):
        read_lumen(LumenRequest(file, label=1))
    flat = tmp_path / "flat.stl"
    trimesh.Trimesh(np.asarray(tube(1).vertices), np.asarray(tube(1).faces)).export(flat)
    with pytest.raises(FrameError):
        read_lumen(LumenRequest(flat))
    assert read_lumen(LumenRequest(flat, assume=True)).frame.assumed


@pytest.fixture(scope="module")
def colon_voxels() -> tuple[np.ndarray, np.ndarray, float]:
    """The inside of the synthetic colon as [k, j, i], the place of its first voxel, and the edge of a voxel."""
    found = voxels_of(colon_case().mesh, 2.0)
    return found.inside.transpose(2, 1, 0).copy(), found.origin, found.voxel_mm


def image(values: np.ndarray, origin: np.ndarray, voxel_mm: float) -> SimpleITK.Image:
    made = SimpleITK.GetImageFromArray(values)
    made.SetOrigin(origin.tolist())
    made.SetSpacing([voxel_mm] * 3)
    return made


def test_a_label_map_becomes_the_wall_of_its_lumen(
    tmp_path: Path, colon_voxels: tuple[np.ndarray, np.ndarray, float]
) -> None:
    inside, origin, voxel_mm = colon_voxels
    labels = np.where(inside, 3, 0).astype(np.uint8)
    labels[:3, :3, :3] = 7  # something small beside it
    for name in ("colon.nrrd", "colon.nii.gz"):
        file = tmp_path / name
        SimpleITK.WriteImage(image(labels, origin, voxel_mm), file)
        found = read_lumen(LumenRequest(file))
        assert (found.source, found.volume, found.voxel_mm) == ("labels", None, pytest.approx(voxel_mm))
        assert any("Label 3 was taken, the largest, of 3, 7" in note for note in found.notes)
        assert len(found.wall.faces) <= 121_000
        true = colon_case().mesh
        off = ProximityTree(found.wall).point_distance(true.vertices)[0]
        assert np.quantile(off, 0.95) < voxel_mm
        assert found.wall.volume_mm3 == pytest.approx(true.volume_mm3, rel=0.05)
        assert found.report.max_deviation_mm < 2.0 * voxel_mm
    with pytest.raises(ImageError, match="no voxel has the label 4; there are 3, 7"):
        read_lumen(LumenRequest(file, label=4))
    with pytest.raises(MeshError, match="which is no lumen"):
        read_lumen(LumenRequest(file, label=7))
    with pytest.raises(ImageError, match="this is a label map"):
        read_lumen(LumenRequest(file, seed=(0.0, 0.0, 0.0)))


def ct_of(inside: np.ndarray) -> np.ndarray:
    """A body of soft tissue in air, with the lumen and a second bubble in it; 20 voxels of margin on each side."""
    hu = np.full(tuple(n + 40 for n in inside.shape), -1000, np.int16)
    hu[:, 8:-8, 8:-8] = 40
    hu[20:-20, 20:-20, 20:-20][inside] = -1000
    hu[3:8, 12:20, 12:20] = -1000
    return hu


def test_the_air_of_a_ct_becomes_a_lumen_the_largest_or_that_at_a_seed(
    tmp_path: Path, colon_voxels: tuple[np.ndarray, np.ndarray, float]
) -> None:
    inside, origin, voxel_mm = colon_voxels
    first = origin - 20 * voxel_mm
    file = tmp_path / "abdomen.nrrd"
    SimpleITK.WriteImage(image(ct_of(inside), first, voxel_mm), file)
    found = read_lumen(LumenRequest(file))
    assert found.source == "ct"
    assert found.volume is not None
    true = colon_case().mesh
    assert found.wall.volume_mm3 == pytest.approx(true.volume_mm3, rel=0.06)
    assert np.quantile(ProximityTree(found.wall).point_distance(true.vertices)[0], 0.95) < voxel_mm
    assert "The largest air in the body was taken" in " ".join(found.notes)
    bubble = tuple(float(value) for value in first + voxel_mm * np.array([16.0, 16.0, 5.0]))
    other = read_lumen(LumenRequest(file, seed=bubble))
    assert other.wall.volume_mm3 == pytest.approx(8 * 8 * 5 * voxel_mm**3, rel=0.35)
    in_tissue = tuple(float(value) for value in first + voxel_mm * np.array([60.0, 11.0, 20.0]))
    with pytest.raises(ImageError, match="put it into the lumen"):
        read_lumen(LumenRequest(file, seed=in_tissue))
    solid, body = tmp_path / "solid.nrrd", ct_of(np.zeros_like(inside))
    body[3:8, 12:20, 12:20] = 40
    SimpleITK.WriteImage(image(body, first, voxel_mm), solid)
    with pytest.raises(ImageError, match="is the lumen filled with air"):
        read_lumen(LumenRequest(solid))
    with pytest.raises(ImageError, match="threshold"):
        read_lumen(LumenRequest(file, air_hu=50.0))
