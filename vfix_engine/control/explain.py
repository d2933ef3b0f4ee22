"""Which constraint stopped the tool, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixtures import Constraint
from ..geometry.proximity import Pairs
from ..robots import RobotModel, Tool
from .qp import Solution

Array = NDArray[np.float64]

_ACTIVE = 1e-7  # multiplier, in units of the scaled objective


@dataclass(frozen=True)
class Blocker:
    """One reason why the tool moves less than the hand wants; ``point`` (3,) on the anatomy where there is one."""

    kind: str
    text: str
    weight: float
    point: Array | None = None


def blockers(
    solution: Solution,
    constraints: Sequence[Constraint],
    pairs: Pairs,
    tool: Tool,
    robot: RobotModel,
    q: Array,
) -> tuple[Blocker, ...]:
    """The active rows by their multipliers, strongest first, one per segment, joint or target."""
    found: dict[str, Blocker] = {}

    def note(key: str, blocker: Blocker) -> None:
        if key not in found or found[key].weight < blocker.weight:
            found[key] = blocker

    first = 0
    for constraint in constraints:
        weights = solution.row_multiplier[first : first + len(constraint.bound)]
        first += len(constraint.bound)
        for row in np.flatnonzero(weights > _ACTIVE):
            weight, index = float(weights[row]), int(constraint.index[row])
            if constraint.kind == "bone":
                note(f"bone {pairs.segment[index]}", bone_blocker(pairs, index, tool, weight))
            else:
                note(constraint.kind, Blocker(constraint.kind, "the hold on the target", weight))
    for joint in np.flatnonzero(np.abs(solution.bound_multiplier[:-1]) > _ACTIVE):
        weight = float(solution.bound_multiplier[joint])
        note(f"joint {joint}", joint_blocker(robot, q, int(joint), weight))
    return tuple(sorted(found.values(), key=lambda b: -b.weight))


def bone_blocker(pairs: Pairs, index: int, tool: Tool, weight: float) -> Blocker:
    """'bone on the shaft, 0.4 mm'."""
    part = tool.segment_names[int(pairs.segment[index])]
    text = f"bone on the {part}, {max(float(pairs.distance[index]), 0.0):.1f} mm"
    return Blocker("bone", text, weight, np.array(pairs.on_surface[index]))


def joint_blocker(robot: RobotModel, q: Array, joint: int, weight: float) -> Blocker:
    """'joint 6 (insertion) at its limit', or at its top speed where the range is not reached."""
    limit = robot.upper[joint] if weight > 0 else robot.lower[joint]
    name = f"joint {joint + 1} ({robot.joints[joint].name})"
    tolerance = 1e-6 * (robot.upper[joint] - robot.lower[joint])
    state = "at its limit" if abs(q[joint] - limit) <= tolerance else "at its top speed"
    return Blocker("joint" if state == "at its limit" else "speed", f"{name} {state}", abs(weight))
