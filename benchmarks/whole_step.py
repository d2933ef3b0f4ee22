"""The cost of a tick of the rigid tool without its clock: the whole step of the system with its recorder's row.

There are three drives, each from the inner end of the path: moving freely, pushed against the nearest bone, and
swinging about an inspected target. The snapshot is measured separately, since it is made at display rate.
The stack's whole step is the same system with the stack instead of the controller: it is timed at some states of the
free drive, where the controller's report is reused at no cost.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import report
from benchmarks.stack import Stack
from vfix_engine.control import Controller, ControlSettings, HandCommand, StepReport, StepRequest, Task
from vfix_engine.control.tasks import view_point
from vfix_engine.runtime import Act, Command, SetTask
from vfix_engine.virtual_fixtures import StepState
from vfix_engine.worlds.rigid.operators import RigidOperator, ScriptedOperator, to_nearest_bone
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.state import RehearsalState
from vfix_engine.worlds.rigid.system import RigidSystem

STEPS = 1500  # of each drive
SWING_STEPS = 700  # of one swing about the target, and of one motion back and forth in the free drive
WARM = 50  # steps of each drive that are not timed
STEP_EVERY = 5  # one of this many steps has the controller's step timed alone
STACK_EVERY = 15  # one of this many free steps is also taken by the stack
MOST_STEPS = 60_000  # to the inner end


@contextmanager
def stepping(controller: Controller, step: Callable[..., StepReport]) -> Iterator[Callable[..., StepReport]]:
    """Another function takes the controller's steps meanwhile; the block has the controller's own."""
    own = controller.step
    controller.step = step  # type: ignore[method-assign]
    try:
        yield own
    finally:
        controller.step = own  # type: ignore[method-assign]


class WholeStep:
    """The scene of one case with its three drives."""

    def __init__(self, scene: Scene, settings: ControlSettings, stack: Stack):
        self._settings, self._stack = settings, stack
        inner = self._inner_end(RigidSystem(scene, settings))
        target = view_point(inner.tool, scene.tool, settings.view_distance_mm)
        self._system = RigidSystem(replace(scene, targets=target[None], target_names=("inner end",)), settings)
        self._inner, self._row = inner, np.empty(len(self._system.row_layout))
        self._snapshots: list[float] = []

    def measure(self, step_us: float) -> dict[str, Any]:
        """Return the figures of all three drives. step_us: of the controller's step along the path in this run."""
        stack: list[float] = []
        by = {
            "free": self._drive("free", _to_and_fro, stack),
            "held": self._drive("free", _pushed),
            "inspecting": self._drive("inspect", ScriptedOperator(swing_period_steps=SWING_STEPS)),
        }
        worst = max(one["whole_us"] for one in by.values())
        for one in by.values():
            one["over_step"] = one["whole_us"] / one["step_us"]
        whole_stack = report.spread_us(stack)["median_us"]
        return {
            "whole_us": worst,
            "whole_over_step": max(one["over_step"] for one in by.values()),
            "whole_over_corridor_step": worst / step_us,
            "whole_by": by,
            "snapshot_us": report.spread_us(self._snapshots)["median_us"],
            "whole_stack_us": whole_stack,
            "whole_ratio_vs_stack": whole_stack / by["free"]["whole_us"],
        }

    def _inner_end(self, system: RigidSystem) -> RehearsalState:
        state = system.start("path")
        forwards = Command(np.zeros(3), drive=1)
        for _ in range(MOST_STEPS):
            state = system.step(state, forwards)
            if state.phase == "done" or (state.last is not None and state.last.report.held):
                break
        return state

    def _drive(self, task: str, operator: RigidOperator, stack: list[float] | None = None) -> dict[str, Any]:
        system, row = self._system, self._row
        state = system.apply(self._inner, SetTask(task))
        taken: list[float] = []
        alone: list[float] = []
        outcomes: Counter[str] = Counter()
        for count in range(WARM + STEPS):
            command = operator(system, state).command
            begin = time.perf_counter()
            after = system.step(state, command)
            system.row(after, row)
            spent = time.perf_counter() - begin
            if count >= WARM:
                taken.append(spent)
                outcomes[after.last.report.outcome if after.last else ""] += 1
                if stack is not None and count % STACK_EVERY == 0:
                    stack.append(self._with_stack(state, command, after))
                    system.step(state, command)  # not timed: the stack has just filled the caches
                begin = time.perf_counter()
                system.snapshot(after)
                self._snapshots.append(time.perf_counter() - begin)
                if count % STEP_EVERY == 0:
                    alone.append(self._step_alone(state, command))
                system.step(state, command)  # not timed
            state = after
        spread = report.spread_us(taken)
        return {
            "whole_us": spread["median_us"],
            "whole_p99_us": spread["p99_us"],
            "step_us": report.spread_us(alone)["median_us"],
            "steps": len(taken),
            "outcomes": dict(outcomes),
        }

    def _step_alone(self, state: RehearsalState, command: Command) -> float:
        """Return the seconds of the controller's step alone, from the same state with the same request."""
        asked: list[tuple[StepState, StepRequest]] = []

        def asking(tool: StepState, task: Task, hand: HandCommand) -> StepReport:
            asked.append((tool, task.request(tool, hand)))
            return own(*asked[-1])

        with stepping(self._system.controller, asking) as own:
            self._system.step(state, command)
        begin = time.perf_counter()
        own(*asked[0])
        return time.perf_counter() - begin

    def _with_stack(self, state: RehearsalState, command: Command, after: RehearsalState) -> float:
        """Return the seconds of the same whole step with the stack instead of the controller."""
        assert after.last is not None
        done = after.last.report

        def stacked(tool: StepState, task: Task, hand: HandCommand) -> StepReport:
            self._stack.step(tool, task.request(tool, hand))
            return done

        with stepping(self._system.controller, stacked):
            begin = time.perf_counter()
            self._system.row(self._system.step(state, command), self._row)
            return time.perf_counter() - begin


def _pushed(system: RigidSystem, state: RehearsalState) -> Act:
    """Push with full force against the currently nearest bone."""
    return Act(Command(state.settings.force_cap_n * to_nearest_bone(system, state)))


def _to_and_fro(system: RigidSystem, state: RehearsalState) -> Act:
    """Go out along the path and in again, with half the force."""
    along = state.tool.tip.rotation[:, 1] if state.nearest is None else state.nearest.tangent
    outwards = -1.0 if state.steps % SWING_STEPS < SWING_STEPS // 2 else 1.0
    return Act(Command(0.5 * state.settings.force_cap_n * outwards * along))
