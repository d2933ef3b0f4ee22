"""A rehearsal without a page: an operator drives, every step is measured."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ControlError
from .operators import Operator, PushingOperator, ScriptedOperator
from .rehearsal import Rehearsal, RehearsalState
from .snapshot import Snapshot

PATIENCE_STEPS = 400  # steps without progress after which a scripted hand gives up
GAIN_MM = 0.02  # less than this in that many steps is no progress towards a target
TIGHT_MM = 0.05  # this near to the margin counts as contact
PUSH_FROM = 0.6  # share of the path after which pushing begins at the latest
PASSED_MM = 0.3  # the view is past its nearest place when it is this much further away again
WARM_UP_STEPS = 20  # not counted in the step times: caches fill

Keep = Callable[[Snapshot], None]


@dataclass
class Tally:
    """Running figures of a rehearsal."""

    steps: int = 0
    held: int = 0
    least_clearance: float = np.inf
    rows: tuple[int, int] = (10**9, 0)

    def __post_init__(self) -> None:
        self.errors: list[float] = []
        self.times: list[float] = []

    def add(self, snapshot: Snapshot, seconds: float) -> None:
        self.steps += 1
        self.held += snapshot.held
        self.least_clearance = min(self.least_clearance, snapshot.clearance_mm)
        if snapshot.rows:
            self.rows = (min(self.rows[0], snapshot.rows), max(self.rows[1], snapshot.rows))
        if snapshot.phase in ("follow", "done"):
            self.errors.append(snapshot.tip_error_mm)
        if self.steps > WARM_UP_STEPS:
            self.times.append(1e6 * seconds)

    def report(self) -> dict[str, Any]:
        def spread(values: list[float], **parts: Callable[[np.ndarray], Any]) -> dict[str, float | None]:
            array = np.array(values)
            return {name: float(f(array)) if len(array) else None for name, f in parts.items()}

        return {
            "steps": self.steps,
            "held_steps": self.held,
            "tip_error_mm": spread(self.errors, mean=np.mean, max=np.max),
            "min_clearance_mm": self.least_clearance,
            "step_time_us": spread(self.times, median=np.median, p99=lambda a: np.percentile(a, 99)),
            "qp_rows": {"min": min(self.rows), "max": self.rows[1]},
        }


class HeadlessRun:
    """Steps a rehearsal with an operator and tells every snapshot to ``keep``."""

    def __init__(self, rehearsal: Rehearsal, keep: Keep):
        self.rehearsal, self._keep, self.tally = rehearsal, keep, Tally()

    def follow(self, operator: Operator | None = None, stop: Callable[[Snapshot], bool] | None = None) -> Snapshot:
        """Along the path to its end, until ``stop`` says so, or until the hand gives up."""
        operator = operator or ScriptedOperator()
        state = self.rehearsal.start("path")
        return self._drive(state, operator, lambda s: s.phase == "done" or (stop is not None and stop(s)))[1]

    def push(self, steps: int, seed: int, free: bool) -> Snapshot:
        """Along the path to the first tight place or past its middle, then ``steps`` steps of full force into bone."""
        rehearsal = self.rehearsal
        near = rehearsal.settings.margin_mm + TIGHT_MM
        state, snapshot = self._drive(
            rehearsal.start("path"),
            ScriptedOperator(),
            lambda s: s.clearance_mm <= near or s.progress_mm >= PUSH_FROM * s.length_mm,
        )
        if free:
            state = rehearsal.with_mode(state, "free")
            self.tally.errors.clear()  # without the fixture the path is no reference
        operator = PushingOperator(seed)
        for _ in range(steps):
            state, snapshot = self._one(state, operator)
        return snapshot

    def inspect(self, target: int, steps: int) -> dict[str, Any]:
        """Along the path to where the view is nearest to the target, onto it, and ``steps`` steps of swinging."""
        rehearsal = self.rehearsal
        goal = rehearsal.scene.targets[target]
        if rehearsal.scene.path is None:
            raise ControlError("inspection starts from a path; the plan has none")
        state = rehearsal.start("path")
        state = self._to_best_view(state, goal)
        state = rehearsal.with_mode(state, "inspect", target)
        operator = ScriptedOperator()
        state, snapshot = self._drive(state, operator, _arrival())
        name = rehearsal.scene.target_names[target]
        if snapshot.phase != "inspect_hold":
            reason = snapshot.reason or "the view does not get there"
            return {"target": name, "reached": False, "reason": reason, "error_mm": None, "swing_deg": 0.0}
        first = state.tool.tip.rotation
        errors, swing = [], 0.0
        for _ in range(steps):
            state, snapshot = self._one(state, operator)
            errors.append(snapshot.target_error_mm)
            turned = np.arccos(np.clip((np.trace(first.T @ state.tool.tip.rotation) - 1) / 2, -1, 1))
            swing = max(swing, float(np.degrees(turned)))
        spread = {"mean": float(np.mean(errors)), "max": float(np.max(errors))}
        return {"target": name, "reached": True, "reason": "", "error_mm": spread, "swing_deg": swing}

    def _to_best_view(self, state: RehearsalState, goal: np.ndarray) -> RehearsalState:
        """Drive on until the virtual point has passed where it is nearest to the goal."""
        nearest = np.inf

        def passed(snapshot: Snapshot) -> bool:
            nonlocal nearest
            distance = float(np.linalg.norm(snapshot.virtual_point - goal))
            nearest = min(nearest, distance)
            return snapshot.phase == "done" or distance > nearest + PASSED_MM

        return self._drive(state, ScriptedOperator(), passed)[0]

    def _drive(
        self, state: RehearsalState, operator: Operator, stop: Callable[[Snapshot], bool]
    ) -> tuple[RehearsalState, Snapshot]:
        snapshot = self.rehearsal.snapshot(state)
        held = 0
        while not stop(snapshot) and held < PATIENCE_STEPS:
            state, snapshot = self._one(state, operator)
            held = held + 1 if snapshot.held else 0
        return state, snapshot

    def _one(self, state: RehearsalState, operator: Operator) -> tuple[RehearsalState, Snapshot]:
        command = operator.command(self.rehearsal, state)
        begin = time.perf_counter()
        state, snapshot = self.rehearsal.step(state, command)
        self.tally.add(snapshot, time.perf_counter() - begin)
        self._keep(snapshot)
        return state, snapshot


def _arrival() -> Callable[[Snapshot], bool]:
    """True once the view is held on the target, or comes no nearer to it."""
    nearest, since = np.inf, 0

    def arrived(snapshot: Snapshot) -> bool:
        nonlocal nearest, since
        since += 1
        if snapshot.target_error_mm < nearest - GAIN_MM:
            nearest, since = snapshot.target_error_mm, 0
        return snapshot.phase == "inspect_hold" or since > PATIENCE_STEPS

    return arrived
