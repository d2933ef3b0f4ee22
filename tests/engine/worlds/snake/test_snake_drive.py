"""Steps of the driven snake: what a command comes to, what holds it, and what it says then."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lumen_shapes import helix, straight

from vfix_engine.errors import InputError
from vfix_engine.pathway.limits.limits import beyond_text
from vfix_engine.pathway.tissue_motion import breathing
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.conform.conformance import conform
from vfix_engine.snake.conform.moved_off import moved_off
from vfix_engine.snake.control.wall_program import WallProgram
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.command import SnakeCommand

QUICK = DriveSettings(vertices_per_link=40, bends=4, step_s=0.008)


def test_without_a_command_nothing_moves() -> None:
    drive = SnakeDrive(SnakeModel(6), straight(300.0), QUICK, tip_s=170.0)
    q, base = drive.q.copy(), drive.state.base
    for command in (
        SnakeCommand(),
        SnakeCommand(math.nan, (0.0, 0.0)),
        SnakeCommand(0.0, (math.inf, 1.0)),
    ):
        state = drive.step(command)
        assert state.outcome == "rest"
        np.testing.assert_array_equal(state.q, q)
        np.testing.assert_array_equal(state.base, base)
    assert drive.state.refused_commands == 2
    for dt in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError):
            drive.step(SnakeCommand(), dt)


def test_of_a_command_that_is_not_finite_the_rest_is_carried_out() -> None:
    """'straighten' above all."""
    drive = SnakeDrive(SnakeModel(6), straight(300.0, 20.0), QUICK, tip_s=170.0)
    assert drive.step(SnakeCommand(10.0, (0.0, math.nan))).outcome == "moved"
    assert drive.tip_s == pytest.approx(170.08)
    for _ in range(30):
        drive.step(SnakeCommand(camera_mm_per_s=(100.0, 0.0)))
    bent = np.abs(drive.bend).max()
    for _ in range(10):
        drive.step(SnakeCommand(math.nan, (math.inf, 0.0), True, (math.nan,) * 10))
    assert np.abs(drive.bend).max() < bent - math.radians(2.0)
    assert drive.state.refused_commands == 11


def test_what_projects_a_shape_to_the_limits_is_compiled_before_the_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first call of an installation takes seconds."""
    answers: list[np.ndarray | None] = []
    solve = WallProgram.solve

    def solved(program: WallProgram, *given: Any) -> np.ndarray | None:
        answers.append(solve(program, *given))
        return answers[-1]

    monkeypatch.setattr(WallProgram, "solve", solved)
    SnakeDrive(SnakeModel(6), straight(300.0), QUICK, tip_s=170.0)
    assert answers
    assert all(answer is not None for answer in answers)


def test_a_step_that_is_cut_says_so() -> None:
    """By the joints' speed or by the longest step that is inserted: asked for was more."""
    drive = SnakeDrive(SnakeModel(6), straight(300.0, 20.0), QUICK, tip_s=170.0)
    state = drive.step(SnakeCommand(insert_mm_per_s=-1e300), 0.1)
    assert (state.outcome, state.limit) == ("shrunk", "step")
    assert drive.tip_s == pytest.approx(169.5)
    for control in ("parameterised", "qp"):
        drive = SnakeDrive(SnakeModel(6), straight(300.0, 20.0), replace(QUICK, control=control), tip_s=170.0)
        assert drive.step(SnakeCommand(camera_mm_per_s=(5.0, 0.0))).outcome == "moved"
        state = drive.step(SnakeCommand(camera_mm_per_s=(500.0, 0.0)))
        assert (state.outcome, state.limit) == ("shrunk", "speed")
        assert "36°/s" in str(state.held_by)
    curved = SnakeDrive(SnakeModel(5), helix(24.0, 12.0, 7.5, radius=10.0, contours=71), QUICK, tip_s=60.0)
    assert "speed" in {curved.step(SnakeCommand(insert_mm_per_s=20.0), 0.02).limit for _ in range(20)}


def test_a_link_at_its_bound_is_named_with_its_place_and_enough_digits() -> None:
    drive = SnakeDrive(SnakeModel(6), straight(300.0), QUICK, tip_s=170.0)
    for _ in range(300):
        state = drive.step(SnakeCommand(camera_mm_per_s=(60.0, 0.0)))
    assert (state.outcome, state.limit) == ("held", "bound")
    depth, bound = re.findall(r"([\d.]+) mm", str(state.held_by))
    assert float(depth) > float(bound)
    assert state.held_at is not None
    x, _, z = state.held_at
    assert abs(x) == pytest.approx(12.0 + float(bound), abs=0.5)  # to one side
    assert 30.0 < z < 176.0  # of the five that are bent
    assert beyond_text(4.0 + 1e-4, 4.0) == "4.0001"
    assert beyond_text(4.123, 4.0) == "4.12"


def test_forces_are_those_of_depth_and_of_real_motion() -> None:
    """(33) at every step, whatever is commanded; a robot that the wall stops pushes nobody towards it, nor jumps."""
    drive = SnakeDrive(SnakeModel(6), straight(300.0), replace(QUICK, step_s=0.001), tip_s=170.0)
    felt = [drive.step(SnakeCommand(camera_mm_per_s=(60.0, 0.0))).forces for _ in range(2400)]
    assert drive.state.outcome == "held"
    held = felt[-1]
    k, depth = np.array(drive.hand.settings.spring), drive.state.deviation.depth[-5:]
    assert np.linalg.norm(held.guidance) == pytest.approx(k @ depth, rel=1e-3)
    assert held.total[0] < -0.3
    assert np.linalg.norm(held.resistance) < 1e-3
    away = SnakeCommand(camera_mm_per_s=(-60.0, 30.0))
    for command in [SnakeCommand()] * 100 + [away] * 100 + [SnakeCommand(straighten=True)] * 200:
        felt.append(drive.step(command).forces)
        if command == SnakeCommand():
            np.testing.assert_allclose(felt[-1].guidance, held.guidance, rtol=1e-3)
    total = np.array([forces.total for forces in felt])
    assert np.linalg.norm(np.diff(total, axis=0), axis=1).max() < 0.05


def test_a_robot_follows_a_pathway_that_breathes() -> None:
    """With nobody at the controls its shape goes with the tissue, and stays in it."""
    pathway = straight(300.0, contours=16).moved(breathing([0.0, 1.0, 0.0], 8.0, 4.0))
    drive = SnakeDrive(SnakeModel(6), pathway, DriveSettings(vertices_per_link=30), tip_s=170.0)
    swept, deepest = [], 0.0
    for _ in range(110):
        state = drive.step(SnakeCommand(), 0.02)
        swept.append(drive.snake.tip(state.q, state.base)[1, 3])
        deepest = max(deepest, state.deviation.depth.max())
    assert np.ptp(swept) > 6.0
    assert deepest < 0.05


def test_a_start_beyond_the_bounds_is_refused() -> None:
    settings = DriveSettings(vertices_per_link=30, bound_mm=0.5)
    with pytest.raises(InputError, match=r"link \d would start \d+\.\d\d mm outside"):
        SnakeDrive(SnakeModel(6), straight(300.0, 4.0), settings, tip_s=170.0)
    SnakeDrive(SnakeModel(6), straight(300.0, 4.0), settings, tip_s=170.0, beyond_allowed=True)
    with pytest.raises(InputError, match="closed ends"):
        SnakeDrive(SnakeModel(3), replace(straight(300.0), closed_ends=True), settings)


@pytest.mark.parametrize(
    "wrong",
    [{"camera_mm_per_s": (1.0, 2.0, 3.0)}, {"camera_mm_per_s": "12"}, {"camera_mm_per_s": 1.0},
     {"insert_mm_per_s": "1"}, {"camera_mm_per_s": ("1", 2.0)}, {"insert_mm_per_s": 1j}, {"straighten": "no"},
     {"bend": "1234567890"}, {"bend": (1.0, "2")}],
)  # fmt: skip
def test_a_command_that_is_none_is_refused(wrong) -> None:
    with pytest.raises(InputError):
        SnakeCommand(**wrong)
    assert not SnakeCommand(10**400).finite


def test_insertion_comes_before_the_camera() -> None:
    drive = SnakeDrive(SnakeModel(6), straight(300.0), QUICK, tip_s=170.0)
    state = drive.step(SnakeCommand(20.0, (50.0, 0.0)), 0.02)
    assert (state.mode, state.outcome) == ("inserting", "shrunk")
    assert "insertion comes first" in str(state.held_by)
    assert drive.straight
    assert drive.tip_s > 170.0


def test_a_bent_tip_is_not_inserted_where_bends_are_not_locked() -> None:
    """As in runs recorded before bends were."""
    drive = SnakeDrive(SnakeModel(6), straight(300.0, 20.0), replace(QUICK, lock_bend=False), tip_s=170.0)
    for _ in range(60):
        drive.step(SnakeCommand(camera_mm_per_s=(300.0, 0.0)), 0.01)
    assert math.hypot(*drive.state.steering) > 0.2
    state = drive.step(SnakeCommand(insert_mm_per_s=20.0), 0.02)
    assert state.outcome == "held"
    assert "straighten" in str(state.held_by)
    for _ in range(200):
        state = drive.step(SnakeCommand(straighten=True), 0.01)
    assert drive.straight
    assert drive.step(SnakeCommand(insert_mm_per_s=20.0), 0.02).outcome == "moved"


def test_a_bend_by_its_joints_is_gone_to_and_straightened() -> None:
    drive = SnakeDrive(SnakeModel(6), straight(300.0, 20.0), QUICK, tip_s=170.0)
    bend = tuple(np.radians([0.0, 5.0, 0.0, 3.0, 0.0, 0.0, 0.0, -4.0, 0.0, 2.0]))
    for _ in range(60):
        state = drive.step(SnakeCommand(bend=bend))
        assert state.mode == "looking"
    np.testing.assert_allclose(drive.bend, bend, atol=1e-12)
    held = drive.step(SnakeCommand(camera_mm_per_s=(30.0, 0.0)))
    assert (held.outcome, "straighten" in str(held.held_by)) == ("held", True)
    assert drive.step(SnakeCommand(insert_mm_per_s=20.0), 0.02).outcome == "moved"
    np.testing.assert_allclose(drive.bend, bend, atol=1e-12)
    for _ in range(60):
        drive.step(SnakeCommand(straighten=True))
    assert drive.straight
    assert drive.step(SnakeCommand(straighten=True)).outcome == "rest"  # it is so already
    assert drive.step(SnakeCommand(camera_mm_per_s=(5.0, 0.0))).outcome == "moved"
    with pytest.raises(InputError, match="bend of 3 joints"):
        drive.step(SnakeCommand(bend=(0.0, 0.0, 0.0)))
    assert drive.step(SnakeCommand(bend=(math.nan,) * 10)).outcome == "rest"
    assert drive.state.refused_commands == 1


def test_a_planned_shape_is_moved_off_the_wall() -> None:
    """Before the robot is there, and with a reserve; one that is well inside stays as it is."""
    drive = SnakeDrive(SnakeModel(6), straight(300.0, 9.0), QUICK, tip_s=170.0)
    state, shape = drive.state, conform(drive.snake, drive.pathway.curve(0.0), 170.0)
    rest = drive.snake, drive.query, state.packed, state.windows, drive.bound
    assert moved_off(shape, *rest) is None
    leaning = replace(shape, q=shape.q + 0.055 * (np.arange(12) == 6))
    depth = drive.query.deviations(state.packed, drive.snake.frames(leaning.q, leaning.base), state.windows).depth
    tight = np.full(6, 0.8 * depth.max())
    found = moved_off(leaning, *rest[:4], tight)
    assert found is not None
    frames = drive.snake.frames(found.q, found.base)
    assert (drive.query.deviations(state.packed, frames, state.windows).depth <= tight).all()
    assert 0.0 < np.abs(found.q - leaning.q).max() <= 0.1


def test_the_ends_of_the_path_hold() -> None:
    drive = SnakeDrive(SnakeModel(3), straight(100.0, contours=11), QUICK, tip_s=99.9)
    assert drive.step(SnakeCommand(insert_mm_per_s=20.0), 0.02).outcome == "moved"
    assert drive.tip_s == pytest.approx(100.0)
    state = drive.step(SnakeCommand(insert_mm_per_s=20.0), 0.02)
    assert (state.outcome, state.held_by) == ("held", "the end of the path")
    out = SnakeDrive(SnakeModel(3), straight(100.0, contours=11), QUICK)
    assert out.step(SnakeCommand(insert_mm_per_s=-5.0), 0.02).held_by == "the robot is out"
    before = SnakeDrive(SnakeModel(3), straight(100.0, contours=11), QUICK, tip_s=-20.0)
    assert before.step(SnakeCommand(insert_mm_per_s=-5.0), 0.02).held_by == "the robot is out"
    assert before.tip_s == -20.0
    for _ in range(80):
        before.step(SnakeCommand(insert_mm_per_s=20.0), 0.02)
    assert before.tip_s > 5.0


def test_settings_out_of_range_are_refused() -> None:
    for wrong in (
        {"step_s": 0.0}, {"bound_mm": -1.0}, {"tip_bound_mm": math.nan}, {"control": "magic"}, {"bends": 5},
        {"manipulated": 0}, {"insertion_mm_per_s": math.inf}, {"look_least_deg": 50.0}, {"look_within_mm": -1.0},
    ):  # fmt: skip
        with pytest.raises(InputError):
            DriveSettings(**wrong)
    assert DriveSettings(bound_mm=6.0).tip_bound == 3.0


def test_tissue_that_moves_leaves_the_hand_its_steps() -> None:
    """Where joints are at their limits a moved curve has other shapes; they come no faster than the hand can bear."""
    pathway = helix(24.0, 12.0, 7.5, radius=10.0, contours=71).moved(breathing([0.3, 1.0, 0.3], 8.0, 2.0, 100.0))
    for command in (SnakeCommand(insert_mm_per_s=20.0), SnakeCommand(camera_mm_per_s=(20.0, 0.0))):
        settings = DriveSettings(vertices_per_link=30, bends=4)
        drive = SnakeDrive(SnakeModel(5), pathway, settings, tip_s=60.0)
        reasons = [drive.step(command, 0.001).held_by or "" for _ in range(400)]
        assert not any("following the tissue" in reason for reason in reasons)
        assert drive.tip_s > 63.0 if command.insert_mm_per_s else math.hypot(*drive.state.steering) > 0.03
