"""Bone without what is to be removed: by brute force on shapes whose answer is known."""

import numpy as np
import pytest

from vfix_engine.anatomy.opened_bone import PIECE_MM, opened_bone
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shape_surface import border_triangles
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from vfix_engine.proximity.proximity import ProximityTree

TURNED = np.array([[0.8, -0.6, 0.0, 9.0], [0.6, 0.8, 0.0, 9.0], [0.0, 0.0, 1.0, 10.0], [0.0, 0.0, 0.0, 1.0]])
REGIONS: dict[str, tuple[Shape, ...]] = {
    "sphere": (Sphere([9.0, 9.0, 12.0], 4.0),),
    "capsule": (CapsuleShape([6.0, 7.0, 12.0], [13.0, 11.0, 5.0], 2.0),),
    "box": (Box(TURNED, [2.5, 3.0, 4.0]),),
    "overlapping": (Sphere([8.0, 9.0, 12.0], 3.0), CapsuleShape([8.0, 9.0, 12.0], [12.0, 10.0, 7.0], 2.0)),
}
TOP_MM = 12.0  # bone lies below it


def slab() -> Volume:
    """Bone below z = 12 mm, air above; linear between, so that its surface is exactly there."""
    k = np.arange(36)[:, None, None] * 0.5
    hu = np.clip(249.5 + 800.0 * (TOP_MM - k), -1000, 1400) * np.ones((1, 40, 40))
    return Volume(np.rint(hu).astype(np.int16), [0.0, 0.0, 0.0], [0.5, 0.5, 0.5], np.eye(3))


def left_distance(points: np.ndarray, regions: tuple[Shape, ...]) -> np.ndarray:
    """To the bone that is left, by brute force over a fine grid of its places."""
    from scipy.spatial import cKDTree

    axis = np.arange(2.0, 16.0, 0.1)
    grid = np.stack(np.meshgrid(axis, axis, np.arange(2.0, TOP_MM + 0.01, 0.1), indexing="ij"), axis=-1).reshape(-1, 3)
    for region in regions:
        grid = grid[signed_distance(region, grid) > 0.0]
    return np.asarray(cKDTree(grid).query(points)[0])


@pytest.mark.parametrize("name", list(REGIONS))
@pytest.mark.parametrize("with_ct", [True, False])
def test_the_distance_is_that_of_the_bone_that_is_left(name: str, with_ct: bool) -> None:
    ct, regions = slab(), REGIONS[name]
    mesh = extract_surface(ct)
    opened = opened_bone(mesh, regions, ct if with_ct else None)
    random = np.random.default_rng(8)
    points = random.uniform([4.0, 4.0, 4.0], [14.0, 14.0, 15.0], (4000, 3))
    free = (points[:, 2] > TOP_MM + 0.05) | np.any([signed_distance(r, points) < -0.05 for r in regions], axis=0)
    points = points[free]
    assert len(points) > 500
    found = ProximityTree(opened.mesh).point_distance(points)[0]
    true = left_distance(points, regions)
    assert (found <= true + 0.02).all(), "no bone is missing"
    assert np.abs(found - true).max() < 0.12, "and none is made up, to the steps of the grid that is compared with"


@pytest.mark.parametrize("name", list(REGIONS))
def test_nothing_outside_changes_and_nothing_stays_inside(name: str) -> None:
    ct, regions = slab(), REGIONS[name]
    mesh = extract_surface(ct)
    opened = opened_bone(mesh, regions, ct).mesh
    weights = np.random.default_rng(9).dirichlet(np.ones(3), 5)
    before = np.einsum("pc,fci->fpi", weights, mesh.triangles).reshape(-1, 3)
    outside = np.all([signed_distance(region, before) > 0.0 for region in regions], axis=0)
    assert ProximityTree(opened).point_distance(before[outside])[0].max() < 1e-9
    for region in regions:
        deepest = -signed_distance(region, opened.vertices).min()
        assert deepest <= PIECE_MM + 1e-9


def test_the_new_surface_is_turned_into_the_opening() -> None:
    ct, regions = slab(), (Sphere([9.0, 9.0, 8.0], 3.0),)  # wholly within bone
    opened = opened_bone(extract_surface(ct), regions, ct).mesh
    middle = opened.triangles.mean(axis=1)
    new = np.linalg.norm(middle - [9.0, 9.0, 8.0], axis=1) < 3.1
    into = np.array([9.0, 9.0, 8.0]) - middle[new]
    assert (np.einsum("ij,ij->i", opened.face_normals[new], into) > 0.0).all()


def test_the_volume_that_is_removed() -> None:
    ct = slab()
    mesh = extract_surface(ct)
    ball = 4.0 / 3.0 * np.pi * 3.0**3
    within = (Sphere([9.0, 9.0, 7.0], 3.0),)
    half = (Sphere([9.0, 9.0, TOP_MM], 3.0),)
    assert opened_bone(mesh, within, ct).removed_mm3 == pytest.approx(ball, rel=0.01)
    assert opened_bone(mesh, half, ct).removed_mm3 == pytest.approx(ball / 2.0, rel=0.02)
    assert opened_bone(mesh, within + within, ct).removed_mm3 == pytest.approx(ball, rel=0.01), "once"
    assert opened_bone(mesh, within, None).removed_mm3 == pytest.approx(ball, rel=0.01)
    assert opened_bone(mesh, (Sphere([9.0, 9.0, 16.0], 2.0),), ct).removed_mm3 == 0.0


@pytest.mark.parametrize("shape", [*REGIONS["sphere"], *REGIONS["capsule"], *REGIONS["box"]])
def test_the_border_of_a_shape_is_closed_and_on_it(shape: Shape) -> None:
    triangles = border_triangles(shape, 0.4)
    assert np.abs(signed_distance(shape, triangles.reshape(-1, 3))).max() < 1e-9
    assert signed_distance(shape, triangles.mean(axis=1)).max() < 1e-9, "inscribed"
    keys = np.round(triangles, 6)
    _, number = np.unique(keys.reshape(-1, 3), axis=0, return_inverse=True)
    faces = number.reshape(-1, 3).astype(np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = edges[:, 0] * 10**6 + edges[:, 1], edges[:, 1] * 10**6 + edges[:, 0]
    assert len(np.unique(there)) == len(there)
    assert np.array_equal(np.sort(there), np.sort(back))
    centre = triangles.reshape(-1, 3).mean(axis=0)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert (np.einsum("ij,ij->i", normals, triangles.mean(axis=1) - centre) > 0).all()


def test_no_region_is_no_change_and_a_half_space_is_refused() -> None:
    ct = slab()
    mesh = extract_surface(ct)
    assert opened_bone(mesh, (), ct).mesh is mesh
    with pytest.raises(InputError, match="half-space"):
        opened_bone(mesh, (HalfSpace([0, 0, 9.0], [0, 0, 1.0]),), ct)


UPRIGHT = np.eye(4)


def box_at(x: float) -> Box:
    """A cube of 10 mm in the middle of the block, moved along x."""
    return Box(UPRIGHT + np.array([[0.0, 0.0, 0.0, x], [0.0] * 4, [0.0] * 4, [0.0] * 4]), [5.0, 5.0, 5.0])


SHARED: dict[str, tuple[tuple[Shape, ...], float]] = {
    "one sphere": ((Sphere([0.0] * 3, 8.0),), 256.0 * np.pi),
    "a sphere twice": ((Sphere([0.0] * 3, 8.0),) * 2, 2.0 * 256.0 * np.pi),
    "a box twice": ((box_at(0.0),) * 2, 1200.0),
    "boxes flush on four sides": ((box_at(0.0), box_at(5.0)), 1000.0),
    "boxes side by side": ((box_at(0.0), box_at(10.0)), 1000.0),
}


@pytest.mark.parametrize("name", list(SHARED))
def test_regions_that_share_a_border_keep_it_and_no_wall_between_them(name: str) -> None:
    """HAZ-01: a border that two regions share is still bone; it is there once for each of them."""
    regions, area_mm2 = SHARED[name]
    corners = border_triangles(Box(UPRIGHT, [20.0] * 3), 5.0).reshape(-1, 3)
    block = TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))
    opened = opened_bone(block, regions, inside=lambda points: (np.abs(points) <= 20.0).all(axis=1)).mesh
    new = opened.triangles[(np.abs(opened.triangles) < 19.9).all(axis=(1, 2))]
    areas = np.linalg.norm(np.cross(new[:, 1] - new[:, 0], new[:, 2] - new[:, 0]), axis=1) / 2.0
    assert areas.sum() == pytest.approx(area_mm2, rel=0.01)


def test_a_region_too_small_to_have_a_border_removes_nothing() -> None:
    ct = slab()
    mesh = extract_surface(ct)
    opened = opened_bone(mesh, [Sphere([9.0, 9.0, 11.0], 1e-300)], ct)
    assert opened.removed_mm3 == 0.0
    assert len(opened.mesh.faces) == len(mesh.faces)
