"""A lumen of one's own: from a surface and two clicks to a snake at its entrance."""

import numpy as np
import pytest
import trimesh

from vfix_engine import SnakeDrive, TriangleMesh
from vfix_engine.anatomy.lumen.centreline import centreline_between
from vfix_engine.errors import PathwayError
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.lumen import lumen_between
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
