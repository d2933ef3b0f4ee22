"""Where the view can be turned to: ways that the robot can go, judged again, and what ends them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lumen_shapes import arc, straight

from vfix_engine.pathway.limits.limits import MOTION_TOLERANCE_MM
from vfix_engine.pathway.query.query import deviation_of_points
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.offline.look_round import planned
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.plans.look_plan import LookPlanner, view_of
from vfix_engine.worlds.snake.requests import SIDES
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.command import SnakeCommand

# A bend in which joints of 45° have little left: chords of 28 mm turn by 41°.
TIGHT = arc(40.0, 3.0, radius=11.0, contours=40)
SETTINGS = DriveSettings(vertices_per_link=30, bends=4, step_s=0.01)


def deepest(drive: SnakeDrive, q: np.ndarray) -> np.ndarray:
    """Depth (5,) of the distal links at joints (10,), each vertex against each segment of its window."""
    context, vertices = drive.distal_context(), drive.distal_context().query.vertices
    frames = context.snake.frames(q, context.base)[1:]
    found = np.zeros(context.snake.links)
    for link in range(context.snake.links):
        own = vertices.points[vertices.start[link] : vertices.start[link + 1]]
        placed = own @ frames[link, :3, :3].T + frames[link, :3, 3]
        found[link] = deviation_of_points(placed, context.packed, *context.window[link])[0].max()
    return found


def test_a_view_and_its_side() -> None:
    straight_view = np.eye(4)
    for side in range(SIDES):
        angle = side * math.pi / 4.0 + 0.1
        view = view_of(straight_view, np.array([0.5 * math.cos(angle), 0.5 * math.sin(angle), math.sqrt(0.75)]))
        assert view.turned == pytest.approx(math.radians(30.0))
        assert view.side() == side
        assert [view.looks_to(other) for other in range(SIDES)] == [other == side for other in range(SIDES)]


def test_every_way_keeps_the_bounds_and_looks_where_it_says() -> None:
    """In a bend that the joints hardly follow: each place of each way and places between them, measured literally."""
    drive = SnakeDrive(SnakeModel(6), TIGHT, SETTINGS, tip_s=112.0, longer_allowed=True)
    rest, bound = drive.distal_context().rest, drive.distal_context().bound
    assert np.degrees(np.abs(rest)).max() > 40.0
    planner, ways = planned(drive)
    assert len(ways) == SIDES
    for side, way in enumerate(ways):
        assert math.degrees(way.turned) > 15.0
        view = planner.seen(rest + way.bends[-1])
        assert view.looks_to(side)
        assert view.turned == pytest.approx(way.turned)
        assert way.held_by or way.turned >= planner.aim
        before = np.zeros(10)
        for bend in way.bends:
            assert np.abs(rest + bend).max() <= drive.snake.q_max
            assert (deepest(drive, rest + bend) <= bound).all()
            between = rest + 0.5 * (before + bend)
            assert (deepest(drive, between) <= bound + MOTION_TOLERANCE_MM).all()
            before = bend
        # It is a way of the robot's: out step by step, and back.
        for bend in [*way.bends, *way.bends[::-1], np.zeros(10)]:
            for _ in range(40):
                state = drive.step(SnakeCommand(bend=tuple(bend)))
                assert state.outcome in ("moved", "held", "rest")
                if np.abs(drive.bend - bend).max() < 1e-9:
                    break
            np.testing.assert_allclose(drive.bend, bend, atol=1e-9)
    assert any(way.turned < planner.aim for way in ways)


def test_a_side_that_no_pose_reaches() -> None:
    """In a tube hardly wider than the robot nothing turns far, along whatever path; and what ends it is named."""
    settings = DriveSettings(vertices_per_link=30, bends=4, bound_mm=0.2, tip_bound_mm=0.1)
    drive = SnakeDrive(SnakeModel(6), straight(300.0, 8.0), settings, tip_s=170.0)
    planner = LookPlanner(drive.distal_context(), drive.distal_limits, math.radians(45.0), drive.constants.first)
    path = planner.path(0)
    # One link across a tube of 8 mm, 6 mm thick: 2.1 mm and 2.2 mm off the axis at its ends.
    assert 5.0 < math.degrees(path.turned) < math.degrees(math.asin(4.3 / 28.0)) + 3.0
    assert "link 6 at its bound of 0.1 mm" in path.held_by
    assert planner.anywhere(0, 10) == pytest.approx(path.turned, abs=math.radians(1.0))
    wide = SnakeDrive(SnakeModel(6), straight(300.0, 25.0), SETTINGS, tip_s=170.0)
    assert all(path.turned >= math.radians(45.0) and path.held_by == "" for path in planned(wide)[1])
