"""The surface of a segmentation encloses its voxels, however thin what they make up is."""

from __future__ import annotations

import numpy as np
import pytest

from vfix_engine.anatomy.segmentation import Band, SegmentRequest, segment
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree

SPACING = np.array([0.5, 0.7, 1.2])
SHAPE = (13, 18, 20)  # K, J, I
LEFT_HANDED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def masks() -> dict[str, np.ndarray]:
    """Shapes in the middle of a grid, by name."""
    k, j, i = np.indices(SHAPE).astype(float)
    within = (np.abs(k - 6) < 5) & (np.abs(j - 9) < 7) & (np.abs(i - 10) < 8)
    oblique = 0.5 * (i - 10) + 0.6 * (j - 9) + 0.7 * (k - 6)
    speckle = np.random.default_rng(3).random(SHAPE) < 0.05
    return {
        "ball": (0.5 * (i - 10)) ** 2 + (0.7 * (j - 9)) ** 2 + (1.2 * (k - 6)) ** 2 < 3.8**2,
        "sheet of one voxel": within & (i == 10),
        "sheet of two voxels": within & (np.abs(k - 5.5) < 1),
        "oblique sheet": within & (np.abs(oblique) < 0.55),
        "oblique sheet of two voxels": within & (np.abs(oblique) < 1.1),
        "single voxels": speckle & within,
    }


def winding(mesh: TriangleMesh, points: np.ndarray) -> np.ndarray:
    """How often the mesh goes round each point: 1 inside, 0 outside. Van Oosterom & Strackee 1983, by brute force."""
    total = np.zeros(len(points))
    for corner in mesh.triangles:
        a, b, c = (point - points for point in corner)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        over = np.einsum("ij,ij->i", a, np.cross(b, c))
        under = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        total += 2.0 * np.arctan2(over, under)
    return total / (4.0 * np.pi)


def ct(mask: np.ndarray, inside: int, outside: int, direction: np.ndarray) -> Volume:
    return Volume(np.where(mask, inside, outside).astype(np.int16), np.array([5.0, -3.0, 2.0]), SPACING, direction)


def centres(volume: Volume) -> np.ndarray:
    k, j, i = (axis.ravel() for axis in np.indices(volume.hu.shape))
    return volume.index_to_lps(np.stack([i, j, k], axis=1).astype(float))


@pytest.mark.parametrize("name", sorted(masks()))
@pytest.mark.parametrize(
    ("inside", "outside", "direction"),
    [(-250, -1000, np.eye(3)), (200, 900, np.eye(3)), (40, -1000, LEFT_HANDED)],
    ids=["barely above", "barely below", "tissue in air"],
)
def test_every_voxel_lies_inside_and_no_other_one(name: str, inside: int, outside: int, direction: np.ndarray) -> None:
    """Also of values close to an end of the band, where the isosurface lies at the voxels' centres."""
    mask = masks()[name]
    volume = ct(mask, inside, outside, direction)
    found = segment(volume, SegmentRequest(Band(-300.0, 249.0)))
    turns = winding(found.mesh, centres(volume)).reshape(mask.shape)
    np.testing.assert_allclose(turns, mask, atol=1e-6)
    deep = ProximityTree(found.mesh).point_distance(centres(volume)[mask.ravel()])[0].min()
    # An octahedron of half a voxel's sides is the least that is drawn of one.
    assert deep > 0.99 / np.sqrt(((2.0 / SPACING) ** 2).sum())


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("ball", 0.96, 1.0),
        ("sheet of one voxel", 0.9, 1.0),
        ("sheet of two voxels", 0.9, 1.0),
        ("oblique sheet", 0.8, 1.0),
        ("oblique sheet of two voxels", 0.85, 1.0),
    ],
)
def test_it_encloses_what_was_shown(name: str, least: float, most: float) -> None:
    """Half-way surfaces leave out edges and corners only; measured against the voxels' volume."""
    found = segment(ct(masks()[name], -250, -1000, np.eye(3)), SegmentRequest(Band(-300.0, 249.0)))
    assert found.volume_mm3 == pytest.approx(masks()[name].sum() * SPACING.prod())
    assert found.enclosed_mm3 == pytest.approx(found.mesh.volume_mm3)
    assert least < found.enclosed_mm3 / found.volume_mm3 <= most


def test_where_the_units_put_the_border_beyond_half_way_it_lies_there() -> None:
    """A slab of 600 HU in tissue of 40 HU: the level of 250 HU lies 0.62 of the way out."""
    mask = masks()["sheet of two voxels"]
    found = segment(ct(mask, 600, 40, np.eye(3)), SegmentRequest(Band(250.0, 10_000.0)))
    upper = found.mesh.bounds[1][2]
    assert upper == pytest.approx(2.0 + 1.2 * (6 + (600 - 249.5) / 560))


@pytest.mark.parametrize("name", ["sheet of one voxel", "oblique sheet", "single voxels"])
def test_smoothing_keeps_what_is_thinner_than_it(name: str) -> None:
    """Every centre stays inside, and no point of a voxel's border half-way lies farther than is told."""
    mask = masks()[name]
    volume = ct(mask, 40, -1000, np.eye(3))
    sharp = segment(volume, SegmentRequest(Band(-300.0, 249.0)))
    smooth = segment(volume, SegmentRequest(Band(-300.0, 249.0), smooth_mm=1.5))
    turns = winding(smooth.mesh, centres(volume)[mask.ravel()])
    np.testing.assert_allclose(turns, 1.0, atol=1e-6)
    random = np.random.default_rng(4).dirichlet(np.ones(3), 20)
    places = np.einsum("pc,fci->fpi", random, sharp.mesh.triangles).reshape(-1, 3)
    moved = ProximityTree(smooth.mesh).point_distance(places)[0].max()
    assert moved <= smooth.smoothed_mm < 1.0
