"""Measured states and certified motions of one tool among its surroundings (HAZ-01, HAZ-02, HAZ-04).

What a certificate means, and why it holds, stands at ``judge_kernel`` and in docs/safety.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import ControlError
from ..fixtures import ToolState
from ..fixtures.state import Layout, Near
from ..geometry.pairs import MAX_ROWS
from .judge_kernel import KEPT, OVERFULL, UNCOVERED, judge, look
from .qp import DUAL_TOLERANCE, PRIMAL_TOLERANCE, ConstraintRows, ObjectiveRows, Solution
from .step_kernel import attempt, room_parts, room_size
from .surroundings import SLACK_MM, Surroundings

Array = NDArray[np.float64]
Index = NDArray[np.int32]

_ROOM = 2048  # pairs that the workspace holds at first
LEAD = 0.8  # of the slack, how far ahead of a moving tool the triangles around it are gathered
_RESTING_MM = 1e-6  # a shorter motion has no direction
_ATTEMPTS = 4  # a motion is judged at most once more for each thing that can be missing


class Certifier:
    """Judges predicted motions; what it returns are immutable snapshots."""

    def __init__(self, surroundings: Surroundings):
        self.surroundings = surroundings
        world = surroundings.world
        self._layout = Layout(len(world.lower), world.radius, len(world.margin))
        self._size, self._room = self._layout.places[-1], room_size(self._layout.dof, MAX_ROWS)
        self._workspace = _workspace(_ROOM)
        self._arrays = *surroundings.arrays, *self._workspace  # what every step is handed, kept as one

    def measure(self, q: Array, velocity: Array | None = None) -> ToolState:
        """The state at joints q (n,), at rest unless a velocity (n,) is given; distances exact up to the threshold."""
        dof = self._layout.dof
        moment = np.empty(self._size)
        moment[:dof] = q
        moment[dof : 2 * dof] = 0.0 if velocity is None else velocity
        for _ in range(_ATTEMPTS):
            rows, labels, body = self._workspace
            verdict, needed = look(*self.surroundings.arrays, moment, rows, labels, body)
            if verdict == KEPT:
                return self._snapshot(moment)
            self._provide(verdict, needed, moment, moment, 0.0)
        raise ControlError("the surroundings of the tool could not be gathered")

    def certify(self, state: ToolState, step: Array) -> ToolState | None:
        """The state after ``step`` (n,) if all of the motion keeps every body's margin, else None.

        From a state already inside a margin only motions that never deepen are accepted (HAZ-04).
        ``state`` must have been measured here.
        """
        near = measured(state)
        if near.source is not self:
            raise ControlError("a motion is judged from a state that was measured among the same surroundings")
        after = np.empty(self._size)
        for _ in range(_ATTEMPTS):
            rows, labels, body = self._workspace
            verdict, needed, way = judge(*self.surroundings.arrays, near.moment, step, after, rows, labels, body)
            if verdict == KEPT:
                return self._snapshot(after)
            if verdict not in (UNCOVERED, OVERFULL):
                return None
            self._provide(verdict, needed, near.moment, after, way)
        return None

    def attempt(
        self, near: Near, wanted: ObjectiveRows, little: Array, given: ConstraintRows, scale: float, along: Array
    ) -> tuple[ToolState, float, Array, int, int] | None:
        """The usual step in one compiled call; None where anything about it is unusual, and nothing has happened.

        Returns:
            The certified state, the part of the wanted motion that is made, the program's numbers (see ``answer``),
            how many rows it has, and how many joints cannot keep their acceleration.
        """
        size = room_size(self._layout.dof, len(given.bound) + MAX_ROWS) if len(given.bound) else self._room
        room, after = np.empty(size), np.empty(self._size)
        matrix, target, weight = wanted
        for _ in range(_ATTEMPTS):
            verdict, needed, way, share, count, broken = attempt(
                *self._arrays, near.moment, matrix, target, weight, little, given.matrix, given.bound,
                scale, along, PRIMAL_TOLERANCE, DUAL_TOLERANCE, room, after,
            )  # fmt: skip
            if verdict == KEPT:
                return self._snapshot(after), share, room, count, broken
            if verdict not in (UNCOVERED, OVERFULL):
                return None
            self._provide(verdict, needed, near.moment, after, way)
        return None

    def knows(self, state: ToolState) -> ToolState:
        """The same state, measured here: among these surroundings, with these margins."""
        near = state.near
        if near is not None and near.source is self:
            return state
        return self.measure(state.q, state.velocity)

    def _provide(self, verdict: int, needed: int, before: Array, after: Array, way: float) -> None:
        """What a kernel missed on the motion between two moments: room for pairs, or the triangles around it."""
        if verdict == OVERFULL:
            self._workspace = _workspace(2 * needed)
        else:
            start, end = self._layout.segments(before)
            new_start, new_end = self._layout.segments(after)
            # A tool that moves goes on for a while: triangles are gathered around where it will be.
            ahead = LEAD * SLACK_MM / way if way > _RESTING_MM else 0.0
            self.surroundings.gather(new_start + ahead * (new_start - start), new_end + ahead * (new_end - end), way)
        self._arrays = *self.surroundings.arrays, *self._workspace

    def _snapshot(self, moment: Array) -> ToolState:
        return ToolState.measured(Near(self, self._layout, moment))


def answer(room: Array, joints: int, rows: int) -> tuple[Solution, Array]:
    """The answer of an attempt's program, and the joints' box (2, n)."""
    *_, x, multiplier, box, step = room_parts(room, joints, rows)
    return Solution(step, float(x[joints]), multiplier, joints + 1), box


def measured(state: ToolState) -> Near:
    """What the measurement of a state has left, for those who need one that was measured."""
    if state.near is None:
        raise ControlError("the state was not measured by a controller")
    return state.near


def _workspace(room: int) -> tuple[Array, Index, Index]:
    """Rows, labels and bodies of so many pairs, see ``measure_kernel.measure``."""
    return np.empty((room, 10)), np.empty((room, 2), np.int32), np.empty(room, np.int32)
