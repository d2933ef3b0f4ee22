"""Centrelines: of the real colon against its authors' line, of made-up colons against what they were made of."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vfix_engine.anatomy.lumen import voxel_pieces
from vfix_engine.anatomy.lumen.centreline import Centreline, centreline_between
from vfix_engine.anatomy.lumen.synthetic import SyntheticCourse, synthetic_colon, synthetic_course, write_stl
from vfix_engine.anatomy.lumen.voxels import VoxelLumen, piece_with, voxels_of
from vfix_engine.errors import InputError, PathwayError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree

Array = NDArray[np.float64]


def volume(lumen: VoxelLumen) -> float:
    """Of the inside, mm³."""
    return float(np.count_nonzero(lumen.inside)) * lumen.voxel_mm**3


def apart(points: Array, line: Array) -> Array:
    """Distances from points to a polyline, of which samples every 0.5 mm or so are taken."""
    share = np.linspace(0.0, 1.0, 5)[:, None, None]
    samples = ((1.0 - share) * line[:-1] + share * line[1:]).reshape(-1, 3)
    return cKDTree(samples).query(points)[0]


# The real colon


def test_the_real_centreline_is_that_of_the_authors(colon_centreline: Centreline, published_centreline: Array) -> None:
    """Their line is 2,390 mm long and wiggles by more than a millimetre itself."""
    ours = colon_centreline.curve
    assert np.linalg.norm(np.diff(published_centreline, axis=0), axis=1).max() < 8.0
    for points, line in ((published_centreline, ours.points), (ours.points, published_centreline)):
        distance = apart(points, line)
        assert np.median(distance) <= 2.0
        assert np.percentile(distance, 95) <= 8.0
    assert 2100.0 <= ours.length <= 2450.0


def test_landmarks_lie_along_it_in_their_order(colon_centreline: Centreline, colon_info: dict[str, Array]) -> None:
    s = [colon_centreline.curve.closest(place) for place in colon_info.values()]
    assert (np.diff(s) > 5.0).all()


def test_its_radii_are_distances_to_the_surface(colon: TriangleMesh, colon_centreline: Centreline) -> None:
    """The median of the authors' radii on the first 800 mm is 11.7 mm; a voxel's diagonal is 2.6 mm."""
    curve, radius = colon_centreline.curve, colon_centreline.radius
    assert radius.shape == (len(curve.points),)
    assert not radius.flags.writeable
    assert 10.0 <= np.median(radius[curve.step_mm * np.arange(len(radius)) < 800.0]) <= 14.0
    picked = np.linspace(0, len(radius) - 1, 9).astype(int)
    corners = colon.triangles.reshape(-1, 3)
    to_corner = cKDTree(corners).query(curve.points[picked])[0]
    longest = np.linalg.norm(np.diff(colon.triangles, axis=1), axis=2).max()
    assert (radius[picked] <= to_corner + 1e-9).all()
    assert (radius[picked] >= to_corner - longest).all()


def test_its_radii_are_those_of_the_authors(colon_centreline: Centreline, trial_data: Path) -> None:
    """At the place of ours nearest to each of theirs; where a line lies off the middle its radius is smaller."""
    file = trial_data / "colon" / "colon_centreline_published_lps_mm.csv"
    table = np.genfromtxt(file, delimiter=",", skip_header=1)
    nearest = cKDTree(colon_centreline.curve.points).query(table[:, 1:4])[1]
    off = np.abs(colon_centreline.radius[nearest] - table[:, 4])
    assert np.median(off) <= 1.0
    assert np.percentile(off, 95) <= 3.5
    first = off[table[:, 0] < 720.0]
    assert np.median(first) <= 0.75
    assert np.percentile(first, 95) <= 2.25


def test_voxels_have_the_volume_of_the_mask(colon: TriangleMesh, colon_info: dict[str, Array]) -> None:
    """3.61 litre in the image that the surface was made of."""
    assert volume(voxels_of(colon, 2.0)) == pytest.approx(3.6103e6, rel=0.02)


# Made-up colons


def test_a_made_up_colon_gives_its_course_back(made_up_colon: TriangleMesh, made_up_course: SyntheticCourse) -> None:
    course = made_up_course.curve
    found = centreline_between(made_up_colon, course.points[0], course.points[-1], voxel_mm=2.0)
    distance = apart(found.curve.points, course.points)
    assert np.median(distance) <= 1.0
    assert distance.max() <= 3.0
    assert found.curve.length == pytest.approx(course.length, rel=0.02)
    assert 9.0 <= found.radius.min() <= found.radius.max() <= 18.0


def test_a_false_shortcut_is_taken_with_power_1_and_not_with_3() -> None:
    """A hole of 2 mm radius through walls that touch: 140 mm of way instead of 670."""
    course, colon = synthetic_course(fused=True), synthetic_colon(fused=True)
    ends = course.curve.points[0], course.curve.points[-1]
    assert centreline_between(colon, *ends, power=1.0).curve.length < 200.0
    found = centreline_between(colon, *ends).curve
    assert found.length == pytest.approx(course.curve.length, rel=0.02)
    assert apart(found.points, course.curve.points).max() <= 4.0


def test_smoothing_keeps_the_ends_and_shortens_the_way(
    made_up_colon: TriangleMesh, made_up_course: SyntheticCourse
) -> None:
    ends = made_up_course.curve.points[0], made_up_course.curve.points[-1]
    raw, smooth = (centreline_between(made_up_colon, *ends, voxel_mm=3.0, smooth_mm=w).curve for w in (0.0, 4.0))
    assert smooth.length < raw.length
    assert smooth.bending().max() < raw.bending().max()
    np.testing.assert_allclose(smooth.points[[0, -1]], raw.points[[0, -1]], atol=1e-6)


def test_a_click_outside_is_moved_into_the_lumen(made_up_colon: TriangleMesh, made_up_course: SyntheticCourse) -> None:
    curve = made_up_course.curve
    outside = curve.points[0] - 16.0 * curve.tangent(0.0)
    found = centreline_between(made_up_colon, outside, curve.position(100.0), voxel_mm=2.0)
    assert np.linalg.norm(found.curve.points[0] - outside) <= 8.0 + 1e-9
    assert found.radius[0] > 4.0


@pytest.mark.parametrize("seed", [1, 2])
def test_every_seed_is_another_closed_colon(seed: int) -> None:
    colon, course = synthetic_colon(seed), synthetic_course(seed)
    edges = np.sort(np.concatenate([colon.faces[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert colon.content_hash == synthetic_colon(seed).content_hash != synthetic_colon(0).content_hash
    assert 580.0 < course.curve.length < 620.0
    nearest = ProximityTree(colon).point_distance(course.curve.points)[0]
    np.testing.assert_allclose(nearest, course.radius, atol=4.0)
    outward = np.einsum("fi,fij->fj", np.full((len(colon.faces), 3), 1.0 / 3.0), colon.triangles)
    around = outward - course.curve.points[cKDTree(course.curve.points).query(outward)[1]]
    assert np.mean(np.einsum("ij,ij->i", around, colon.face_normals) > 0.0) > 0.99


def test_an_stl_comes_back_as_it_was_written(made_up_colon: TriangleMesh, tmp_path: Path) -> None:
    write_stl(tmp_path / "colon.stl", made_up_colon)
    back = read_mesh(tmp_path / "colon.stl", assume=True)[0]
    np.testing.assert_allclose(back.triangles, made_up_colon.triangles, atol=1e-4)


# Parity


def box(low: Array, size: Array) -> tuple[Array, NDArray[np.int64]]:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return low + size * corners, np.array(faces)


def test_voxels_of_boxes_are_exact() -> None:
    """Corners and edges on the very lines of voxels, two pieces, and one triangle missing."""
    rng = np.random.default_rng(3)
    vertices, faces = zip(
        box(np.zeros(3), np.full(3, 8.0)), box(np.array([20.0, 1.0, 2.0]), np.array([6.0, 9.0, 7.0])), strict=True
    )
    mesh = TriangleMesh(np.concatenate(vertices), np.concatenate([faces[0], faces[1] + 8]))
    lumen = voxels_of(mesh, 1.0)
    places = lumen.place(np.argwhere(np.ones(lumen.inside.shape, dtype=bool)))
    inside = lumen.inside.ravel()
    first = ((places > 0.0) & (places < 8.0)).all(axis=1)
    second = ((places > [20.0, 1.0, 2.0]) & (places < [26.0, 10.0, 9.0])).all(axis=1)
    np.testing.assert_array_equal(inside, first | second)
    holed = voxels_of(TriangleMesh(mesh.vertices, np.delete(mesh.faces, rng.integers(24), axis=0)), 1.0)
    np.testing.assert_array_equal(holed.inside, lumen.inside)
    voxel = tuple(np.argwhere(lumen.inside)[-1])
    assert volume(piece_with(lumen, voxel)) == np.count_nonzero(second)


def test_pieces_that_overlap_are_one_and_one_within_is_a_hole() -> None:
    """Counted together, what two closed pieces share would be outside."""
    first, second, hole = (
        box(np.zeros(3), np.array([20.0, 8.0, 8.0])), box(np.array([12.0, 2.0, 2.0]), np.array([20.0, 4.0, 4.0])),
        box(np.array([2.0, 2.0, 2.0]), np.full(3, 4.0)),
    )  # fmt: skip
    pieces = [first, second, hole]
    vertices = np.concatenate([one[0] for one in pieces])
    faces = np.concatenate([one[1] + 8 * k for k, one in enumerate(pieces)])
    lumen = voxels_of(TriangleMesh(vertices, faces), 1.0)
    assert volume(lumen) == 20 * 8 * 8 + (32 - 20) * 4 * 4 - 4**3


def test_voxels_that_memory_does_not_hold_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the figures, before any is made."""
    monkeypatch.setattr(voxel_pieces, "_memory_bytes", lambda: 4_000_000_000)
    large = TriangleMesh(*box(np.zeros(3), np.full(3, 500.0)))
    with pytest.raises(InputError, match=r"500 × 500 × 500 mm and take 4\.6 GB, of the 4\.0 GB of this machine"):
        voxels_of(large, 1.5)
    assert volume(voxels_of(large, 10.0)) == 500.0**3


# What cannot be used


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"start": [0.0, float("nan"), 0.0]}, InputError, "start .* no point"),
        ({"end": [1.0, 2.0]}, InputError, "end .* no point"),
        ({"start": [300.0, 0.0, 0.0]}, PathwayError, "start .* lies [0-9]{3}[.][0-9] mm from the lumen"),
        ({"voxel_mm": 0.0}, InputError, "edge of 0.0 mm"),
        ({"voxel_mm": 0.01}, InputError, "take larger ones"),
        ({"power": -1.0}, InputError, "power"),
        ({"smooth_mm": float("inf")}, InputError, "smoothing"),
        ({"end": "start"}, PathwayError, "same place"),
    ],
)
def test_what_cannot_be_used_is_said(
    made_up_colon: TriangleMesh, made_up_course: SyntheticCourse, changes: dict, error: type[Exception], words: str
) -> None:
    points = made_up_course.curve.points
    asked = {"start": points[0], "end": points[-1], "voxel_mm": 3.0} | changes
    if isinstance(asked["end"], str):
        asked["end"] = asked["start"]
    with pytest.raises(error, match=words):
        centreline_between(made_up_colon, **asked)


def test_a_surface_that_encloses_nothing_is_refused() -> None:
    leaf = TriangleMesh([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [0.0, 30.0, 0.0]], [[0, 1, 2]])
    with pytest.raises(PathwayError, match="encloses no voxel"):
        centreline_between(leaf, [5.0, 5.0, 0.0], [9.0, 5.0, 0.0])


def test_clicks_in_two_pieces_are_refused() -> None:
    vertices, faces = box(np.zeros(3), np.full(3, 20.0))
    both = TriangleMesh(
        np.concatenate([vertices, vertices + np.array([40.0, 0.0, 0.0])]), np.concatenate([faces, faces + 8])
    )
    with pytest.raises(PathwayError, match="another piece"):
        centreline_between(both, [10.0, 10.0, 10.0], [50.0, 10.0, 10.0])
