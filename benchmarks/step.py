"""One step of control along the corridor, against the same step built from Pinocchio, coal and qpsolvers.

A rehearsal drives the corridor once; then its tasks are taken again, block by block: a second controller makes the
steps of a block one after the other, gathering triangles where driving makes it necessary, and the stack makes its
own from the same states.
Either has one step that is not counted before its turn, since the other has just had the caches for itself.
What a step took within the rehearsal, where everything else that a rehearsal does comes between two steps, is told as
well.
"""

from __future__ import annotations

import argparse
import gc
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from benchmarks import cases, report
from benchmarks.stack import PARTS, Stack
from benchmarks.step_parts import StepParts
from benchmarks.whole_step import WholeStep, stepping
from vfix_engine.control import Controller, ControlSettings, HandCommand, StepReport, StepRequest, StepState, Task
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal

SUMMARY = "a whole control step along the corridor, against Pinocchio + coal + qpsolvers"
BLOCK = 20  # steps that are driven in one go, as a rehearsal drives them, before the stack has its turn
EVERY = 5  # of them the stack takes one
SPLIT_EVERY = 60  # steps, a multiple of a block, between two whose parts are timed one by one
MOST_STEPS = 60_000
SAME_STEP = 1e-6  # relative to the length of the wanted step
SAME_CLEARANCE_MM = 1e-6

Moment = tuple[StepState, StepRequest]
Answer = TypeVar("Answer")


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
    whole_us: the rigid system's whole step with its recorder's row, the worst of three drives, whole_by each of them;
    whole_over_step: over the controller's step alone in that drive, whole_over_corridor_step: over median_us;
    snapshot_us: apart; whole_stack_us: with the stack in the controller's place, moving freely, and
    whole_ratio_vs_stack over ours there.

    Raises:
        BenchmarkRefused: coal is not installed, or the number of steps makes no sense.
    """
    if not 100 <= args.steps <= MOST_STEPS:
        raise report.BenchmarkRefused(f"--steps {args.steps} is not between 100 and {MOST_STEPS}")
    coal, machine = report.need("coal"), report.machine().to_dict()
    measured = cases.find_cases(args).measure(lambda case: _Drive(coal, case, args.steps).measure())
    largest = max((one for one in measured["cases"].values() if one is not None), key=lambda one: one["triangles"])
    return {"machine": machine, **largest, **measured, "correct": _all_correct(measured["cases"])}


def _all_correct(results: dict[str, Any]) -> bool:
    return all(one["correct"] for one in results.values() if one is not None)


class _Drive:
    """The corridor of one case, driven at full force."""

    def __init__(self, coal: Any, case: cases.BenchCase, most: int):
        self._case, self._most, self._settings = case, most, ControlSettings()
        self._scene = scene = cases.drive(case, self._settings).scene
        self._stack = Stack(coal, case.mesh, scene.placed_robot(), scene.tool, self._settings)
        self._comparing = Stack(coal, case.mesh, scene.placed_robot(), scene.tool, self._settings, exact_check=False)
        self._seconds: defaultdict[str, list[float]] = defaultdict(list)
        self._shares: list[tuple[float, ...]] = []
        self._steps_apart: list[float] = []
        self._clearances_apart: list[float] = []
        self._pairs: list[int] = []
        self._outcomes: Counter[str] = Counter()
        self._whole: dict[str, Any] = {}

    def measure(self) -> dict[str, Any]:
        """Drive, take the steps again in turn with the stack, and tell."""
        collecting = gc.isenabled()
        gc.disable()  # as in the control loop, which pays for garbage at rest
        try:
            start, tasks, progress = self._drive()
            gc.collect()
            controller = Rehearsal(self._scene, self._settings).controller
            parts = StepParts(controller)
            state, block = controller.measure(start), list[Moment]()
            for first in range(0, len(tasks), BLOCK):
                if block:
                    controller.step(*block[-1])  # not counted: the stack has just had the caches for itself
                block = []
                for task in tasks[first : first + BLOCK]:
                    block.append((state, task))
                    state = self._timed("ours", controller.step, state, task).state
                self._compare(block, controller)
                if first % SPLIT_EVERY == 0:
                    parts.time(*block[-1])
                gc.collect(0)
            step_us = report.spread_us(self._seconds["ours"])["median_us"]
            self._whole = WholeStep(self._scene, self._settings, self._stack).measure(step_us)
        finally:
            if collecting:
                gc.enable()
        return self._told(progress, parts)

    def _drive(self) -> tuple[np.ndarray, list[StepRequest], float]:
        """Joints at the start, the request of every step of the rehearsal, and how far along the path it came."""
        rehearsal = Rehearsal(self._scene, self._settings)
        state = rehearsal.start()
        rehearsal.step(state, Command(np.zeros(3), drive=1))  # compiles what is not yet
        start, tasks = state.tool.q, list[StepRequest]()

        def timed(state: StepState, task: Task, command: HandCommand) -> StepReport:
            tasks.append(task.request(state, command))
            return self._timed("in the rehearsal", own, state, tasks[-1])

        with stepping(rehearsal.controller, timed) as own:
            for _ in range(self._most):
                state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
                if snapshot.phase == "done":
                    break
        return start, tasks, snapshot.progress_mm

    def _timed(self, name: str, step: Callable[[StepState, StepRequest], Answer], *moment: *Moment) -> Answer:
        begin = time.perf_counter()
        answer = step(*moment)
        self._seconds[name].append(time.perf_counter() - begin)
        return answer

    def _compare(self, block: list[Moment], controller: Controller) -> None:
        """The stack's turn at some of the block's states."""
        moments = [moment for moment in block[::EVERY] if (moment[1].scale or 0.0) > 0.0]
        for moment in moments[-1:]:
            self._stack.step(*moment)  # not counted, as before a block
        answers = [self._timed("stack", self._stack.step, *moment) for moment in moments]
        for moment in moments:
            self._timed("comparing stack", self._comparing.step, *moment)
        for (state, task), theirs in zip(moments, answers, strict=True):
            self._shares.append(theirs.seconds)
            self._pairs.append(theirs.pairs)
            done = controller.step(state, task)
            self._outcomes[done.outcome] += 1
            if theirs.step is None or theirs.clearance is None:
                self._steps_apart.append(np.inf)
            elif done.outcome == "moved":
                self._steps_apart.append(
                    float(np.abs(theirs.step - (done.state.q - state.q)).max()) / (task.scale or 0.0)
                )
                clearance = min(theirs.clearance, self._settings.reach_mm)
                self._clearances_apart.append(abs(clearance - done.state.clearance))

    def _told(self, progress: float, parts: StepParts) -> dict[str, Any]:
        names = ("ours", "in the rehearsal", "stack", "comparing stack")
        ours, driven, theirs, comparing = (report.spread_us(self._seconds[name]) for name in names)
        apart, clearances = max(self._steps_apart), max(self._clearances_apart)
        shares = 1e6 * np.median(np.array(self._shares), axis=0)
        split, floor = parts.told(ours["median_us"])
        return {
            "triangles": len(self._case.mesh.faces),
            "pair_threshold_mm": self._settings.reach_mm,
            "driven_mm": progress,
            "steps": len(self._seconds["ours"]),
            **ours,
            "ratio_vs_stack": theirs["median_us"] / ours["median_us"],
            "p99_ratio_vs_stack": theirs["p99_us"] / ours["p99_us"],
            **self._whole,
            "in_the_rehearsal": driven,
            "split_us": split,
            "floor_us": floor,
            "stack": {
                **theirs,
                "steps": len(self._seconds["stack"]),
                "made_of": "Pinocchio, coal (collide with margin, distance at the predicted pose), qpsolvers with daqp",
                "split_us": dict(zip(PARTS, shares.tolist(), strict=True)),
                "with_a_mere_margin_check": comparing,
                "pairs": {"median": float(np.median(self._pairs)), "most": int(max(self._pairs))},
            },
            "largest_difference": {"step": apart, "clearance_mm": clearances},
            # Where a step is cut short or held, the stack has no like of it.
            "compared": self._outcomes["moved"],
            "not_compared": {name: self._outcomes[name] for name in ("shrunk", "held", "idle")},
            "correct": apart <= SAME_STEP and clearances <= SAME_CLEARANCE_MM,
        }
