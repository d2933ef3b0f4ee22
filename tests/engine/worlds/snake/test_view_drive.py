"""The camera goes where the hand pulls it: forty pushes at ten places of the synthetic colon."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.offline.operators import inserted
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.command import SnakeCommand

PLACES = np.linspace(180.0, 420.0, 10)
SPEED, DT, STEPS = 20.0, 0.02, 60  # mm/s, s


@dataclass(frozen=True)
class Push:
    """turn, off: of the view in degrees, and its direction against the push; why: in words, at the end."""

    turn: float
    off: float
    why: str | None
    last_mm: float  # of the last step along the push
    beyond_mm: float


def push(drive: SnakeDrive, angle: float) -> Push:
    snake, along = drive.snake, np.array([math.cos(angle), math.sin(angle)])
    before, beyond = snake.camera(drive.q, drive.state.base), -np.inf
    for _ in range(STEPS):
        seen = snake.camera(drive.q, drive.state.base)
        state = drive.step(SnakeCommand(camera_mm_per_s=(SPEED * along[0], SPEED * along[1])), DT)
        beyond = max(beyond, float((state.deviation.depth - state.bound).max()))
    after = snake.camera(drive.q, drive.state.base)
    x, y, z = before[:3, :3].T @ after[:3, 2]
    off = math.degrees(math.atan2(y, x) - angle)
    last = seen[:3, :2].T @ (after[:3, 3] - seen[:3, 3])
    return Push(
        math.degrees(math.acos(min(z, 1.0))), (off + 180.0) % 360.0 - 180.0, state.held_by, last @ along, beyond
    )


@pytest.fixture(scope="module")
def pushes() -> list[Push]:
    case, snake = colon_case(), SnakeModel(15)
    settings = DriveSettings(control="view", vertices_per_link=40)
    lumen = lumen_between(case.mesh, case.start, case.end, snake, settings)
    drive, found = SnakeDrive(snake, lumen.pathway, settings, lumen.curve, lumen.slack), []
    for place in PLACES:
        operator = inserted(place, 4)
        while (act := operator(drive.system, drive.state)) is not None:
            drive.act(act)
        rest = drive.state
        for quarter in range(4):
            found.append(push(drive, 0.5 * math.pi * quarter))
            drive.state = drive.driver.state = rest
    return found


def test_the_view_turns_to_the_side_that_is_pushed_to(pushes: list[Push]) -> None:
    assert len(pushes) == 40
    assert np.median([one.turn for one in pushes]) >= 15.0
    assert sum(abs(one.off) <= 45.0 for one in pushes) >= 38


def test_a_push_that_gets_nowhere_says_why(pushes: list[Push]) -> None:
    blocked = [one for one in pushes if one.last_mm < 0.5 * SPEED * DT]
    assert blocked
    assert all(one.why for one in blocked)


def test_no_link_leaves_its_bound_under_a_push(pushes: list[Push]) -> None:
    assert max(one.beyond_mm for one in pushes) <= 0.0
