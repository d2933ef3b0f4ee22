"""A rehearsal without a page: an operator drives, every step is measured."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ControlError, InputError
from ...runtime.control_mode import TELEOPERATED, Control
from ...runtime.driver import Driver, Log
from ...runtime.requests import Reset, SetTask
from ...virtual_fixtures.tip_limit import tip_limits
from .covariance_watch import CovarianceWatch
from .dry_run import dry_run
from .operators import PushingOperator, RecordedOperator, RigidOperator, ScriptedOperator, behind_device
from .rehearsal import Rehearsal
from .requests import ApproachPoint
from .servo import ServoWatch
from .snapshot import RigidSnapshot, lazy_snapshot
from .system import NO_PATH, ON_PATH_MM

PATIENCE_STEPS = 400  # steps without progress after which a scripted hand gives up
GAIN_MM = 0.02  # less than this in that many steps is no progress towards a target
GAIN_SHARE = 0.005  # less of the motion that a free hand would make in that many steps is no progress along the path
ATTEMPTS = 3  # to bring the view onto a target, each from further out
BACK_OFF_MM = 8.0
PASSED_MM = 0.3  # the view is past its nearest place when it is this much further away again
SAME_STEP = 1e-6  # a recording that is longer than whole steps by a smaller part of one ends with them
WARM_UP_STEPS = 20  # not counted in the step times: caches fill

HAND = Control()

Keep = Callable[[RigidSnapshot], None]


@dataclass
class RehearsalTally:
    """Running figures of a rehearsal."""

    steps: int = 0
    held: int = 0
    approach: int = 0  # steps on which a guide brought the tip to the path
    on_path: bool = False  # the tip has been within ON_PATH_MM since it came into the mode or was sent elsewhere
    least_clearance: float = np.inf
    rows: tuple[int, int] = (10**9, 0)
    contacts: int = 0  # times that the tool has come to touch bone
    touches: bool = False

    def __post_init__(self) -> None:
        self.errors: list[float] = []
        self.times: list[float] = []

    def add(self, snapshot: RigidSnapshot, seconds: float) -> None:
        self.steps += 1
        self.held += snapshot.held
        self.least_clearance = min(self.least_clearance, snapshot.clearance_mm)
        touches = snapshot.clearance_mm <= 0.0
        self.contacts, self.touches = self.contacts + (touches and not self.touches), touches
        if snapshot.rows:
            self.rows = (min(self.rows[0], snapshot.rows), max(self.rows[1], snapshot.rows))
        self.approach += snapshot.phase == "approach"
        self.on_path = snapshot.mode == "path" and (self.on_path or snapshot.tip_error_mm <= ON_PATH_MM)
        if self.on_path:
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
            "approach_steps": self.approach,
            "tip_error_mm": spread(self.errors, mean=np.mean, max=np.max),
            "contacts": self.contacts,
            "min_clearance_mm": self.least_clearance,
            "min_bone_clearance_mm": self.least_clearance,
            "step_time_us": spread(self.times, median=np.median, p99=lambda a: np.percentile(a, 99)),
            "qp_rows": {"min": min(self.rows), "max": self.rows[1]},
        }


class HeadlessRun:
    """Lets an operator drive the tool of a rehearsal, and hands every snapshot to ``keep``.

    log: destination of the recorded run; None: nothing is recorded.
    servo: measures the poses between the steps as well; None: nothing does.
    begin_mm: arc length of the path's point that is approached first; None: the one nearest to the entry's pose.
    control: hands-on, or the device of a teleoperated drive.
    covariance: counts the pairs of the papers' tree after every step as well; None: nothing does.

    Raises:
        StartRefused: the start pose is outside a limit or inside the margin.
    """

    def __init__(
        self,
        rehearsal: Rehearsal,
        keep: Keep,
        log: Log | None = None,
        begin_mm: float | None = None,
        servo: ServoWatch | None = None,
        control: Control = HAND,
        covariance: CovarianceWatch | None = None,
    ):
        self._begin_mm, self.servo, self.control, self.covariance = begin_mm, servo, control, covariance
        self.rehearsal, self._keep, self.tally = rehearsal, keep, RehearsalTally()
        self._driver = Driver(rehearsal.system, log=log)
        self.limits = tip_limits(rehearsal.scene.fixtures)
        self.least_rooms = [np.inf] * len(self.limits)  # [mm], of the tip in each tube and envelope so far
        self.least_of_zones = [np.inf] * len(rehearsal.controller.zones)  # [mm], of the whole tool to each so far

    @property
    def fallbacks(self) -> int:
        """Steps so far in which the papers' demand of progress had no solution."""
        return self._driver.state.fallbacks

    def follow(self, hand: RigidOperator | None = None) -> RigidSnapshot:
        """Along the path to its end, or until the hand gives up. hand: of another operator than the scripted one."""
        self._start()
        operator = self._scripted() if hand is None else behind_device(hand, self.control)
        return self._drive(operator, lambda s: s.phase == "done")

    def repeat(self, hand: RecordedOperator) -> RigidSnapshot:
        """From the start on the path by a recorded hand, as long as that was recorded.

        Raises InputError where the hand led another device than this drive's; one without a device leads any.
        """
        if hand.control.mode == TELEOPERATED and hand.control != self.control:
            device, mode = hand.control.device, self.control.mode
            raise InputError(f"the recorded hand led a {device} device; it cannot drive {mode} with another one")
        same = hand.control.mode == self.control.mode
        operator: RigidOperator = hand if same else behind_device(hand, self.control)
        self._start()
        snapshot = self.rehearsal.snapshot(self._driver.state)
        for _ in range(max(math.ceil(hand.duration_s / self.rehearsal.settings.dt_s - SAME_STEP), 1)):
            snapshot = self._one(operator)
        return snapshot

    def push(self, steps: int, seed: int, free: bool) -> dict[str, Any]:
        """Along the path to its tightest place, then ``steps`` steps of full force into bone; what these came to."""
        rehearsal = self.rehearsal
        dry = dry_run(rehearsal.scene, rehearsal.settings)
        tightest = float(dry.s[dry.clearance.argmin()])
        self._start()
        snapshot = self._drive(self._scripted(), lambda s: s.progress_mm >= tightest or s.phase == "done")
        if free:
            self._driver.apply(SetTask("free"))
            self.tally.errors.clear()  # without the fixture the path is no reference
        operator = behind_device(PushingOperator(seed), self.control)
        pushed = RehearsalTally()
        for _ in range(steps):
            snapshot = self._one(operator)
            pushed.add(snapshot, 0.0)
        return {
            # What slowed the last step, or what it went along without being slowed.
            "reason": snapshot.reason or next(iter(snapshot.active), ""),
            "pushing": {
                "task": snapshot.mode,
                "steps": pushed.steps,
                "min_clearance_mm": pushed.least_clearance,
                "min_bone_clearance_mm": pushed.least_clearance,
                "held_steps": pushed.held,
            },
        }

    def inspect(self, target: int, steps: int) -> dict[str, Any]:
        """Along the path to where the view is nearest to the target, onto it, and ``steps`` steps of swinging.

        A hand that cannot bring the view onto the target from there backs off along the path and tries again.
        """
        rehearsal = self.rehearsal
        if rehearsal.scene.path is None:
            raise ControlError("inspection starts from a path; the plan has none")
        goal, name = rehearsal.scene.targets[target], rehearsal.scene.target_names[target]
        self._start()
        self._to_best_view(goal)
        for attempt in range(ATTEMPTS):
            if attempt:
                self._back_off()
            self._driver.apply(SetTask("inspect", target))
            snapshot = self._drive(self._scripted(), _arrival())
            if snapshot.phase == "inspect_hold":
                return {"target": name, "reached": True, "reason": ""} | self._swing(steps)
        reason = snapshot.reason or next(iter(snapshot.active), "the view does not get there")
        return {"target": name, "reached": False, "reason": reason, "error_mm": None, "swing_deg": 0.0}

    def _swing(self, steps: int) -> dict[str, Any]:
        """Swing about the target: the error of the view and the largest turn from where it began."""
        driver, operator = self._driver, self._scripted()
        first = driver.state.tool.tip.rotation
        errors, swing = [], 0.0
        for _ in range(steps):
            errors.append(self._one(operator).target_error_mm)
            turned = np.arccos(np.clip((np.trace(first.T @ driver.state.tool.tip.rotation) - 1) / 2, -1, 1))
            swing = max(swing, float(np.degrees(turned)))
        return {"error_mm": {"mean": float(np.mean(errors)), "max": float(np.max(errors))}, "swing_deg": swing}

    def _back_off(self) -> None:
        """Back onto the path and some distance out along it."""
        state = self._driver.apply(SetTask("path"))
        out = self.rehearsal.snapshot(state).progress_mm - BACK_OFF_MM
        self._drive(self._scripted(drive=-1), lambda s: s.phase == "follow" and s.progress_mm <= max(out, 0.0))

    def _to_best_view(self, goal: np.ndarray) -> None:
        """Drive on until the virtual point has passed where it is nearest to the goal."""
        nearest = np.inf

        def passed(snapshot: RigidSnapshot) -> bool:
            nonlocal nearest
            distance = float(np.linalg.norm(snapshot.virtual_point - goal))
            nearest = min(nearest, distance)
            return snapshot.phase == "done" or distance > nearest + PASSED_MM

        self._drive(self._scripted(), passed)

    def _scripted(self, drive: int = 1) -> RigidOperator:
        return behind_device(ScriptedOperator(drive), self.control)

    def _start(self) -> None:
        """To the entry, on the path. Raises ControlError where there is none."""
        if self.rehearsal.scene.path is None:
            raise ControlError(NO_PATH)
        if self._driver.state.steps:
            self._driver.apply(Reset())
        if self._begin_mm is not None:
            self._driver.apply(ApproachPoint(self._begin_mm))

    def _drive(self, operator: RigidOperator, stop: Callable[[RigidSnapshot], bool]) -> RigidSnapshot:
        """Until ``stop``, or until the hand gives up: held for long, or on the path and no longer getting anywhere."""
        snapshot = self.rehearsal.snapshot(self._driver.state)
        settings = self.rehearsal.settings
        free = settings.gain_mm_per_s_per_n * settings.force_cap_n * settings.dt_s * PATIENCE_STEPS
        held, idle, best = 0, 0, (snapshot.progress_mm, snapshot.tip_error_mm)
        while not stop(snapshot) and max(held, idle) < PATIENCE_STEPS:
            snapshot = self._one(operator)
            held = held + 1 if snapshot.held else 0
            now = snapshot.progress_mm, snapshot.tip_error_mm
            nowhere = max(abs(a - b) for a, b in zip(now, best, strict=True)) < GAIN_SHARE * free
            idle, best = (idle + 1, best) if nowhere and snapshot.mode == "path" else (0, now)
        return snapshot

    def _one(self, operator: RigidOperator) -> RigidSnapshot:
        """One step."""
        driver = self._driver
        act = operator(self.rehearsal.system, driver.state)
        if any(isinstance(request, ApproachPoint) for request in act.requests):
            self.tally.on_path = False  # it is brought to another place of the path
        begin, before = time.perf_counter(), driver.state.tool.q
        state = driver.act(act)
        seconds = time.perf_counter() - begin
        snapshot = lazy_snapshot(self.rehearsal.scene, state)
        self.tally.add(snapshot, seconds)
        nearest = state.tool.distance[1:].min(axis=1)
        self.least_of_zones = [min(*pair) for pair in zip(self.least_of_zones, nearest.tolist(), strict=True)]
        if self.servo is not None:
            self.servo.watch(self.rehearsal.controller, before, state.tool.q)
        if self.covariance is not None:
            self.covariance.watch(self.rehearsal.controller, state.tool)
        rooms = [limit.room(state.tool) - state.settings.deflection_mm for limit in self.limits]
        self.least_rooms = [min(*pair) for pair in zip(self.least_rooms, rooms, strict=True)]
        self._keep(snapshot)
        return snapshot


def _arrival() -> Callable[[RigidSnapshot], bool]:
    """True once the view is held on the target, or comes no nearer to it."""
    nearest, since = np.inf, 0

    def arrived(snapshot: RigidSnapshot) -> bool:
        nonlocal nearest, since
        since += 1
        if snapshot.target_error_mm < nearest - GAIN_MM:
            nearest, since = snapshot.target_error_mm, 0
        return snapshot.phase == "inspect_hold" or since > PATIENCE_STEPS

    return arrived
