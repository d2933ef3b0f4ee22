"""The scripted operator of study I in a short straight tube, in each arm and in tissue that breathes."""

from __future__ import annotations

import numpy as np
import pytest

from vfix_engine.arrays import Array
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.tissue_motion import breathing
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.study.polyps.operator import PolypOperator
from vfix_engine.study.polyps.progress import Sight
from vfix_engine.study.polyps.task import NEAR_END_MM, Polyp, PolypTask
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.state import SnakeState

_LINE = np.column_stack([np.zeros((9, 2)), np.linspace(0.0, 240.0, 9)])
_RADIUS = np.full((9, 1), 16.0)


def free(eye: Array, index: int, t: float) -> bool:
    return True


def hidden(eye: Array, index: int, t: float) -> bool:
    return False


def polyp(angle: float) -> Polyp:
    """On the wall 190 mm in."""
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    x, y, _ = (16.0 * out).tolist()
    u, v, w = (-out).tolist()
    return Polyp(190.0, (x, y, 190.0), (u, v, w), (0.0, 0.0, 190.0))


def driven(drive: SnakeDrive, operator: PolypOperator) -> list[SnakeState]:
    states = []
    while (act := operator(drive.system, drive.state)) is not None:
        states.append(drive.act(act))
    return states


def drive_in(arm: str, tip_s: float = 150.0, breath_mm: float = 0.0) -> SnakeDrive:
    motion = breathing((0.0, 0.0, 1.0), breath_mm) if breath_mm else None
    settings = DriveSettings(control="view", arm=arm, vertices_per_link=40)  # type: ignore[arg-type]
    return SnakeDrive(SnakeModel(7), Pathway(_LINE, _RADIUS, 40, motion=motion), settings, tip_s=tip_s)


@pytest.mark.parametrize(
    ("arm", "breath_mm"), [("manual", 0.0), ("guided", 0.0), ("certified", 0.0), ("certified", 6.0)]
)
def test_a_polyp_is_cleared_in_each_arm(arm: str, breath_mm: float) -> None:
    drive, task = drive_in(arm, breath_mm=breath_mm), PolypTask((polyp(0.7),), 150.0, 194.0)
    operator = PolypOperator(task, free, drive.pathway.motion)
    states = driven(drive, operator)
    viewing = operator.progress.viewings[0]
    assert operator.progress.completed
    assert drive.tip_s == pytest.approx(194.0 - NEAR_END_MM, abs=0.5)
    assert viewing.cleared_t is not None
    assert viewing.viewed_s >= 7.0 - 1e-6
    assert [attempt.how for attempt in operator.attempts] == ["hand"]
    assert operator.attempts[0].cleared
    turned = np.array([np.abs(state.q - state.q_nominal).reshape(-1, 2).max(axis=1) for state in states])
    moved = np.flatnonzero(turned.max(axis=0) > 1e-6)
    if arm == "manual":
        assert set(moved.tolist()) <= {5, 6}  # the last two universal joints
    else:
        assert len(moved) == 5
    if arm == "certified":
        assert all((state.deviation.depth <= state.bound)[state.measured].all() for state in states)


def test_a_polyp_that_is_never_seen_is_missed_and_the_task_completed() -> None:
    drive, task = drive_in("certified", 170.0), PolypTask((polyp(2.0),), 150.0, 194.0)
    planned = (175.0, np.full((1, drive.distal.dof), 0.05))
    operator = PolypOperator(task, hidden, views=[planned])
    driven(drive, operator)
    assert operator.progress.completed
    assert operator.progress.cleared == 0
    assert [attempt.how for attempt in operator.attempts[:3]] == ["hand", "hand", "plan"]
    assert not any(attempt.cleared for attempt in operator.attempts)
    assert operator.attempts[2].tip_mm == pytest.approx(175.0, abs=1e-6)


def first_attempt(sight: Sight, aim_most_s: float) -> tuple[float, PolypOperator]:
    """When the first attempt at a polyp in tissue that breathes ended, in s, or 20 s; and the operator."""
    drive, task = drive_in("certified", breath_mm=6.0), PolypTask((polyp(0.7),), 150.0, 194.0)
    operator = PolypOperator(task, sight, drive.pathway.motion, aim_most_s=aim_most_s)
    while not operator.attempts and drive.state.t < 20.0:
        act = operator(drive.system, drive.state)
        assert act is not None
        drive.act(act)
    return drive.state.t, operator


def test_a_polyp_that_is_viewed_and_lost_again_and_again_is_left_after_the_time_of_an_attempt() -> None:
    """Each view begins the search anew, and the tissue keeps the picture moving: the time alone ends it."""

    def flickers(eye: Array, index: int, t: float) -> bool:
        return t % 0.2 < 0.1

    ends = []
    for most_s in (3.0, 5.0):
        end, operator = first_attempt(flickers, most_s)
        assert [attempt.cleared for attempt in operator.attempts] == [False]
        assert operator.progress.viewings[0].lost > 5
        ends.append(end)
    assert ends[1] - ends[0] == pytest.approx(2.0, abs=0.25)
    end, operator = first_attempt(free, 3.0)  # what is viewed at that time is held on
    assert operator.attempts[0].cleared
    assert end > ends[1]
