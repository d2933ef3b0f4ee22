"""Measured states and certified motions of one tool among its surroundings (HAZ-01, HAZ-02, HAZ-04).

What a certificate means, and why it holds, stands at ``judge_kernel`` and in docs/safety.md.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import ControlError
from ..fixtures import ToolState
from ..fixtures.state import Near
from ..geometry.capsules import Segments
from ..geometry.pairs import MAX_ROWS
from ..robots import TipState
from .judge_kernel import KEPT, OVERFULL, UNCOVERED, judge, look
from .moment_kernel import moment_parts, moment_size
from .surroundings import Surroundings

Array = NDArray[np.float64]
Index = NDArray[np.int32]
Kind = TypeVar("Kind")

_ROOM = 2048  # pairs that the workspace holds at first
_ATTEMPTS = 4  # a motion is judged at most once more for each thing that can be missing


class Certifier:
    """Judges predicted motions; what it returns are immutable snapshots."""

    def __init__(self, surroundings: Surroundings):
        self.surroundings = surroundings
        world = surroundings.world
        self._sizes = (len(world.lower), len(world.radius), len(world.margin))
        self._radius = world.radius
        self._workspace = _workspace(_ROOM)

    def measure(self, q: Array, velocity: Array | None = None) -> ToolState:
        """The state at joints q (n,), at rest unless a velocity (n,) is given; distances exact up to the threshold."""
        dof = self._sizes[0]
        moment = np.empty(moment_size(*self._sizes))
        moment[:dof] = q
        moment[dof : 2 * dof] = 0.0 if velocity is None else velocity
        for _ in range(_ATTEMPTS):
            pairs, tags = np.empty((MAX_ROWS, 10)), np.empty((MAX_ROWS, 3), np.int32)
            rows, labels, body = self._workspace
            verdict, count = look(*self.surroundings.arrays, moment, rows, labels, body, pairs, tags)
            if verdict == KEPT:
                return self._snapshot(moment, pairs, tags, count)
            self._provide(verdict, count, moment, 0.0)
        raise ControlError("the surroundings of the tool could not be gathered")

    def certify(self, state: ToolState, step: Array) -> ToolState | None:
        """The state after ``step`` (n,) if all of the motion keeps every body's margin, else None.

        From a state already inside a margin only motions that never deepen are accepted (HAZ-04).
        ``state`` must have been measured here.
        """
        near = state.near
        if near is None or near.source is not self:
            raise ControlError("a motion is judged from a state that was measured among the same surroundings")
        after = np.empty(len(near.moment))
        pairs, tags = np.empty((MAX_ROWS, 10)), np.empty((MAX_ROWS, 3), np.int32)
        for _ in range(_ATTEMPTS):
            rows, labels, body = self._workspace
            verdict, count, way = judge(
                *self.surroundings.arrays, near.moment, step, after, rows, labels, body, pairs, tags
            )
            if verdict == KEPT:
                return self._snapshot(after, pairs, tags, count)
            if verdict not in (UNCOVERED, OVERFULL):
                return None
            self._provide(verdict, count, after, way)
        return None

    def knows(self, state: ToolState) -> ToolState:
        """The same state, measured here: among these surroundings, with these margins."""
        near = state.near
        if near is not None and near.source is self:
            return state
        return self.measure(state.q, state.velocity)

    def _provide(self, verdict: int, count: int, moment: Array, way: float) -> None:
        """What a kernel missed: triangles around a pose, or room for its pairs."""
        if verdict == OVERFULL:
            self._workspace = _workspace(2 * count)
        else:
            _, _, _, _, _, start, end, _ = moment_parts(moment, *self._sizes)
            self.surroundings.gather(start, end, way)

    def _snapshot(self, moment: Array, pairs: Array, tags: Index, count: int) -> ToolState:
        n, segments, bodies = self._sizes
        for array in (moment, pairs, tags):
            array.setflags(write=False)
        a = 2 * n + 12
        b = a + 6 * n
        c = b + 3 * segments
        d = c + 3 * segments
        # Built past the dataclasses' constructors, which would take as long as the arithmetic of the step.
        tip, tool, state = _new(TipState), _new(Segments), _new(ToolState)
        tip.__dict__.update(
            rotation=moment[2 * n + 3 : a].reshape(3, 3),
            position=moment[2 * n : 2 * n + 3],
            jacobian=moment[a:b].reshape(6, n),
        )
        tool.__dict__.update(
            start=moment[b:c].reshape(segments, 3), end=moment[c:d].reshape(segments, 3), radius=self._radius
        )
        state.__dict__.update(
            q=moment[:n],
            velocity=moment[n : 2 * n],
            tip=tip,
            segments=tool,
            distance=moment[d:].reshape(bodies, segments),
            near=Near(self, moment, pairs[:count], tags[:count]),
        )
        return state


def _new(kind: type[Kind]) -> Kind:
    return object.__new__(kind)


def _workspace(room: int) -> tuple[Array, Index, Index]:
    """Rows, labels and bodies of so many pairs, see ``measure_kernel.measure``."""
    return np.empty((room, 10)), np.empty((room, 2), np.int32), np.empty(room, np.int32)
