"""Scripted operators of study II. They are oracles: they know the labels, and bends that trace their lines.

``BendOracle`` steers the bends as a hand does, by commands to the camera in its picture, in the arms 'guided' and
'certified'. ``JointOracle`` turns one universal joint at a time, chosen by a button, in the arm 'manual'.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...runtime.command import BUTTON_CUT, no_command
from ...runtime.operator import Act
from ...runtime.requests import Request
from ...snake.control.parameterised import ParameterisedControl
from ...worlds.snake.offline.script import ScriptSystem
from ...worlds.snake.requests import ChooseJoint, GetReady
from ...worlds.snake.stepping.state import SnakeState
from .bend_map import BendMap, Steering
from .labels import HALF_MM, Label, axis_on_plane
from .placing import PlacedLabels
from .task import DiathermyState
from .tracing import BEYOND_MM, STEP_MM

SEARCH_MM_PER_S, CUT_MM_PER_S = 40.0, 4.0  # of the camera between labels; of the marker along a line
_REACHED = 0.01  # in (u, v), of a bend on the way
_LATE_MM = 0.5  # the marker waits for the place that is aimed at, and it for the marker
_STUCK_S = 1.5  # without getting on, before a label is given up
_ROUND = 0.12  # in (u, v): a manual hand brings all joints that far, one after the other
_TURNED = math.radians(0.05)  # from an angle that a manual hand wants
_DIFFERENCE = 1e-5  # [rad] of a joint, for the marker's slope


class OracleView(NamedTuple):
    """What an oracle looks at before a step: the system, its state, and the task."""

    system: ScriptSystem
    state: SnakeState
    task: DiathermyState


class BendOracle:
    """Goes from label to label by bends that are free, and along each line by the bends that trace it.

    given_up: numbers of labels that it left, each with the reason in words.
    """

    def __init__(self, bends: BendMap, placed: PlacedLabels) -> None:
        self.given_up: dict[int, str] = {}
        self.choices = 0
        self._bends, self._placed = bends, placed
        self._seen: OracleView | None = None
        self._acts: Iterator[Act] | None = None

    def __call__(self, seen: OracleView) -> Act | None:
        """The next act; None where all labels are done or given up."""
        self._seen = seen
        if self._acts is None:
            self._acts = self._write()
        return next(self._acts, None)

    @property
    def _now(self) -> OracleView:
        assert self._seen is not None
        return self._seen

    def _write(self) -> Iterator[Act]:
        yield Act(no_command(), (GetReady(),))
        for number, line in enumerate(self._placed.tracings):
            way = self._bends.way(self._steering(), line[0])
            if way is None:
                self.given_up[number] = "no way of free bends leads there"
                continue
            yield from self._go(number, way)
            if number not in self.given_up:
                yield from self._cut(number, line)

    def _steering(self) -> Steering:
        return self._now.state.steering

    def _go(self, number: int, way: Sequence[Steering]) -> Iterator[Act]:
        """From bend to bend without cutting."""
        for place in way[1:]:
            waited, best = 0.0, math.inf
            last = place is way[-1]
            while (away := math.dist(self._steering(), place)) > (_REACHED * 0.2 if last else _REACHED):
                waited = 0.0 if away < best - 1e-5 else waited + self._now.state.period_s
                best = min(best, away)
                if waited > _STUCK_S:
                    self.given_up[number] = self._now.state.held_by or "the way there goes no farther"
                    return
                yield self._towards(place, SEARCH_MM_PER_S, 0)

    def _cut(self, number: int, line: Sequence[Steering]) -> Iterator[Act]:
        """Along a line with the button held, the aimed place ahead of the marker by at most half a millimetre."""
        label, along, waited = self._placed.labels[number], -HALF_MM, 0.0
        while self._now.task.labels[number].done_s is None:
            period = self._now.state.period_s
            marker = axis_on_plane(label, _camera(self._now))
            near = marker is not None and math.hypot(marker.along - along, marker.across) < _LATE_MM
            waited = 0.0 if near and along < HALF_MM + BEYOND_MM else waited + period
            if waited > _STUCK_S:
                self.given_up[number] = self._now.state.held_by or "the marker does not follow the line"
                return
            if near:
                along = min(along + CUT_MM_PER_S * period, HALF_MM + BEYOND_MM)
            yield self._towards(_on(line, along), SEARCH_MM_PER_S, BUTTON_CUT)

    def _towards(self, place: Steering, most_mm_per_s: float, buttons: int) -> Act:
        """A pull of the camera, in its picture, towards its place at a bend."""
        state = self._now.state
        assert isinstance(state.control, ParameterisedControl)
        left = np.array(place) - state.control.steering
        pull = state.control.camera_per_steering() @ left / state.period_s
        size = float(np.linalg.norm(pull))
        pull *= min(1.0, most_mm_per_s / max(size, 1e-12))
        if state.settings.arm == "guided":  # the hand withstands the guidance to which it would yield
            pull = pull - state.settings.yield_mm_per_s_per_n * state.forces.guidance
        return _act(pull, buttons)


class JointOracle(BendOracle):
    """The same by one universal joint at a time. choices: how often it chose another one."""

    def _write(self) -> Iterator[Act]:
        here: Steering = (0.0, 0.0)
        for number, line in enumerate(self._placed.tracings):
            way = self._bends.way(here, line[0])
            if way is None:
                self.given_up[number] = "no way of free bends leads there"
                continue
            for place in [*_thinned(way), line[0]]:
                yield from self._turn_all(self._bends.joints(place))
            yield from self._cut(number, line)
            here = line[-1] if number not in self.given_up else line[0]

    def _turn_all(self, goal: Array) -> Iterator[Act]:
        """Every joint to its angles, from the last to the first."""
        links = len(goal) // 2
        for joint in range(1, links + 1):
            first = 2 * (links - joint)
            steps = 0
            while np.abs(goal[first : first + 2] - self._now.state.q[first : first + 2]).max() > _TURNED:
                left = goal[first : first + 2] - self._now.state.q[first : first + 2]
                steps += 1
                if steps * self._now.state.period_s > 10.0:
                    return
                yield self._turn(joint, left, 0)

    def _cut(self, number: int, line: Sequence[Steering]) -> Iterator[Act]:
        """Along a line by the last joint; at the end of its range by the one before."""
        label, along, joint, waited = self._placed.labels[number], -HALF_MM, 1, 0.0
        while self._now.task.labels[number].done_s is None:
            state = self._now.state
            marker = axis_on_plane(label, _camera(self._now))
            if marker is None:
                self.given_up[number] = "the camera does not look at the label any more"
                return
            missing = np.array([along - marker.along, -marker.across])
            near = float(np.hypot(*missing)) < _LATE_MM
            waited = 0.0 if near and along < HALF_MM + BEYOND_MM else waited + state.period_s
            if waited > _STUCK_S:
                if joint == state.pose.shape.q.shape[0] // 2:
                    self.given_up[number] = state.held_by or "no joint brings the marker along the line"
                    return
                joint, waited = joint + 1, 0.0
            if near:
                along = min(along + CUT_MM_PER_S * state.period_s, HALF_MM + BEYOND_MM)
            slope = _marker_slope(self._now, label, joint)
            yield self._turn(joint, np.linalg.pinv(slope, rcond=1e-3) @ missing, BUTTON_CUT)

    def _turn(self, joint: int, angles: Array, buttons: int) -> Act:
        """The push of the hand that turns a joint by two angles in one step; the arm limits its speed."""
        system, state = self._now.system, self._now.state
        snake = system.constants.distal
        lever = joint * snake.length_mm + snake.camera_offset_mm
        asked: tuple[Request, ...] = ()
        if joint != state.hand_joint:
            asked = (ChooseJoint(joint),)
            self.choices += 1
        return _act(np.array([angles[1], -angles[0]]) * lever / state.period_s, buttons, asked)


def _act(pull: Array, buttons: int, asked: tuple[Request, ...] = ()) -> Act:
    return Act(replace(no_command(), axes=(float(pull[0]), float(pull[1]), 0.0), buttons=buttons), asked)


def _camera(seen: OracleView) -> Array:
    return seen.system.constants.snake.camera(seen.state.q, seen.state.base)


def _on(line: Sequence[Steering], along_mm: float) -> Steering:
    """The bend at a place of the arrow, between those that trace it."""
    share = (along_mm + HALF_MM) / STEP_MM
    low = min(int(share), len(line) - 2)
    part = share - low
    (u, v), (u_next, v_next) = line[low], line[low + 1]
    return u + part * (u_next - u), v + part * (v_next - v)


def _thinned(way: Sequence[Steering]) -> list[Steering]:
    """Bends of a way that are some distance apart."""
    found = [way[0]]
    for place in way[1:]:
        if math.dist(place, found[-1]) >= _ROUND:
            found.append(place)
    return found[1:]


def _marker_slope(seen: OracleView, label: Label, joint: int) -> Array:
    """(2, 2) of the marker, mm, by both angles of a universal joint, rad."""
    snake, q = seen.system.constants.snake, seen.state.q
    first, found = 2 * (snake.links - joint), np.zeros((2, 2))
    here = axis_on_plane(label, _camera(seen))
    for column in range(2):
        moved = q.copy()
        moved[first + column] += _DIFFERENCE
        there = axis_on_plane(label, snake.camera(moved, seen.state.base))
        if here is not None and there is not None:
            found[:, column] = (there.along - here.along, there.across - here.across)
    return found / _DIFFERENCE
