"""A look-round: once by the hand, then to the sides that it did not reach, by bends that are planned for the view."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ....arrays import Array
from ....snake.control.parameterised import ParameterisedControl
from ....validate import point_text
from ..plans.look_plan import LookPlanner, SidePath, view_of
from ..requests import SIDES
from ..stepping.command import SnakeCommand
from .drive_view import DriveView

STUCK = 40  # steps that are held, one after the other, until the operator gives up
PASSED_MM = 5.0  # beyond a place that held the insertion: past it
_RAMP_S = 1.0  # [s] from r = 0 to 1
_TURN_S = 4.0  # [s] once round
_AHEAD = 0.08  # the operator waits while the camera is farther behind in (u, v)
_IMPATIENT = 0.25  # pace of a hand that waits, of one that is followed
_GIVE_UP_S = 30.0  # [s] of a look-round by hand, at the latest
_HAND_STILL = 1000  # steps in a row in which the hand moves no joint, until it gives up
_BEYOND_MM = 0.1  # less counts as the same place
_BETTER = math.radians(1.0)  # so much farther than the hand a planned bend is to look, to be made
_REACHED = 1e-9  # [rad]
_STEP_S = 0.005  # [s] at least, of a step along a path that is known; it is certified like any other
_STARTS = 40  # random poses from which a side that is not reached is tried


@dataclass(frozen=True)
class Stop:
    """A landmark: its name and the arc length in mm where the tip stops for it."""

    name: str
    s_mm: float


@dataclass(frozen=True)
class SideSeen:
    """One side of a look-round.

    toward_deg: in the straight view's picture, clockwise from the right. turned_deg: the most that the view was really
    turned there. held_by: in words, what ended the planned path there; empty where nothing did. anywhere_deg: the most
    that any pose within the bounds was found to turn it, asked only of sides that were not reached.
    """

    toward_deg: float
    turned_deg: float
    held_by: str
    anywhere_deg: float | None = None


@dataclass(frozen=True)
class Looked:
    """A look-round: the arc length in mm from where, and its sides."""

    s_mm: float
    sides: tuple[SideSeen, ...]

    def count(self, least_deg: float) -> int:
        """How many sides the view was turned to, by so much."""
        return sum(side.turned_deg >= least_deg for side in self.sides)


@dataclass(frozen=True)
class Retry:
    """One more attempt to get past a place that held the insertion, by drawing back and coming again.

    at_mm: of the tip; at_lps: where a link would have left its bound, or else the tip, mm. drawn_back_mm: really, from
    where the tip was before, which may be beyond at_mm; back_held_by: what held it on the way back, if anything.
    passed: whether the tip came 5 mm beyond at_mm, or as far as it was to go. ended_mm: where it came to, and
    ended_by what held it there, None where it passed.
    """

    at_mm: float
    held_by: str
    drawn_back_mm: float
    waypoint_mm: float
    passed: bool
    at_lps: tuple[float, float, float]
    back_held_by: str | None
    ended_mm: float
    ended_by: str | None

    @property
    def words(self) -> str:
        """What held it and where."""
        return f"held at {self.at_mm:.0f} mm, near {point_text(self.at_lps)}: {self.held_by}"

    @property
    def beyond_mm(self) -> float:
        """How far beyond the place the tip came; 0 for what rounding makes and where it did not."""
        beyond = self.ended_mm - self.at_mm
        return beyond if beyond >= _BEYOND_MM else 0.0

    @property
    def outcome(self) -> str:
        """What it came to."""
        if self.passed or self.beyond_mm == 0.0:
            return "past it now" if self.passed else "and again"
        held = f"came {self.beyond_mm:.1f} mm past it and was held again at {self.ended_mm:.0f} mm: {self.ended_by}"
        return f"{held}; {PASSED_MM:g} mm count as past"


class Order(NamedTuple):
    """A command for ``dt`` s; ``event`` says what has just been reached, if anything, ``stop`` where. Note of an act.

    reason: in words, of giving up. looked: what a look-round came to; retry: what an attempt came to.
    """

    command: SnakeCommand
    dt: float
    event: Literal["arrived", "bent", "looked", "gave up"] | None = None
    stop: Stop | None = None
    reason: str | None = None
    looked: Looked | None = None
    retry: Retry | None = None


class _Seen:
    """How far the camera has really looked to each side, whatever was commanded."""

    def __init__(self, drive: DriveView) -> None:
        self._drive = drive
        self.turned = np.zeros(SIDES)  # [rad]

    def look(self) -> None:
        """Take note of the view as it is, against that of the shape that conforms."""
        state, snake = self._drive.state, self._drive.snake
        view = view_of(snake.camera(state.q_nominal, state.base), snake.camera(state.q, state.base)[:3, 2])
        self.turned[view.side()] = max(self.turned[view.side()], view.turned)


def planned(drive: DriveView) -> tuple[LookPlanner, tuple[SidePath, ...]]:
    """Ways to look to every side from where the robot is."""
    planner = LookPlanner(
        drive.distal_context(), drive.distal_limits, math.radians(drive.settings.look_aim_deg), drive.constants.first
    )
    return planner, planner.plan()


def look_round(drive: DriveView, stop: Stop, with_plan: bool = True) -> Iterator[Order]:
    """Once round by camera commands; then, with a plan, to each side that can be looked to farther than that."""
    seen, dt, least = _Seen(drive), drive.settings.step_s, drive.settings.look_least_deg
    trail: list[Array] = []
    yield from _by_hand(drive, stop, seen, trail)
    yield from _back(drive, trail)
    held = [""] * SIDES
    anywhere: list[float | None] = [None] * SIDES
    if with_plan and drive.straight:
        planner, paths = planned(drive)
        widest = int(np.argmax([path.turned for path in paths]))
        for side, path in enumerate(paths):
            held[side] = path.held_by
            if side == widest or path.turned > seen.turned[side] + _BETTER:
                yield from _there_and_back(drive, stop, seen, path.bends, "bent" if side == widest else None)
            if math.degrees(seen.turned[side]) < least:
                most = max(planner.anywhere(side, _STARTS), path.turned, float(seen.turned[side]))
                anywhere[side] = math.degrees(most)
    sides = tuple(
        SideSeen(360.0 * side / SIDES, math.degrees(float(seen.turned[side])), held[side], anywhere[side])
        for side in range(SIDES)
    )
    looked = Looked(drive.tip_s, sides)
    if looked.count(least) == SIDES:
        yield Order(SnakeCommand(), dt, "looked", stop, looked=looked)
    else:
        yield Order(SnakeCommand(), dt, "gave up", stop, _missing(looked, least), looked)


def _missing(looked: Looked, least: float) -> str:
    """In words, which sides are missing and what held them."""
    missing = [side for side in looked.sides if side.turned_deg < least]
    words = "; ".join(
        f"{side.turned_deg:.0f}° towards {side.toward_deg:.0f}°, held by {side.held_by or 'nothing that is known'}"
        for side in missing
    )
    return f"the view turned to {looked.count(least)} of {SIDES} sides by {least:g}°: {words}"


def _by_hand(drive: DriveView, stop: Stop, seen: _Seen, trail: list[Array]) -> Iterator[Order]:
    """r from 0 to 1, ϑ once round, back to 0: all by commands in the camera's plane; ``trail`` gets the bends."""
    dt = drive.settings.step_s
    drive.ready_to_look()
    shadow = None
    if not isinstance(
        drive.state.control, ParameterisedControl
    ):  # the paper's surface still says where the camera should go
        shadow = ParameterisedControl(drive.settings.bends, drive.settings.r_max)
        shadow.prepare(drive.distal_context(), drive.q[-drive.distal.dof :])
    done, began, still = 0.0, drive.state.t, 0
    total = 2.0 * _RAMP_S + _TURN_S
    while done < total and drive.state.t - began < _GIVE_UP_S and still < _HAND_STILL:
        r, theta = _wanted_view(done)
        pilot = shadow or drive.state.control
        assert isinstance(pilot, ParameterisedControl)
        here, target = np.array(pilot.steering), np.array([r * math.cos(theta), r * math.sin(theta)])
        remaining = target - here
        behind = float(np.linalg.norm(remaining))
        # Held, the hand goes elsewhere; where the camera hardly moves with the bend, it does not wait for ever.
        state = drive.state
        close = behind < _AHEAD or (state.outcome in ("held", "shrunk") and state.limit != "speed")
        done += dt if close else _IMPATIENT * dt
        step = remaining * min(1.0, 2.0 * dt / _RAMP_S / behind) if behind > 0.0 else remaining
        camera = pilot.camera_per_steering() @ step / dt
        before = drive.snake.camera(drive.q, drive.state.base)
        yield Order(SnakeCommand(camera_mm_per_s=(float(camera[0]), float(camera[1]))), dt, None, stop)
        seen.look()
        still = still + 1 if trail and np.array_equal(trail[-1], drive.bend) else 0
        trail.append(drive.bend)
        if shadow is not None:
            share = _carried_out(before, drive.snake.camera(drive.q, drive.state.base), camera * dt)
            shadow.steering = (float(here[0] + share * step[0]), float(here[1] + share * step[1]))


def _carried_out(before: Array, after: Array, wanted_mm: Array) -> float:
    """Share, 0 to 1, of a wanted displacement of the camera in its plane that it made."""
    displacement = before[:3, :2].T @ (after[:3, 3] - before[:3, 3])
    square = float(wanted_mm @ wanted_mm)
    return min(max(float(displacement @ wanted_mm) / square, 0.0), 1.0) if square > 0.0 else 1.0


def _wanted_view(time_s: float) -> tuple[float, float]:
    """(r, ϑ) of the look-round by hand."""
    theta = 2.0 * math.pi * min(max((time_s - _RAMP_S) / _TURN_S, 0.0), 1.0)
    return min(time_s / _RAMP_S, 1.0, max(2.0 + (_TURN_S - time_s) / _RAMP_S, 0.0)), theta


def _there_and_back(
    drive: DriveView, stop: Stop, seen: _Seen, bends: Array, event: Literal["bent"] | None
) -> Iterator[Order]:
    """Along a path, and back by the same path."""
    gone: list[Array] = []
    for bend in bends:
        yield from bend_to(drive, bend, stop)
        gone.append(drive.bend)
        if np.abs(drive.bend - bend).max() > _REACHED:
            break
    seen.look()
    yield Order(SnakeCommand(), drive.settings.step_s, event, stop)
    yield from _back(drive, gone)


def bend_to(drive: DriveView, bend: Array, stop: Stop | None = None) -> Iterator[Order]:
    """Bend the distal links to a difference (2L',) rad from the conforming shape, until they are there or held."""
    held, command = 0, SnakeCommand(bend=tuple(float(value) for value in bend))
    least = left = float(np.abs(drive.bend - bend).max())
    while held < STUCK and left > _REACHED:
        yield Order(command, max(drive.settings.step_s, _STEP_S), None, stop)
        left = float(np.abs(drive.bend - bend).max())
        held, least = (0, left) if left < least - _REACHED else (held + 1, least)


def _back(drive: DriveView, trail: list[Array]) -> Iterator[Order]:
    """Straight again; where the straight path there is held, by the bends that led here."""
    yield from straighten(drive)
    if not drive.straight:
        for bend in reversed(trail):
            yield from bend_to(drive, bend)
        yield from straighten(drive)


def straighten(drive: DriveView) -> Iterator[Order]:
    """Bring the distal links back to the conforming shape, until they are there or held."""
    dt, held, least = max(drive.settings.step_s, _STEP_S), 0, math.inf
    while held < STUCK and not drive.straight:
        yield Order(SnakeCommand(straighten=True), dt)
        left = float(np.abs(drive.bend).max())
        held, least = (0, left) if left < least - _REACHED else (held + 1, least)
