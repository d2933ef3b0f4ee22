"""Operators of the snake: one that does the job, one that tries to break it.

Each is written as a generator of orders, which looks at the drive before each; ``SnakeOperator`` is the operator.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial

import numpy as np

from ....runtime.operator import Act
from ..stepping.command import SnakeCommand
from ..stepping.state import SnakeState
from .drive_view import DriveView
from .look_round import PASSED_MM, STUCK, Order, Retry, Stop, look_round, planned
from .script import ScriptSystem, act_of

__all__ = [
    "OPERATORS",
    "Order",
    "Retry",
    "SnakeOperator",
    "Stop",
    "adversarial",
    "attacked",
    "go_to",
    "insert_to",
    "scripted",
]

OPERATORS = ("scripted", "adversarial")

_CREEP_MM = 0.005  # a step that brings the tip no farther than that is held
_SAME_AGAIN = 2  # steps that are held where nothing moves: another one would be refused by the same numbers
# Of an operator who is held: how far to draw back, mm, and the spacing to come again with, of the usual one.
_COME_AGAIN = ((5.0, 0.5), (10.0, 1.0), (20.0, 2.0), (40.0, 0.5))


class SnakeOperator:
    """An operator of ``ScriptSystem``, whose acts have their orders as notes.

    write: a generator of orders, which sees the drive as it is when each is asked for.
    """

    def __init__(self, write: Callable[[DriveView], Iterator[Order]]) -> None:
        self._write = write
        self._begun: tuple[DriveView, Iterator[Order]] | None = None

    def __call__(self, system: ScriptSystem, state: SnakeState) -> Act | None:
        if self._begun is None:
            view = DriveView(system, state)
            self._begun = view, self._write(view)
        view, orders = self._begun
        view.state, view.asked = state, []
        order = next(orders, None)
        if order is None:
            return None
        act = act_of(order.command, order.dt, view.state)
        return Act(act.command, (*view.asked, *act.requests), order)


def scripted(stops: Sequence[Stop], target_s: float, with_plan: bool = True) -> SnakeOperator:
    """Insert to ``target_s``; at every stop on the way look round once with the distal links.

    with_plan: whether sides that the hand does not reach are looked to by planned bends, from the best place near by.
    """
    return SnakeOperator(partial(_scripted, stops=stops, target_s=target_s, with_plan=with_plan))


def inserted(target_s: float, attempts: int) -> SnakeOperator:
    """Insert to ``target_s``, and nothing else; where it is held, draw back and come again ``attempts`` times."""
    return SnakeOperator(partial(insert_to, to_s=target_s, attempts=attempts))


def withdrawn() -> SnakeOperator:
    """Draw back until the tip is out, and nothing else; where it is held, go a little forwards and come again."""
    return SnakeOperator(_withdraw)


def adversarial(steps: int, seed: int = 0) -> SnakeOperator:
    """Commands that try to get links out of the pathway: jumps, full speed, one direction for long, nonsense."""
    return SnakeOperator(partial(_adversarial, steps=steps, seed=seed))


def attacked(stops: Sequence[Stop], target_s: float, steps: int, seed: int = 0) -> SnakeOperator:
    """As ``scripted``, but for ``steps`` of the adversarial operator at every stop."""

    def write(drive: DriveView) -> Iterator[Order]:
        for order in _scripted(drive, stops, target_s):
            if order.event in (None, "arrived"):
                yield order
            if order.event == "arrived":
                yield from _adversarial(drive, steps, seed)

    return SnakeOperator(write)


def _scripted(drive: DriveView, stops: Sequence[Stop], target_s: float, with_plan: bool = True) -> Iterator[Order]:
    settings = drive.settings
    for stop in sorted(stops, key=lambda one: one.s_mm):
        if stop.s_mm > target_s + 1e-9:
            break
        yield from insert_to(drive, stop.s_mm)
        if drive.tip_s < min(stop.s_mm, drive.length_mm) - 1e-6:
            return
        yield Order(SnakeCommand(), settings.step_s, "arrived", stop)
        if drive.can_look:
            if with_plan:
                yield from _to_the_best_place(drive, stop, target_s)
            yield from look_round(drive, stop, with_plan)
    yield from insert_to(drive, target_s)


def insert_to(drive: DriveView, to_s: float, attempts: int = len(_COME_AGAIN)) -> Iterator[Order]:
    """Forwards; where it is held, back and again."""
    yield from go_to(drive, to_s)
    # A path that moves may be shorter than it was: its end is the end.
    while drive.tip_s < min(to_s, drive.length_mm) - 1e-6:
        passed = yield from _come_again(drive, to_s, attempts)
        if not passed:
            return
        yield from go_to(drive, to_s)


def _come_again(drive: DriveView, to_s: float, attempts: int = len(_COME_AGAIN)) -> Generator[Order, None, bool]:
    """Draw back and come again, farther and with other shapes each time; whether the place was passed."""
    at, why, usual = drive.tip_s, _held_by(drive), drive.settings.waypoint_mm
    x, y, z = (drive.tip if drive.state.held_at is None else drive.state.held_at).tolist()
    passed = False
    for back, share in _COME_AGAIN[:attempts]:
        drive.plan_anew(share * usual)
        before, goal = drive.tip_s, max(at - back, 0.0)
        yield from go_to(drive, goal)
        began, back_held = drive.tip_s, None if drive.tip_s <= goal + 1e-6 else _held_by(drive)
        drive.plan_anew(share * usual)
        beyond = min(at + PASSED_MM, to_s, drive.length_mm)
        yield from go_to(drive, beyond)
        passed = drive.tip_s >= beyond - 1e-6
        retry = Retry(
            at, why, max(before - began, 0.0), share * usual, passed, (x, y, z), back_held,
            drive.tip_s, None if passed else _held_by(drive),
        )  # fmt: skip
        yield Order(SnakeCommand(), drive.settings.step_s, retry=retry)
        if passed:
            break
    drive.plan_anew(usual)
    return passed


def _withdraw(drive: DriveView) -> Iterator[Order]:
    """Backwards, with other shapes where it is held."""
    usual = drive.settings.waypoint_mm
    yield Order(SnakeCommand(straighten=True), drive.settings.step_s)
    for forwards, share in ((0.0, 1.0), *_COME_AGAIN):
        drive.plan_anew(share * usual)
        if forwards:
            yield from go_to(drive, min(drive.tip_s + forwards, drive.length_mm))
        yield from go_to(drive, 0.0)
        if drive.tip_s <= 1e-6:
            return


def _held_by(drive: DriveView) -> str:
    return drive.state.held_by or "steps that hardly move it"


def go_to(drive: DriveView, to_s: float) -> Iterator[Order]:
    """Forwards or backwards, until the tip is there or held."""
    settings, held, same, still = drive.settings, 0, 0, drive.pathway.motion is None
    usual = settings.insertion_step_mm / settings.insertion_mm_per_s  # [s]
    sign = 1.0 if to_s > drive.tip_s else -1.0
    while (min(to_s, drive.length_mm) - drive.tip_s) * sign > 1e-9 and held < STUCK and same < _SAME_AGAIN:
        left = (to_s - drive.tip_s) / usual
        speed = sign * min(settings.insertion_mm_per_s, abs(left))
        was = drive.tip_s
        yield Order(SnakeCommand(insert_mm_per_s=speed), usual)
        same = same + 1 if still and drive.tip_s == was and drive.state.outcome == "held" else 0
        held = held + 1 if abs(drive.tip_s - was) < min(_CREEP_MM, 0.5 * abs(to_s - was)) else 0


def _to_the_best_place(drive: DriveView, stop: Stop, target_s: float) -> Iterator[Order]:
    """Where a landmark itself leaves a side out: to the place near by from which the worst side is the best."""
    within, least = drive.settings.look_within_mm, math.radians(drive.settings.look_least_deg)
    best_s, best = stop.s_mm, _worst_side(drive)
    for offset in (-0.5, -1.0, 0.5, 1.0):
        place = stop.s_mm + offset * within
        if best >= least:
            return
        if not 0.0 < place <= min(target_s, drive.length_mm):
            continue
        yield from go_to(drive, place)
        if abs(drive.tip_s - place) > 1e-6 or not drive.can_look:
            continue
        found = _worst_side(drive)
        if found > best:
            best_s, best = place, found
    yield from go_to(drive, best_s)


def _worst_side(drive: DriveView) -> float:
    """Of the paths to look to each side from here, how far the shortest turns the view, rad."""
    return min(path.turned for path in planned(drive)[1])


def _adversarial(drive: DriveView, steps: int, seed: int) -> Iterator[Order]:
    random = np.random.default_rng(seed)
    dt = drive.settings.step_s
    usual = drive.settings.insertion_step_mm / drive.settings.insertion_mm_per_s
    left, pace = 0, 1.0
    kind, direction = "push", np.zeros(2)
    for _ in range(steps):
        if left <= 0:
            kind = str(random.choice(["push", "push", "spin", "jump", "insert", "retract", "straighten", "nonsense"]))
            angle = random.uniform(0.0, 2.0 * math.pi)
            direction = np.array([math.cos(angle), math.sin(angle)]) * 10.0 ** random.uniform(0.0, 4.0)
            left, pace = int(random.integers(5, 120)), float(random.choice([1.0, 10.0, 40.0]))
        left -= 1
        camera, insert, step = (0.0, 0.0), 0.0, pace * dt
        if kind == "push":
            camera = (float(direction[0]), float(direction[1]))
        elif kind == "spin":
            c, s = math.cos(0.2), math.sin(0.2)
            direction = np.array([c * direction[0] - s * direction[1], s * direction[0] + c * direction[1]])
            camera = (float(direction[0]), float(direction[1]))
        elif kind == "jump":
            wild = random.normal(size=2) * 10.0 ** random.uniform(0.0, 6.0)
            camera = (float(wild[0]), float(wild[1]))
            step = float(dt * random.choice([1.0, 5.0, 50.0]))
        elif kind in ("insert", "retract"):
            sign = 1.0 if kind == "insert" else -1.0
            insert, step = sign * 10.0 ** random.uniform(0.0, 3.0), usual
            camera = (float(direction[0]), 0.0) if random.uniform() < 0.2 else (0.0, 0.0)
        elif kind == "nonsense":
            values = [math.nan, math.inf, -math.inf, 1e300, -1e300, 0.0]
            camera = (float(random.choice(values)), float(random.choice(values)))
            insert = float(random.choice([0.0, 0.0, math.nan, math.inf, 1e300]))
        yield Order(SnakeCommand(insert, camera, kind == "straighten"), step)
