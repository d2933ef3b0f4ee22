"""Operators without a hand: one that does the job, one that tries to break it.

An operator is a generator: it looks at the drive's state and yields the next order, which the caller carries out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .drive_state import Command
from .parameterised import ParameterisedControl
from .snake_drive import SnakeDrive

Array = NDArray[np.float64]

OPERATORS = ("scripted", "adversarial")

_RAMP_S = 1.0  # [s] from r = 0 to 1
_TURN_S = 4.0  # [s] once round
_AHEAD = 0.08  # the operator waits while the camera is farther behind in (u, v)
_IMPATIENT = 0.25  # pace of a hand that waits, of one that is followed
_GIVE_UP_S = 30.0  # [s] of a look-round, at the latest
_SIDES = 8  # directions about the straight view that a look-round is to turn it in
_TURNED = math.radians(2.0)  # that far at least, in each
_STUCK = 40  # steps of insertion that are held, one after the other, until the operator gives up


@dataclass(frozen=True)
class Stop:
    """A landmark: its name and the arc length in mm where the tip stops for it."""

    name: str
    s_mm: float


class Order(NamedTuple):
    """A command for ``dt`` s; ``event`` says what has just been reached, if anything, ``stop`` where.

    reason: in words, of giving up.
    """

    command: Command
    dt: float
    event: Literal["arrived", "bent", "looked", "gave up"] | None = None
    stop: Stop | None = None
    reason: str | None = None


class _Seen:
    """Which sides the camera has really looked to, whatever it was told."""

    def __init__(self, drive: SnakeDrive) -> None:
        self._drive = drive
        self._sides: set[int] = set()
        self._held: Counter[str] = Counter()
        self.turned = False

    @property
    def all_round(self) -> bool:
        """Whether the view was turned to every side."""
        return len(self._sides) == _SIDES

    def look(self) -> None:
        """Take note of the view as it is, against that of the shape that conforms."""
        state, snake = self._drive.state, self._drive.snake
        rest, view = snake.camera(state.q_conformed, state.base), snake.camera(state.q, state.base)[:3, 2]
        x, y, z = rest[:3, :3].T @ view
        self.turned = math.atan2(math.hypot(x, y), z) >= _TURNED
        if self.turned:
            self._sides.add(round(math.atan2(y, x) / (2.0 * math.pi) * _SIDES) % _SIDES)
        if state.held_by is not None:
            self._held[state.held_by.partition(" would be ")[0]] += 1

    def missing(self, in_time: bool) -> str:
        """In words, what is missing and what held it most often."""
        held = self._held.most_common(1)
        sides = f"the view turned to {len(self._sides)} of {_SIDES} sides"
        return f"{sides}; {'held by' if in_time else 'out of time, held by'} {held[0][0] if held else 'nothing'}"


def scripted(drive: SnakeDrive, stops: Sequence[Stop], target_s: float) -> Iterator[Order]:
    """Insert to ``target_s``; at every stop on the way look round once with the distal links."""
    settings = drive.settings
    for stop in sorted(stops, key=lambda one: one.s_mm):
        if stop.s_mm > target_s + 1e-9:
            break
        yield from _insert(drive, stop.s_mm)
        if drive.tip_s < min(stop.s_mm, drive.length_mm) - 1e-6:
            return
        yield Order(Command(), settings.step_s, "arrived", stop)
        if drive.can_look:
            yield from _look_round(drive, stop)
    yield from _insert(drive, target_s)


def _insert(drive: SnakeDrive, to_s: float) -> Iterator[Order]:
    settings, held = drive.settings, 0
    usual = settings.insertion_step_mm / settings.insertion_mm_per_s  # [s]
    # A path that moves may be shorter than it was: its end is the end.
    while drive.tip_s < min(to_s, drive.length_mm) - 1e-9 and held < _STUCK:
        speed = min(settings.insertion_mm_per_s, (to_s - drive.tip_s) / usual)
        yield Order(Command(insert_mm_per_s=speed), usual)
        held = held + 1 if drive.state.outcome == "held" else 0


def _look_round(drive: SnakeDrive, stop: Stop) -> Iterator[Order]:
    """r from 0 to 1, ϑ once round, back to 0, straight again: all by commands in the camera's plane."""
    dt = drive.settings.step_s
    drive.ready_to_look()
    pilot = drive.control if isinstance(drive.control, ParameterisedControl) else None
    if pilot is None:  # whoever else steers: the paper's surface still says where the camera should go
        shadow = ParameterisedControl(drive.settings.bends, drive.settings.r_max)
        shadow.settle(drive.place(), drive.q[-drive.distal.dof :])
    else:
        shadow = pilot
    done, began, bent, seen = 0.0, drive.t, False, _Seen(drive)
    total = 2.0 * _RAMP_S + _TURN_S
    while done < total and drive.t - began < _GIVE_UP_S:
        r, theta = _wanted_view(done)
        here, target = np.array(shadow.steering), np.array([r * math.cos(theta), r * math.sin(theta)])
        way = target - here
        behind = float(np.linalg.norm(way))
        # Held, the hand goes elsewhere; where the camera hardly moves with the bend, it does not wait for ever.
        close = behind < _AHEAD or drive.state.outcome in ("held", "shrunk")
        done += dt if close else _IMPATIENT * dt
        step = way * min(1.0, 2.0 * dt / _RAMP_S / behind) if behind > 0.0 else way
        camera = shadow.camera_per_steering() @ step / dt
        event: Literal["bent"] | None = None
        if not bent and done >= _RAMP_S and seen.turned:
            bent, event = True, "bent"
        before = drive.snake.camera(drive.q, drive.state.base)
        yield Order(Command(camera_mm_per_s=(float(camera[0]), float(camera[1]))), dt, event, stop)
        seen.look()
        if pilot is None:
            share = _carried_out(before, drive.snake.camera(drive.q, drive.state.base), camera * dt)
            shadow.steering = (float(here[0] + share * step[0]), float(here[1] + share * step[1]))
    in_time = done >= total
    yield from _straighten(drive)
    if in_time and seen.all_round:
        yield Order(Command(), dt, "looked", stop)
    else:
        yield Order(Command(), dt, "gave up", stop, seen.missing(in_time))


def _carried_out(before: Array, after: Array, wanted_mm: Array) -> float:
    """Share, 0 to 1, of a wanted way of the camera in its plane that it went."""
    way = before[:3, :2].T @ (after[:3, 3] - before[:3, 3])
    square = float(wanted_mm @ wanted_mm)
    return min(max(float(way @ wanted_mm) / square, 0.0), 1.0) if square > 0.0 else 1.0


def _straighten(drive: SnakeDrive) -> Iterator[Order]:
    dt, held = drive.settings.step_s, 0
    while held < _STUCK and not drive.straight:
        yield Order(Command(straighten=True), dt)
        held = held + 1 if drive.state.outcome == "held" else 0


def _wanted_view(time_s: float) -> tuple[float, float]:
    """(r, ϑ) of the look-round."""
    theta = 2.0 * math.pi * min(max((time_s - _RAMP_S) / _TURN_S, 0.0), 1.0)
    return min(time_s / _RAMP_S, 1.0, max(2.0 + (_TURN_S - time_s) / _RAMP_S, 0.0)), theta


def adversarial(drive: SnakeDrive, steps: int, seed: int = 0) -> Iterator[Order]:
    """Commands that try to get links out of the pathway: jumps, full speed, one direction for long, nonsense."""
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
        yield Order(Command(insert, camera, kind == "straighten"), step)
