"""Which constraint stopped the tool, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixtures import Constraint, ToolState
from ..fixtures.moment_kernel import BODY, SEGMENT
from ..fixtures.zones import Zone, zone_text
from ..robots import RobotModel, Tool
from .qp import Solution

Array = NDArray[np.float64]

_ACTIVE = 1e-7  # multiplier, in units of the scaled objective
_WORDS = {"target": "the hold on the target"}


@dataclass(frozen=True)
class Blocker:
    """One reason why the tool moves less than the hand wants; ``point`` (3,) on the body where there is one.

    kind: 'bone', 'zone', 'joint' (at the end of its range), 'speed', 'acceleration', or the word of a fixture.
    """

    kind: str
    text: str
    weight: float
    point: Array | None = None


@dataclass(frozen=True, eq=False)
class Box:
    """The limits low ≤ Δq ≤ high, (n,), that one step had, and its period in s."""

    low: Array
    high: Array
    dt: float


class Explainer:
    """Names what acts on one tool among its surroundings."""

    def __init__(self, robot: RobotModel, tool: Tool, zones: Sequence[Zone]):
        self._robot, self._tool, self._zones = robot, tool, tuple(zones)

    def blockers(
        self, solution: Solution, constraints: Sequence[Constraint], state: ToolState, box: Box
    ) -> tuple[Blocker, ...]:
        """The active rows by their multipliers, strongest first, one per body and segment, joint or reason.

        Args:
            constraints: those given to the program, in order; the rows of the state's pairs come after them.
        """
        found: dict[str, Blocker] = {}

        def note(key: str, blocker: Blocker) -> None:
            if key not in found or found[key].weight < blocker.weight:
                found[key] = blocker

        first = 0
        for constraint in constraints:
            weights = solution.row_multiplier[first : first + len(constraint.bound)]
            first += len(constraint.bound)
            for row in np.flatnonzero(weights > _ACTIVE):
                blocker = _fixture_blocker(constraint, int(row), float(weights[row]))
                note(blocker.text, blocker)
        for pair in np.flatnonzero(solution.row_multiplier[first:] > _ACTIVE):
            weight = float(solution.row_multiplier[first + pair])
            blocker = self.pair_blocker(state, int(pair), weight)
            note(f"pair {blocker.text.rsplit(',', 1)[0]}", blocker)
        for joint in np.flatnonzero(np.abs(solution.bound_multiplier) > _ACTIVE):
            weight = float(solution.bound_multiplier[joint])
            note(f"joint {joint}", self._joint_blocker(int(joint), weight, state, box))
        return tuple(sorted(found.values(), key=lambda b: -b.weight))

    def nearest(self, state: ToolState) -> tuple[Blocker, ...]:
        """The nearest body, where the certificate held a step that no row had slowed."""
        if state.near is None or len(state.near.pairs) == 0:
            return (Blocker("certificate", "the motion could not be certified", 1.0),)
        return (self.pair_blocker(state, 0, 1.0),)

    def pair_blocker(self, state: ToolState, index: int, weight: float) -> Blocker:
        """'bone on the shaft, 0.4 mm', or the zone's own words, for one pair of a measured state."""
        if state.near is None:
            raise ValueError("the state was not measured by a controller")
        pair = state.near.pairs[index]
        segment, body = int(pair[SEGMENT]), int(pair[BODY])
        part, distance, point = self._tool.segment_names[segment], float(pair[0]), np.array(pair[7:10])
        if body > 0:
            return Blocker("zone", zone_text(self._zones[body - 1], distance, part), weight, point)
        return Blocker("bone", f"bone on the {part}, {max(distance, 0.0):.1f} mm", weight, point)

    def _joint_blocker(self, joint: int, weight: float, state: ToolState, box: Box) -> Blocker:
        """'joint 6 (insertion) at its limit', at its top speed, or gathering speed."""
        robot = self._robot
        name = f"joint {joint + 1} ({robot.joints[joint].name})"
        bound = float(box.high[joint] if weight > 0 else box.low[joint])
        last, change = state.velocity[joint] * box.dt, robot.acceleration[joint] * box.dt**2
        if abs(bound) >= robot.speed[joint] * box.dt * (1.0 - 1e-9):
            return Blocker("speed", f"{name} at its top speed", abs(weight))
        if abs(abs(bound - last) - change) <= 1e-9 * (change + abs(last)):
            return Blocker("acceleration", f"{name} at its acceleration limit", abs(weight))
        return Blocker("joint", f"{name} at its limit", abs(weight))


def _fixture_blocker(constraint: Constraint, row: int, weight: float) -> Blocker:
    """The words of a constraint's row."""
    text = constraint.text
    if len(text) == len(constraint.bound):
        words = text[row]
    else:
        words = text[0] if text else _WORDS.get(constraint.kind, constraint.kind)
    return Blocker(constraint.kind, words, weight)
