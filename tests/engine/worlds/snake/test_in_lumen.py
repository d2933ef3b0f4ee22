"""A lumen of one's own: from a surface and two clicks to a snake at its entrance."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from vfix_engine import SnakeDrive, TriangleMesh
from vfix_engine.anatomy.lumen.centreline import centreline_between
from vfix_engine.errors import PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.pathway.fit import fit_pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.conform.follow import followable
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.narrow import narrowest
from vfix_engine.worlds.snake.offline.drive_lumen import DriveSettings, SnakeCommand

SETTINGS = DriveSettings(contours=12, interpolated=45, vertices_per_link=30, bends=4, step_s=0.01)
START, END = np.array([0.0, 0.0, -120.0]), np.array([0.0, 0.0, 120.0])


@pytest.fixture(scope="module")
def tube() -> TriangleMesh:
    """A straight tube of 12 mm radius along z, 300 mm long."""
    cylinder = trimesh.creation.cylinder(radius=12.0, height=300.0, sections=48)
    return TriangleMesh(cylinder.vertices, cylinder.faces)


def test_a_snake_is_put_before_the_entrance_of_a_surface(tube: TriangleMesh) -> None:
    """As with the lumen and the drive made one by one; and it goes in."""
    drive = SnakeDrive.in_lumen(tube, START, END, links=6, settings=SETTINGS)
    lumen = lumen_between(tube, START, END, SnakeModel(1), SETTINGS)
    same = SnakeDrive(SnakeModel(6), lumen.pathway, SETTINGS, lumen.curve, lumen.slack)
    np.testing.assert_array_equal(drive.q, same.q)
    np.testing.assert_array_equal(drive.state.base, same.state.base)
    assert drive.snake.links == 6
    for _ in range(50):
        state = drive.step(SnakeCommand(insert_mm_per_s=20.0))
    assert 9.0 < drive.tip_s <= 10.0  # at 20 mm/s; a little less where the shape changes fast
    assert (state.deviation.depth <= drive.bound).all()


def test_without_a_number_the_links_reach_the_end(tube: TriangleMesh) -> None:
    drive = SnakeDrive.in_lumen(tube, START, END, settings=SETTINGS, snake=SnakeModel(1, length_mm=20.0), tip_s=30.0)
    assert drive.tip_s == 30.0
    assert drive.snake.reach_mm() >= drive.length_mm > drive.snake.reach_mm() - 20.0


def test_a_click_stays_where_the_lumen_is_equally_wide(tube: TriangleMesh) -> None:
    """Every place on the axis is as far from the wall; only the voxels' raster moves the click."""
    curve = centreline_between(tube, START, END).curve
    for asked, found in ((START, curve.points[0]), (END, curve.points[-1])):
        assert np.linalg.norm(found - asked) < 1.5


@pytest.mark.parametrize(
    ("start", "end", "remedy"),
    [
        ([0.0, 0.0, -190.0], END, "set it inside"),
        (START, START + np.array([0.0, 0.0, 60.0]), "set start and end farther apart"),
    ],
)
def test_a_click_that_is_refused_comes_with_a_remedy(
    tube: TriangleMesh, start: np.ndarray, end: np.ndarray, remedy: str
) -> None:
    with pytest.raises(PathwayError, match=remedy):
        SnakeDrive.in_lumen(tube, start, end, links=6, settings=SETTINGS)


def two_tight_bends() -> np.ndarray:
    """(n, 3) a way with two bends of 10 mm radius by 130° to either side, and an end 25 mm behind the second."""
    place, towards, points = np.zeros(2), 0.5 * np.pi, [np.zeros(2)]
    for straight, turn in ((60.0, 130.0), (35.0, -130.0), (25.0, 0.0)):
        for step, bend in ((2.0, 0.0),) * round(straight / 2.0) + ((10.0 * np.radians(10.0), turn / 13.0),) * 13 * bool(
            turn
        ):
            towards += 0.5 * np.radians(bend)
            place = place + step * np.array([np.cos(towards), np.sin(towards)])
            towards += 0.5 * np.radians(bend)
            points.append(place)
    return np.insert(np.array(points), 1, 0.0, axis=1)


def tube_about(line: np.ndarray, radius: float) -> TriangleMesh:
    """The surface of the balls of a radius about a line (n, 3)."""
    centres, voxel = Curve.through(line, 2.0).points, 1.5
    axes = [
        np.arange(low - radius - 5.0, high + radius + 5.0, voxel)
        for low, high in zip(line.min(0), line.max(0), strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    away = cKDTree(centres).query(grid.reshape(-1, 3))[0].reshape(grid.shape[:3])
    vertices, faces, _, _ = marching_cubes(away - radius, 0.0, gradient_direction="descent")
    return TriangleMesh(grid[0, 0, 0] + voxel * vertices.astype(np.float64), faces)


def test_a_wide_lumen_with_tight_bends_is_not_called_narrower_than_the_robot() -> None:
    """A curve that gives up its slack for gentle turns comes 10 mm off the middle there, and contours about it are
    narrow; then it is looked for again with more weight on the slack."""
    way, snake = two_tight_bends(), SnakeModel(30)
    mesh = tube_about(way, 12.0)
    line = centreline_between(mesh, way[4], way[-4])
    assert line.radius.min() > snake.radius_mm + 3.0
    lumen = lumen_between(mesh, way[4], way[-4], SnakeModel(1), DriveSettings())
    found = narrowest(lumen.pathway, snake, None, lumen.curve.length, lumen.curve, middle=lumen.centreline)
    assert found.first is None
    once = followable(line, SnakeModel(1))
    before = narrowest(fit_pathway(mesh, once), snake, None, once.length, once, middle=line)
    assert before.first is not None  # what the lumen would be called with the curve that is looked for first
    assert before.first.off_mm is not None
    assert before.first.off_mm > 5.0
    assert "off the middle of the lumen, whose radius is 1" in before.first.words
    off, off_once = (cKDTree(line.curve.points).query(curve.points)[0].max() for curve in (lumen.curve, once))
    assert off < off_once - 1.0
