"""Bone surface: where it lies, which way it is turned, what cleaning and thinning do to it."""

from pathlib import Path

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume, rotation
from scipy.spatial import cKDTree

from vfix_engine.errors import ImageError, MeshError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.readers import read_volume
from vfix_engine.imaging.surface import clean, extract_surface, thin
from vfix_engine.imaging.volume import Volume

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
    cleaned = clean(dirty, 20)
    assert cleaned.bounds[1].max() < 100
    assert (np.linalg.norm(cleaned.face_normals, axis=1) > 0).all()
    assert len(clean(dirty, 1).faces) > len(cleaned.faces)
    with pytest.raises(MeshError, match="no body"):
        clean(dirty, 10**6)


def test_thinning_reports_how_far_it_went() -> None:
    volume, centre = ball(np.eye(3))
    mesh = clean(extract_surface(volume), 20)
    thinned = thin(mesh, len(mesh.faces) // 4)
    assert len(thinned.mesh.faces) <= len(mesh.faces) // 4 + 2
    assert 0 < thinned.mean_deviation_mm <= thinned.max_deviation_mm < 0.3
    assert np.abs(np.linalg.norm(thinned.mesh.vertices - centre, axis=1) - 9.0).max() < 0.3
    outwards = thinned.mesh.triangles.mean(axis=1) - centre
    assert (np.einsum("ij,ij->i", thinned.mesh.face_normals, outwards) > 0).all()
    assert thin(mesh, len(mesh.faces)).mesh is mesh


def test_real_head(trial_data: Path) -> None:
    """Bone denser inside than outside nearly everywhere."""
    volume, _ = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")
    mesh = extract_surface(volume)
    middle = mesh.triangles.mean(axis=1)
    inside, outside = (volume.sample(middle + step * mesh.face_normals) for step in (-0.4, 0.4))
    assert (inside > outside).mean() > 0.99
    # Corners lie on voxel edges at 250 HU, but for the few that the algorithm puts into a cell's middle.
    assert (np.abs(volume.sample(mesh.vertices) - 250.0) < 1.0).mean() > 0.99
