"""The skin of made-up heads, of the shipped one and of a real one: where it lies, open at nostrils, no headrest."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from vfix_engine.anatomy import beside_head
from vfix_engine.anatomy.phantom import load_head_ct, load_landmarks
from vfix_engine.anatomy.scan_ends import faces_at_ends
from vfix_engine.anatomy.skin import INTO_OPENINGS_MM, skin_of_volume
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

RADIUS, CAVITY, TUBE = 40.0, 12.0, 2.5  # mm: the head, the air in it, and the nostril that leads there along -y
HEADREST = 150.0  # mm along x


def grid(low: tuple[float, float, float], high: tuple[float, float, float]) -> Array:
    """Voxel centres (K, J, I, 3) 1 mm apart."""
    axes = [np.arange(a, b) for a, b in zip(low, high, strict=True)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def head(at: Array) -> Array:
    """Signed distance in mm from the tissue of a ball with a cavity and a nostril, negative inside."""
    r = np.linalg.norm(at, axis=-1)
    tube = np.maximum(np.hypot(at[..., 0], at[..., 2]) - TUBE, at[..., 1])
    return np.maximum(r - RADIUS, np.maximum(CAVITY - r, -tube))


def scan(distance: Array, at: Array) -> Volume:
    """A CT whose value falls linearly through that of the border of tissue."""
    hu = np.clip(TISSUE_HU - 0.5 - 500.0 * distance, -1000.0, 40.0)
    return Volume(np.rint(hu).astype(np.int16), at[0, 0, 0], np.ones(3), np.eye(3))


@pytest.fixture(scope="module")
def ball() -> Volume:
    at = grid((-52, -55, -51), (53, 52, 54))
    return scan(head(at), at)


def rays(mesh: TriangleMesh, start: Array, end: Array) -> int:
    """How often the segments from start (n, 3) to end (n, 3) meet a surface."""
    surface = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, validate=False)
    lengths = np.linalg.norm(end - start, axis=1)
    places, ray, _ = RayMeshIntersector(surface).intersects_location(start, (end - start) / lengths[:, None])
    return int((np.linalg.norm(places - start[ray], axis=1) < lengths[ray]).sum())


def test_the_skin_of_a_ball_is_its_outside_and_goes_a_little_into_the_nostril(ball: Volume) -> None:
    mesh = skin_of_volume(ball).mesh
    r, beside = np.linalg.norm(mesh.vertices, axis=1), np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2])
    of_tube = (beside < TUBE + 1.0) & (mesh.vertices[:, 1] < 0.0)
    assert np.abs(r[~of_tube] - RADIUS).max() < 0.1
    depth = RADIUS - r[of_tube]
    assert (
        INTO_OPENINGS_MM < depth.max() < INTO_OPENINGS_MM + 6.0
    )  # from where the room's air ends, which is in the nostril
    assert np.abs(beside[of_tube & (r < RADIUS - 1.5)] - TUBE).max() < 0.3
    outwards = np.einsum("ij,ij->i", mesh.face_normals, mesh.triangles.mean(axis=1))
    assert (outwards[~of_tube[mesh.faces].any(axis=1)] > 0.0).all()
    across = np.array([(x, 0.0, z) for x in (-1.2, 0.0, 1.2) for z in (-1.2, 0.0, 1.2)])
    assert rays(mesh, across - [0.0, 50.0, 0.0], across) == 0, "a hole of 5 mm stays open"


def test_thinning_moves_it_by_no_more_than_it_says(ball: Volume) -> None:
    whole, thinned = skin_of_volume(ball).mesh, skin_of_volume(ball, triangles=4000)
    assert len(thinned.mesh.faces) <= 4000 < len(whole.faces)
    places = np.concatenate([thinned.mesh.vertices, thinned.mesh.triangles.mean(axis=1)])
    places = places[(np.hypot(places[:, 0], places[:, 2]) > TUBE + 2.0) | (places[:, 1] > 0.0)]
    moved = np.abs(np.linalg.norm(places, axis=1) - RADIUS)
    assert 0.0 < moved.max() < thinned.max_deviation_mm + 0.1, "the voxels' own surface is 0.1 mm off the ball"
    assert thinned.max_deviation_mm < 1.0
    assert thinned.mean_deviation_mm < 0.05


def test_it_is_open_where_the_scan_ends_or_measured_nothing(ball: Volume) -> None:
    cut = Volume(ball.hu[25:, :, :80].copy(), ball.index_to_lps([0.0, 0.0, 25.0]), ball.spacing, ball.direction)
    mesh = skin_of_volume(cut).mesh
    assert len(mesh.faces) > 10_000
    assert not faces_at_ends(mesh, cut).any()
    hu = ball.hu.copy()
    hu[:, :, :25] = -2000  # beyond a scanner's circle
    padded = skin_of_volume(Volume(hu, ball.origin, ball.spacing, ball.direction)).mesh
    flat = np.abs(padded.vertices[:, 0] - (ball.origin[0] + 25.0)) < 1.5
    away = RADIUS - np.linalg.norm(padded.vertices[flat], axis=1)
    assert away.max() < INTO_OPENINGS_MM, "no face closes the ball there"
    assert (away > 1.0).mean() < 0.02


@pytest.mark.parametrize("gap", [-1.0, 6.0], ids=["touching", "apart"])
def test_a_headrest_is_told_from_the_head_and_an_ear_is_kept(gap: float) -> None:
    at = grid((-80, -50, -50), (80, 65, 50))
    rest = np.maximum(np.abs(at[..., 1] - (RADIUS + gap + 1.0)) - 1.5, np.abs(at[..., 0]) - 0.5 * HEADREST)
    rest = np.maximum(rest, np.abs(at[..., 2]) - 45.0)
    ear = np.maximum(np.hypot(at[..., 1], at[..., 2]) - 18.0, np.abs(at[..., 0] - 40.0) - 18.0)
    ear = np.maximum(ear, np.abs(at[..., 1]) - 2.0)
    mesh = skin_of_volume(scan(np.minimum(np.minimum(head(at), rest), ear), at)).mesh
    assert mesh.vertices[:, 0].max() == pytest.approx(58.0, abs=0.5), "the ear"
    behind = mesh.vertices[mesh.vertices[:, 1] > 0.0]
    behind = behind[behind[:, 0] < 20.0]
    assert (np.linalg.norm(behind, axis=1) < RADIUS + 4.0).all(), "no more of the rest than where it touches"


def test_a_scan_without_a_head_or_without_air_is_refused(ball: Volume) -> None:
    for hu in (-1000, 40):
        with pytest.raises(ImageError):
            skin_of_volume(Volume(np.full((20, 20, 20), hu, np.int16), np.zeros(3), np.ones(3), np.eye(3)))
    inner = ball.hu[30:70, 60:90, 30:70]
    with pytest.raises(ImageError, match="no air around"):
        skin_of_volume(Volume(np.maximum(inner, 0), np.zeros(3), np.ones(3), np.eye(3)))


def test_fine_voxels_are_skipped(ball: Volume, monkeypatch: pytest.MonkeyPatch) -> None:
    fine = skin_of_volume(ball).mesh
    monkeypatch.setattr(beside_head, "FINE_ENOUGH_MM", 2.0)
    coarse = skin_of_volume(ball).mesh
    assert len(coarse.faces) < 0.35 * len(fine.faces)
    assert np.linalg.norm(coarse.vertices, axis=1).max() == pytest.approx(RADIUS, abs=0.3)


def test_the_nostrils_of_the_shipped_head_are_open() -> None:
    """Along its path through the nose the skin is never met, and its rim is around it."""
    ct = load_head_ct(noise=False)
    first, last = 60, 140  # the nose and the ears
    part = Volume(ct.hu[first:last, :160], ct.index_to_lps([0.0, 0.0, float(first)]), ct.spacing, ct.direction)
    mesh = skin_of_volume(part).mesh
    path = np.array([place.position for place in load_landmarks().corridor])
    assert rays(mesh, path[:-1], path[1:]) == 0
    nearest = np.array([np.linalg.norm(mesh.vertices - place, axis=1).min() for place in path])
    assert nearest[:3].min() < 5.0, "the rim"
    assert nearest[-1] > 20.0, "nothing of the inner airway"
    ends = (np.abs(mesh.vertices[:, 2, None] - part.bounds[:, 2]).min(axis=1) < 1.0)[mesh.faces].all(axis=1)
    normals = mesh.face_normals[ends]
    areas = 0.5 * np.linalg.norm(normals, axis=1)
    flat = np.abs(normals[:, 2]) > 1.8 * areas
    assert areas[flat].sum() < 50.0, "no cap where the scan is cut, which would have more than 10 000 mm² at each end"


def test_a_real_head_is_without_its_headrest_and_its_nostrils_are_open(trial_data: Path) -> None:
    volume = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")[0]
    made = skin_of_volume(volume)
    assert 70_000 < len(made.mesh.faces) <= 80_000
    assert made.mean_deviation_mm < 0.03
    assert made.mesh.vertices[:, 1].max() < 113.0  # the shell of the rest is at up to 127
    corridor = json.loads((trial_data / "head_ct" / "corridor.json").read_text())
    path = np.array([point["lps"] for point in corridor["points"]])
    assert rays(made.mesh, path[:-1], path[1:]) == 0
