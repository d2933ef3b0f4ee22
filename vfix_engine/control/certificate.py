"""The certificate: a motion is taken only when the tool provably keeps its distance during all of it (HAZ-01, HAZ-02).

Between two poses the joints move linearly.
A point of the tool's axis at share s of the motion is at most s·h + B/8 away from its start and (1 − s)·h + B/8 from
its end, where h is the length of its chord and B bounds its second derivative.
Distance to the anatomy changes no faster than the point moves, so the clearance on the way is at least
(c_0 + c_1 − h) / 2 − B/8, with c_0 and c_1 the clearances at the ends.
Where that is not enough the motion is halved and both halves are certified; a motion that still is not
after ``MAX_HALVINGS`` is refused.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..fixtures import ToolState
from ..robots import PlacedRobot, Tool
from .surroundings import Surroundings

Array = NDArray[np.float64]

SWEEP_TOLERANCE_MM = 1e-3  # how far the bound between two poses may reach under the margin
MAX_HALVINGS = 5


class Certifier:
    """Judges predicted motions of one tool among its surroundings."""

    def __init__(self, robot: PlacedRobot, tool: Tool, surroundings: Surroundings, dt_s: float):
        self._robot, self._tool, self._surroundings, self._dt = robot, tool, surroundings, dt_s

    def measure(self, q: Array) -> ToolState:
        """State at rest at joints q (n,), distances exact up to the boundary threshold."""
        q = np.array(q, dtype=float)
        velocity = np.zeros(len(q))
        for array in (q, velocity):
            array.setflags(write=False)
        tip = self._robot.tip(q)
        segments = self._tool.segments(tip.rotation, tip.position)
        return ToolState(q, velocity, tip, segments, self._surroundings.distances(segments))

    def certify(self, state: ToolState, step: Array) -> ToolState | None:
        """The state after ``step`` (n,) if all of the motion keeps every body's margin, else None.

        From a state already inside a margin only motions that never deepen are accepted (HAZ-04).
        """
        floor = np.minimum(state.distance, self._surroundings.margins[:, None])
        end = self._accept(state, step, floor, MAX_HALVINGS)
        if end is None:
            return None
        velocity = step / self._dt
        velocity.setflags(write=False)
        return replace(end, velocity=velocity)

    def _accept(self, start: ToolState, step: Array, floor: Array, halvings: int) -> ToolState | None:
        end = self.measure(start.q + step)
        if not (np.isfinite(end.distance).all() and (end.distance >= floor).all()):
            return None
        if (self._least_between(start, end, step) >= floor - SWEEP_TOLERANCE_MM).all():
            return end
        if halvings == 0:
            return None
        middle = self._accept(start, step / 2, floor, halvings - 1)
        return None if middle is None else self._accept(middle, end.q - middle.q, floor, halvings - 1)

    def _least_between(self, start: ToolState, end: ToolState, step: Array) -> Array:
        """Lower bound (B, S) of the distance of every body and segment anywhere between the two states."""
        chord = np.maximum(
            np.linalg.norm(end.segments.start - start.segments.start, axis=1),
            np.linalg.norm(end.segments.end - start.segments.end, axis=1),
        )
        size = np.abs(step)
        revolute = self._robot.robot.revolute
        turn, shift = float(size[revolute].sum()), float(size[~revolute].sum())
        lever = self._tool.reach() + self._robot.robot.travel
        bend = turn * turn * lever + 2.0 * turn * shift
        bound: Array = 0.5 * (start.distance + end.distance - chord) - bend / 8.0
        return bound
