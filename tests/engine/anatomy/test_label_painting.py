"""Strokes against every voxel's distance, run lengths, and closed surfaces as voxels against scipy's filled shapes."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from vfix_engine.anatomy.labels.label_map import CroppedLabel
from vfix_engine.anatomy.labels.painting import Stroke, draw_stroke, mask_of_runs, reaches, runs_of
from vfix_engine.anatomy.labels.seg_nrrd import read_seg_nrrd
from vfix_engine.anatomy.labels.surfaces import surface_of
from vfix_engine.anatomy.labels.voxelized import voxels_inside
from vfix_engine.anatomy.labels.writing import label_file
from vfix_engine.errors import ImageError
from vfix_engine.geometry.mesh import TriangleMesh

SHAPE = (24, 30, 36)  # K, J, I
SPACING = np.array([0.5, 0.7, 1.1])


def tilted() -> np.ndarray:
    affine = np.eye(4)
    affine[:3, :3] = Rotation.from_rotvec([0.2, -0.1, 0.3]).as_matrix() * SPACING
    affine[:3, 3] = [-5.0, 12.0, 3.0]
    return affine


def centres(affine: np.ndarray) -> np.ndarray:
    k, j, i = np.indices(SHAPE)
    return np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]


def to_line(places: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    way = end - start
    part = np.clip((places - start) @ way / max(way @ way, 1e-30), 0.0, 1.0)
    return np.linalg.norm(places - start - part[..., None] * way, axis=-1)


def test_a_ball_is_every_voxel_within_its_radius_of_the_way() -> None:
    affine = tilted()
    points = np.array([[8.0, 10.0, 12.0], [17.0, 14.0, 12.0], [30.0, 20.0, 20.0]]) @ affine[:3, :3].T + affine[:3, 3]
    mask = np.zeros(SHAPE, dtype=bool)
    draw_stroke(mask, affine, Stroke("paint", "ball", 2.3, tuple(map(tuple, points.tolist()))))
    places = centres(affine)
    near = np.minimum(*(to_line(places, points[n], points[n + 1]) for n in range(2)))
    np.testing.assert_array_equal(mask, near <= 2.3)
    draw_stroke(mask, affine, Stroke("erase", "ball", 1.0, (tuple(points[1].tolist()),)))
    gone = np.linalg.norm(places - points[1], axis=-1) <= 1.0
    np.testing.assert_array_equal(mask, (near <= 2.3) & ~gone)
    assert gone.any()


@pytest.mark.parametrize("axis", range(3))
def test_a_disc_paints_one_layer_of_voxels(axis: int) -> None:
    affine = tilted()
    normal = affine[:3, axis] / np.linalg.norm(affine[:3, axis])
    index = np.array([18.0, 15.0, 12.0])
    index[axis] += 0.3  # not at a voxel's centre
    centre = affine[:3, :3] @ index + affine[:3, 3]
    mask = np.zeros(SHAPE, dtype=bool)
    draw_stroke(mask, affine, Stroke("paint", "disc", 3.0, (tuple(centre.tolist()),), tuple(normal.tolist())))
    away = (centres(affine) - centre) @ normal
    across = np.linalg.norm(centres(affine) - centre - away[..., None] * normal, axis=-1)
    layer = np.indices(SHAPE)[2 - axis] == index[axis] // 1
    np.testing.assert_array_equal(mask, layer & (across <= 3.0))
    assert mask.any()


def voxel_by_voxel(affine: np.ndarray, stroke: Stroke) -> np.ndarray:
    """The voxels of a stroke, each asked for itself in the arithmetic of the page."""
    k, j, i = np.indices(SHAPE).astype(float)
    mask = np.zeros(SHAPE, dtype=bool)
    half = 0.0
    if stroke.brush == "disc":
        half = 0.5 * max(abs(float(affine[:3, n] @ stroke.normal)) for n in range(3))
    for start, end in zip(stroke.points, stroke.points[1:] or stroke.points, strict=False):
        xyz = [((row[0] * i + row[1] * j) + row[2] * k) + row[3] - at for row, at in zip(affine, start, strict=False)]
        way, normal = np.subtract(end, start), np.array(stroke.normal)
        hit = np.ones(SHAPE, dtype=bool)
        if stroke.brush == "disc":
            away = (xyz[0] * normal[0] + xyz[1] * normal[1]) + xyz[2] * normal[2]
            hit = (away >= -half) & (away < half)
            xyz = [part - away * n for part, n in zip(xyz, normal, strict=True)]
            way = way - ((way[0] * normal[0] + way[1] * normal[1]) + way[2] * normal[2]) * normal
        if (length := (way[0] * way[0] + way[1] * way[1]) + way[2] * way[2]) > 0.0:
            share = np.clip(((xyz[0] * way[0] + xyz[1] * way[1]) + xyz[2] * way[2]) / length, 0.0, 1.0)
            xyz = [part - share * w for part, w in zip(xyz, way, strict=True)]
        square = (xyz[0] * xyz[0] + xyz[1] * xyz[1]) + xyz[2] * xyz[2]
        mask |= hit & (square <= stroke.radius_mm * stroke.radius_mm)
    return mask


@pytest.mark.parametrize("seed", range(40))
def test_whole_rows_are_judged_as_each_voxel_is(seed: int) -> None:
    """Rows along the line and across it, discs in a slice, lines of no length, radii below a voxel: bit by bit."""
    rng = np.random.default_rng(seed)
    affine = tilted() if seed % 2 else np.diag([0.7, 0.7, 1.3, 1.0])
    index = rng.uniform(-3.0, np.array(SHAPE[::-1]) + 3.0, (int(rng.integers(1, 4)), 3))
    if seed % 3 == 0:
        index = np.round(index)
        index[:, 1:] = index[0, 1:]  # along a row
    points = tuple(map(tuple, (index @ affine[:3, :3].T + affine[:3, 3]).tolist()))
    axis = int(rng.integers(3))
    normal = affine[:3, axis] / np.linalg.norm(affine[:3, axis])
    brush = "disc" if seed % 4 < 2 else "ball"
    stroke = Stroke("paint", brush, float(rng.choice([0.1, 0.7, 2.1, 9.0])), points, tuple(normal.tolist()))  # type: ignore[arg-type]
    mask = np.zeros(SHAPE, dtype=bool)
    draw_stroke(mask, affine, stroke)
    np.testing.assert_array_equal(mask, voxel_by_voxel(affine, stroke))
    assert not mask.any() or reaches(SHAPE, affine, stroke)


def test_beyond_the_grid_nothing_is_painted_and_bad_strokes_are_refused() -> None:
    mask = np.zeros(SHAPE, dtype=bool)
    draw_stroke(mask, tilted(), Stroke("paint", "ball", 2.0, ((500.0, 0.0, 0.0),)))
    assert not mask.any()
    assert not reaches(SHAPE, tilted(), Stroke("paint", "ball", 2.0, ((500.0, 0.0, 0.0),)))
    for wrong in (
        {"radius_mm": 0.0},
        {"radius_mm": float("nan")},
        {"points": ()},
        {"points": ((float("inf"), 0.0, 0.0),)},
        {"normal": (0.0, 0.0, 2.0)},
        {"mode": "fill"},
    ):
        given = {"mode": "paint", "brush": "disc", "radius_mm": 1.0, "points": ((0.0, 0.0, 0.0),)} | wrong
        with pytest.raises(ImageError):
            Stroke(**given)


def test_run_lengths_come_back() -> None:
    rng = np.random.default_rng(3)
    for mask in (rng.random(SHAPE) < 0.3, np.zeros(SHAPE, dtype=bool), np.ones(SHAPE, dtype=bool)):
        runs = runs_of(mask)
        np.testing.assert_array_equal(mask_of_runs(runs, SHAPE), mask)
    with pytest.raises(ImageError, match="fill"):
        mask_of_runs(np.array([3, 4], dtype=np.uint32), SHAPE)


def test_a_closed_surface_becomes_the_voxels_that_it_was_made_of() -> None:
    """A shell with a ball in it and holes, as the mask's own surface gives it back."""
    rng = np.random.default_rng(5)
    mask = ndimage.gaussian_filter(rng.random(SHAPE), 2.0) > 0.5
    label = CroppedLabel(1, "", None, mask, np.zeros(3, dtype=np.int64), tilted())
    np.testing.assert_array_equal(voxels_inside(surface_of(label).mesh, tilted(), SHAPE), mask)


def test_a_box_is_filled_and_an_open_surface_is_refused() -> None:
    corners = np.array([[x, y, z] for z in (2.2, 9.7) for y in (-50.0, 11.4) for x in (4.6, 20.1)])
    faces = np.array(
        [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
         [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]], dtype=np.int32
    )  # fmt: skip
    inside = voxels_inside(TriangleMesh(corners, faces), np.eye(4), SHAPE)
    expected = np.zeros(SHAPE, dtype=bool)
    expected[3:10, 0:12, 5:21] = True  # it sticks out of the grid along j
    np.testing.assert_array_equal(inside, expected)
    with pytest.raises(ImageError, match="open"):
        voxels_inside(TriangleMesh(corners, faces[:-1]), np.eye(4), SHAPE)


def painted() -> CroppedLabel:
    mask = np.zeros(SHAPE, dtype=bool)
    draw_stroke(mask, tilted(), Stroke("paint", "ball", 3.0, ((4.0, 20.0, 14.0),)))
    assert mask.any()
    return CroppedLabel(1, "Left wall", "#e69f00", mask, np.zeros(3, dtype=np.int64), tilted())


def test_a_written_nrrd_is_read_by_pynrrd(tmp_path: Path) -> None:
    file = tmp_path / "wall.seg.nrrd"
    file.write_bytes(label_file(painted(), "seg.nrrd"))
    values, header = nrrd.read(str(file), index_order="C")
    np.testing.assert_array_equal(values, painted().mask)
    np.testing.assert_allclose(header["space origin"], tilted()[:3, 3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(header["space directions"], tilted()[:3, :3].T, rtol=0, atol=1e-12)
    assert header["Segment0_Name"] == "Left wall"
    (read,) = read_seg_nrrd(file, {}).labels
    assert (read.name, read.colour, read.value) == ("Left wall", "#e69f00", 1)
    np.testing.assert_array_equal(
        np.sort(surface_of(read).mesh.vertices, 0), np.sort(surface_of(painted()).mesh.vertices, 0)
    )


def test_a_written_nifti_is_read_by_nibabel() -> None:
    image = nibabel.Nifti1Image.from_bytes(gzip.decompress(label_file(painted(), "nii.gz")))
    np.testing.assert_array_equal(np.asarray(image.dataobj).T > 0, painted().mask)
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ tilted()
    np.testing.assert_allclose(image.get_sform(), ras, rtol=0, atol=1e-5)
    np.testing.assert_allclose(image.get_qform(), ras, rtol=0, atol=1e-4)
    assert (image.header["intent_code"], image.header.get_xyzt_units()[0]) == (1002, "mm")


def test_the_page_has_strokes_of_the_engine_to_compare_with() -> None:
    """tests/web/label-strokes.json, which the page's arithmetic is held to."""
    affine = tilted()
    normal = (affine[:3, 2] / SPACING[2]).tolist()
    points = [
        (affine[:3, :3] @ at + affine[:3, 3]).round(3).tolist() for at in ([6, 8, 9.2], [15, 12, 9.2], [30, 25, 9.2])
    ]
    strokes = [
        {"mode": "paint", "brush": "disc", "radius_mm": 2.5, "normal": normal, "points": points},
        {"mode": "paint", "brush": "ball", "radius_mm": 3.1, "normal": [0.0, 0.0, 1.0], "points": points[1:]},
        {"mode": "erase", "brush": "ball", "radius_mm": 1.2, "normal": [0.0, 0.0, 1.0], "points": points[1:2]},
        {"mode": "paint", "brush": "disc", "radius_mm": 4.0, "normal": [0.6, 0.0, 0.8], "points": points[2:]},
    ]
    mask = np.zeros(SHAPE, dtype=bool)
    for stroke in strokes:
        given = stroke | {"points": tuple(map(tuple, stroke["points"])), "normal": tuple(stroke["normal"])}
        draw_stroke(mask, affine, Stroke(**given))
    told = {"shape": SHAPE[::-1], "affine": affine.tolist(), "strokes": strokes, "runs": runs_of(mask).tolist()}
    file = Path(__file__).parents[2] / "web" / "label-strokes.json"
    # where strokes are to be drawn otherwise: file.write_text(json.dumps(told) + "\n", encoding="utf-8")
    assert json.loads(file.read_text(encoding="utf-8")) == json.loads(json.dumps(told))
