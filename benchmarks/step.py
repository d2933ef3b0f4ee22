"""One step of control along the corridor, against the same step built from Pinocchio, coal and qpsolvers."""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import cases, report
from benchmarks.stack import PARTS, Stack
from benchmarks.step_parts import StepParts
from vfix_engine.control import ControlSettings, StepReport, Task, ToolState
from vfix_engine.simulation.rehearsal import Command, Rehearsal

SUMMARY = "a whole control step along the corridor, against Pinocchio + coal + qpsolvers"
BLOCK = 20  # steps that are driven in one go, as a rehearsal drives them, before the stack has its turn
EVERY = 5  # of them the stack takes one
SPLIT_EVERY = 25  # steps between two whose parts are timed one by one
MOST_STEPS = 60_000
SAME_STEP = 1e-6  # relative to the length of the wanted step
SAME_CLEARANCE_MM = 1e-6

Moment = tuple[ToolState, Task, StepReport]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which head, and how much of its corridor."""
    cases.add_arguments(parser)
    parser.add_argument(
        "--steps", type=int, default=MOST_STEPS, help="steps at most, of 1 ms at 10 mm/s (default: all)"
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    """The whole corridor in control steps; the top level tells of the largest surface.

    Keys: median_us, p99_us of every step, those that gather triangles anew included; ratio_vs_stack,
    p99_ratio_vs_stack; split_us and floor_us by part; stack: the same of the stack.

    Raises:
        BenchmarkRefused: coal is not installed, or the number of steps makes no sense.
    """
    if not 100 <= args.steps <= MOST_STEPS:
        raise report.BenchmarkRefused(f"--steps {args.steps} is not between 100 and {MOST_STEPS}")
    coal, machine = report.need_coal(), report.machine().to_dict()
    measured = cases.find_cases(args).measure(lambda case: _Drive(coal, case, args.steps).measure())
    largest = max((one for one in measured["cases"].values() if one is not None), key=lambda one: one["triangles"])
    return {"machine": machine, **largest, **measured, "correct": _all_correct(measured["cases"])}


def _all_correct(results: dict[str, Any]) -> bool:
    return all(one["correct"] for one in results.values() if one is not None)


class _Drive:
    """The corridor of one case, driven at full force."""

    def __init__(self, coal: Any, case: cases.BenchCase, most: int):
        self._case, self._most, self._settings = case, most, ControlSettings()
        scene = cases.drive(case, self._settings).scene
        self._rehearsal = Rehearsal(scene, self._settings)
        robot = scene.placed_robot()
        self._stack = Stack(coal, case.mesh, robot, scene.tool, self._settings)
        self._comparing = Stack(coal, case.mesh, robot, scene.tool, self._settings, exact_check=False)
        self._parts = StepParts(self._rehearsal.controller)
        self._ours: list[float] = []
        self._theirs: list[float] = []
        self._theirs_comparing: list[float] = []
        self._shares: list[tuple[float, ...]] = []
        self._steps_apart: list[float] = []
        self._clearances_apart: list[float] = []
        self._pairs: list[int] = []

    def measure(self) -> dict[str, Any]:
        """Drive, with the stack after every block, and tell."""
        rehearsal, block = self._rehearsal, list[Moment]()
        step = rehearsal.controller.step
        rehearsal.controller.step = self._timed(step, block)  # type: ignore[method-assign]
        state = rehearsal.start()
        self._warm(state.tool)
        collecting = gc.isenabled()
        gc.disable()  # as in the control loop, which pays for garbage at rest
        try:
            for index in range(self._most):
                state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
                if len(block) >= BLOCK or snapshot.phase == "done":
                    self._compare(block)
                    if index % SPLIT_EVERY < BLOCK and block:
                        self._parts.time(*block[-1][:2])
                    block.clear()
                    gc.collect(0)
                if snapshot.phase == "done":
                    break
        finally:
            rehearsal.controller.step = step  # type: ignore[method-assign]
            if collecting:
                gc.enable()
        return self._told(snapshot.progress_mm)

    def _timed(self, step: Callable[[ToolState, Task], StepReport], block: list[Moment]) -> Any:
        ours = self._ours

        def timed(state: ToolState, task: Task) -> StepReport:
            begin = time.perf_counter()
            done = step(state, task)
            ours.append(time.perf_counter() - begin)
            block.append((state, task, done))
            return done

        return timed

    def _warm(self, state: ToolState) -> None:
        """What is compiled on first use is compiled before the clock runs."""
        rehearsal = self._rehearsal
        rehearsal.step(rehearsal.start(), Command(np.zeros(3), drive=1))
        self._ours.clear()

    def _compare(self, block: list[Moment]) -> None:
        """The stack's turn at some of the block's states."""
        for state, task, done in block[::EVERY]:
            if not task.scale > 0.0:
                continue
            begin = time.perf_counter()
            theirs = self._stack.step(state, task)
            self._theirs.append(time.perf_counter() - begin)
            begin = time.perf_counter()
            self._comparing.step(state, task)
            self._theirs_comparing.append(time.perf_counter() - begin)
            self._shares.append(theirs.seconds)
            self._pairs.append(theirs.pairs)
            if theirs.step is None or theirs.clearance is None:
                self._steps_apart.append(np.inf)
                continue
            ours = done.state.q - state.q
            if done.outcome == "moved":
                self._steps_apart.append(float(np.abs(theirs.step - ours).max()) / task.scale)
                clearance = min(theirs.clearance, self._settings.reach_mm)
                self._clearances_apart.append(abs(clearance - done.state.clearance))

    def _told(self, progress: float) -> dict[str, Any]:
        ours, theirs, comparing = (
            report.spread_us(seconds) for seconds in (self._ours, self._theirs, self._theirs_comparing)
        )
        apart, clearances = max(self._steps_apart), max(self._clearances_apart)
        shares = 1e6 * np.median(np.array(self._shares), axis=0)
        split, floor = self._parts.told()
        return {
            "triangles": len(self._case.mesh.faces),
            "pair_threshold_mm": self._settings.reach_mm,
            "driven_mm": progress,
            "steps": len(self._ours),
            **ours,
            "ratio_vs_stack": theirs["median_us"] / ours["median_us"],
            "p99_ratio_vs_stack": theirs["p99_us"] / ours["p99_us"],
            "split_us": split,
            "floor_us": floor,
            "stack": {
                **theirs,
                "steps": len(self._theirs),
                "made_of": "Pinocchio, coal (collide with margin, distance at the predicted pose), qpsolvers with daqp",
                "split_us": dict(zip(PARTS, shares.tolist(), strict=True)),
                "with_a_mere_margin_check": comparing,
                "pairs": {"median": float(np.median(self._pairs)), "most": int(max(self._pairs))},
            },
            "largest_difference": {"step": apart, "clearance_mm": clearances},
            "correct": apart <= SAME_STEP and clearances <= SAME_CLEARANCE_MM,
        }
