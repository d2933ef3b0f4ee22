"""Flat faces at the ends of a scan, told from anatomy however the scan lies, against the shape that is scanned."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vfix_engine.imaging.scan_ends import faces_at_ends, source_of
from vfix_engine.imaging.surface import extract_surface
from vfix_engine.imaging.volume import AIR_HU, Volume

Floats = NDArray[np.float64]
COUNTS = np.array([40, 36, 38])  # voxels along i, j, k
RADIUS_MM = 7.0


def tube(direction: Floats, spacing: Floats, along: Floats) -> tuple[Volume, Floats]:
    """A scan of a tube that leaves it at both ends, whose outer voxels are padding; and a place on the tube's axis."""
    ijk = np.stack(np.meshgrid(*(np.arange(n) for n in COUNTS), indexing="ij"), axis=-1).astype(float)
    place = (ijk * spacing) @ direction.T + np.array([12.0, -30.0, 55.0])
    middle = (((COUNTS - 1) / 2 * spacing) @ direction.T) + np.array([12.0, -30.0, 55.0])
    away = np.linalg.norm(np.cross(place - middle, along), axis=-1)
    hu = np.clip(250.0 + 400.0 * (RADIUS_MM - away), -100.0, 1200.0)
    inner = np.zeros(COUNTS, dtype=bool)
    inner[1:-1, 1:-1, 1:-1] = True
    hu[~inner] = AIR_HU
    return Volume(np.rint(hu).astype(np.int16).transpose(2, 1, 0), place[0, 0, 0], spacing, direction), middle


@pytest.mark.parametrize("seed", range(8))
def test_faces_at_the_ends_are_told_from_anatomy_for_any_axes(seed: int) -> None:
    """A quarter of the directions is left-handed; the first is the axes of LPS."""
    random = np.random.default_rng(seed)
    direction = Rotation.random(random_state=seed).as_matrix() if seed else np.eye(3)
    if seed % 4 == 3:
        direction[:, 2] *= -1.0
    spacing = random.uniform(0.6, 1.1, 3)
    along = direction @ (random.uniform(-0.1, 0.1, 3) + np.eye(3)[seed % 3])
    along /= np.linalg.norm(along)
    volume, middle = tube(direction, spacing, along)
    mesh = extract_surface(volume)
    told = faces_at_ends(mesh, volume)

    centres = mesh.vertices[mesh.faces].mean(axis=1)
    across = (centres - middle) - ((centres - middle) @ along)[:, None] * along
    away, normals = (
        np.linalg.norm(across, axis=1),
        mesh.face_normals / np.linalg.norm(mesh.face_normals, axis=1)[:, None],
    )
    outwards = np.einsum("ij,ij->i", normals, across / np.maximum(away, 1e-9)[:, None])
    wall = (np.abs(away - RADIUS_MM) < 0.3) & (outwards > 0.8)
    cap = away < RADIUS_MM - 1.2
    assert cap.sum() > 100
    assert wall.sum() > 1000
    assert told[cap].all()
    assert not told[wall].any()
    for face in np.flatnonzero(told):  # one by one, in millimetres from the six planes through the last voxels
        ends = []
        for axis in range(3):
            for place, sign in ((volume.origin, 1.0), (volume.index_to_lps((COUNTS - 1.0)[None])[0], -1.0)):
                ends.append(sign * (mesh.vertices[mesh.faces[face]] - place) @ direction[:, axis] / spacing[axis])
        assert min(end.max() for end in ends) <= 1.0 + 1e-9


def test_the_volume_of_a_surface_is_the_finest_that_holds_it() -> None:
    along = np.array([0.0, 0.0, 1.0])
    fine, _ = tube(np.eye(3), np.full(3, 0.5), along)
    wide, _ = tube(np.eye(3), np.full(3, 2.0), along)
    mesh = extract_surface(fine)
    assert source_of(mesh, [wide, fine]) is fine
    assert source_of(extract_surface(wide), [wide, fine]) is wide
    assert source_of(mesh, []) is None
