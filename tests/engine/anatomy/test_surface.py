"""Bone surface: where it lies, which way it is turned, what cleaning and thinning do to it."""

from pathlib import Path

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume, rotation
from scipy.spatial import cKDTree

from vfix_engine.anatomy.bone import slice_uncertainty_mm
from vfix_engine.anatomy.phantom import load_nose_ct
from vfix_engine.anatomy.surface import Dropped, clean, extract_surface
from vfix_engine.anatomy.thinning import thin
from vfix_engine.errors import ImageError, MeshError
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree

DIRECTIONS = pytest.mark.parametrize(
    "direction",
    [np.eye(3), np.diag([-1.0, 1.0, -1.0]), np.diag([1.0, 1.0, -1.0]), rotation((20.0, 10.0, -35.0))],
    ids=["upright", "turned", "left-handed", "oblique"],
)


def ball(direction: np.ndarray, radius: float = 9.0) -> tuple[Volume, np.ndarray]:
    """(a dense ball in air on an oblique, uneven grid, its centre); HU falls linearly through 250 at the radius."""
    volume = Volume(np.zeros((24, 30, 40), np.int16), [-20.0, 5.0, 70.0], [0.7, 0.9, 1.1], direction)
    centre = volume.index_to_lps([19.0, 14.0, 12.0])
    k, j, i = np.indices(volume.hu.shape).reshape(3, -1)
    distance = np.linalg.norm(volume.index_to_lps(np.stack([i, j, k], axis=1)) - centre, axis=1)
    hu = np.clip(250.0 + 200.0 * (radius - distance), -1000, 1500).reshape(volume.hu.shape)
    return Volume(np.rint(hu).astype(np.int16), volume.origin, volume.spacing, direction), centre


@DIRECTIONS
def test_ball_comes_out_in_its_place_and_turned_outwards(direction: np.ndarray) -> None:
    """HAZ-14: through the full direction matrix, also a left-handed one."""
    volume, centre = ball(direction)
    mesh = extract_surface(volume)
    assert np.abs(np.linalg.norm(mesh.vertices - centre, axis=1) - 9.0).max() < 0.05
    outwards = mesh.triangles.mean(axis=1) - centre
    assert (np.einsum("ij,ij->i", mesh.face_normals, outwards) > 0).all()
    signed = np.einsum("ij,ij->i", mesh.triangles[:, 0], np.cross(mesh.triangles[:, 1], mesh.triangles[:, 2])).sum() / 6
    assert signed == pytest.approx(4 / 3 * np.pi * 9.0**3, rel=0.02)


def test_region_keeps_to_its_box() -> None:
    volume, centre = ball(rotation((20.0, 10.0, -35.0)))
    whole = extract_surface(volume)
    part = extract_surface(volume, region=np.stack([centre, centre + 12.0]))
    assert len(part.faces) < 0.7 * len(whole.faces)
    assert cKDTree(whole.vertices).query(part.vertices)[0].max() < 1e-4
    with pytest.raises(ImageError, match="outside"):
        extract_surface(volume, region=np.stack([centre + 500, centre + 600]))


def test_volume_without_bone_is_refused() -> None:
    air = Volume(np.full((4, 4, 4), -1000, np.int16), np.zeros(3), np.ones(3), np.eye(3))
    with pytest.raises(ImageError, match="no bone"):
        extract_surface(air)


def test_clean_takes_small_bodies_and_slivers_away() -> None:
    mesh = extract_surface(asymmetric_volume())
    dot = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]]) + 200.0
    first = len(mesh.vertices)
    extra = np.array([[first, first + 1, first + 2], [first, first + 1, first + 3]])  # the second has no area
    dirty = TriangleMesh(np.vstack([mesh.vertices, dot]), np.vstack([mesh.faces, extra]))
    cleaned, whole = clean(dirty, 20), clean(dirty, 1)
    assert cleaned.mesh.bounds[1].max() < 100
    assert (np.linalg.norm(cleaned.mesh.face_normals, axis=1) > 0).all()
    assert cleaned.dropped == Dropped(1, 1, pytest.approx(np.sqrt(2.0)))
    assert len(whole.mesh.faces) == len(cleaned.mesh.faces) + 1
    assert whole.dropped == Dropped()
    with pytest.raises(MeshError, match="no body"):
        clean(dirty, 10**6)


def test_thinning_reports_how_far_it_went() -> None:
    volume, centre = ball(np.eye(3))
    mesh = clean(extract_surface(volume), 20).mesh
    thinned = thin(mesh, len(mesh.faces) // 4)
    assert len(thinned.mesh.faces) <= len(mesh.faces) // 4 + 2
    assert 0 < thinned.mean_deviation_mm <= thinned.max_deviation_mm < 0.3
    assert np.abs(np.linalg.norm(thinned.mesh.vertices - centre, axis=1) - 9.0).max() < 0.3
    outwards = thinned.mesh.triangles.mean(axis=1) - centre
    assert (np.einsum("ij,ij->i", thinned.mesh.face_normals, outwards) > 0).all()
    assert thin(mesh, len(mesh.faces)).mesh is mesh


def test_the_deviation_is_that_of_every_vertex_both_ways() -> None:
    """One vertex of a hundred thousand stands out, at a place that every third vertex misses."""
    steps = np.arange(330.0)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    z = 0.2 * np.random.default_rng(3).normal(size=x.size)
    z[51_001] = 2.5
    i, j = np.meshgrid(np.arange(329), np.arange(329), indexing="ij")
    a = (i * 330 + j).ravel()
    faces = np.concatenate([np.column_stack([a, a + 1, a + 331]), np.column_stack([a, a + 331, a + 330])])
    mesh = TriangleMesh(np.column_stack([x.ravel(), y.ravel(), z]), faces)
    thinned = thin(mesh, 4_000)
    there = ProximityTree(thinned.mesh).point_distance(mesh.vertices)[0]
    back = ProximityTree(mesh).point_distance(thinned.mesh.vertices)[0]
    assert thinned.max_deviation_mm == max(there.max(), back.max()) > there[::3].max()
    assert thinned.mean_deviation_mm == max(there.mean(), back.mean())


@pytest.mark.parametrize("slices", [3, 4, 10])
def test_thick_slices_hide_what_the_figure_says(slices: int) -> None:
    """The synthetic head's nose in 0.5 mm slices against the same slices averaged to 1.5, 2 and 5 mm."""
    fine = load_nose_ct(noise=False)
    hu = fine.hu[60:140, 60:180, 50:130].astype(float)
    fine = Volume(np.rint(hu).astype(np.int16), np.zeros(3), fine.spacing, np.eye(3))
    thick = np.array([0.5, 0.5, 0.5 * slices])
    averaged = np.rint(hu[: 80 // slices * slices].reshape(-1, slices, *hu.shape[1:]).mean(axis=1)).astype(np.int16)
    coarse = Volume(averaged, [0.0, 0.0, 0.25 * (slices - 1)], thick, np.eye(3))
    bone = extract_surface(fine).vertices
    bone = bone[((bone > coarse.bounds[0] + 4.0) & (bone < coarse.bounds[1] - 4.0)).all(axis=1)]
    off = ProximityTree(extract_surface(coarse)).point_distance(bone)[0]
    told = slice_uncertainty_mm(float(thick[2]))
    assert np.percentile(off, 95) <= told < off.max()
    assert slice_uncertainty_mm(1.0) == 0.0


def test_real_head(trial_data: Path) -> None:
    """Bone denser inside than outside nearly everywhere."""
    volume, _ = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")
    mesh = extract_surface(volume)
    middle = mesh.triangles.mean(axis=1)
    inside, outside = (volume.sample(middle + step * mesh.face_normals) for step in (-0.4, 0.4))
    assert (inside > outside).mean() > 0.99
    # Corners lie on voxel edges at 250 HU, but for the few that the algorithm puts into a cell's middle.
    assert (np.abs(volume.sample(mesh.vertices) - 250.0) < 1.0).mean() > 0.99
