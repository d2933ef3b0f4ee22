"""One trial of study II without a clock, usually by an oracle: six labels, one after the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from ...anatomy.lumen.wall import Wall
from ...runtime.command import BUTTON_CUT
from ...runtime.driver import Driver, Log
from ...runtime.operator import Act
from ...worlds.snake.cavity import CavityCase
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.settings import Arm
from ...worlds.snake.stepping.state import SnakeState
from ..polyps.task import surface_hash
from .bend_map import BendMap
from .oracle import BendOracle, JointOracle, OracleView
from .placing import PlacedLabels
from .table import task_note
from .task import DiathermySample, DiathermyState, first_state, stepped, table_iv

STEP_S = 0.01
LONGEST_S = 600.0  # of simulated time, after which the operator gives up


class LabelOperator(Protocol):
    """An operator of study II. given_up, choices: as of the oracles."""

    given_up: dict[int, str]
    choices: int

    def __call__(self, seen: OracleView) -> Act | None: ...


@dataclass(frozen=True, eq=False)
class DiathermyTrial:
    """What a trial came to.

    task: at its end; beyond_bound_mm: how far a link was beyond its bound at most, 0 where none was; given_up: labels
    that the operator left, by number from 1, and why; joint_choices: how often a manual hand chose another joint.
    """

    task: DiathermyState
    beyond_bound_mm: float
    given_up: dict[int, str]
    joint_choices: int

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        task = self.task
        return {
            "labels_traced": task.traced, "of": len(task.labels), "labels": table_iv(task),
            "beyond_bound_mm": self.beyond_bound_mm, "time_s": task.t,
            "given_up": [{"label": number, "why": why} for number, why in self.given_up.items()],
            "joint_choices": self.joint_choices,
        }  # fmt: skip


def trial(
    case: CavityCase,
    bends: BendMap,
    placed: PlacedLabels,
    arm: Arm,
    record: Callable[[DriveSpec], Log | None] | None = None,
    say: Callable[[str], None] = lambda words: None,
    operator: LabelOperator | None = None,
) -> DiathermyTrial:
    """Let an operator trace the labels in one arm; None: an oracle.

    record: returns the destination of the recorded run for the spec of the drive; say: called with what happens.
    """
    spec = case.script(arm, STEP_S)
    driver: Driver[SnakeState] = Driver(system := spec.build(), log=None if record is None else record(spec))
    driver.apply(task_note(placed.labels, placed.seed, surface_hash(case.mesh)))
    oracle: LabelOperator = operator or (JointOracle if arm == "manual" else BendOracle)(bends, placed)
    task, beyond, sight = first_state(placed.labels), 0.0, Wall(case.mesh).free
    while driver.state.t < LONGEST_S:
        act = oracle(OracleView(system, driver.state, task))
        if act is None:
            break
        state, traced = driver.act(act), task.traced
        camera, pressed = case.snake.camera(state.q, state.base), bool(act.command.buttons & BUTTON_CUT)
        task = stepped(placed.labels, task, DiathermySample(state.t, camera, pressed), sight)
        beyond = max(beyond, float((state.deviation.depth - state.bound).max()))
        if task.traced > traced:
            say(f"{task.traced} of {len(task.labels)} labels traced, after {state.t:.0f} s")
    given_up = {number + 1: why for number, why in oracle.given_up.items()}
    return DiathermyTrial(task, beyond, given_up, oracle.choices)
