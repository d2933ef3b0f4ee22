"""Constraints that limit a step, as values for control and as words for display."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..virtual_fixtures import Constraint, Objective, StepState
from ..virtual_fixtures.state_kernel import BODY, SEGMENT
from .problem import Problem
from .program import Solution

_ACTIVE = 1e-7  # smallest multiplier of an active constraint, in units of the scaled objective
_WORDS = {
    "target": "the hold on the target",
    "certificate": "the motion could not be certified",
    "solver": "no safe step was found",
}


@dataclass(frozen=True, eq=False)
class LimitingConstraint:
    """One reason why the tool moves less than the hand asks.

    kind: 'bone', 'zone', 'joint' (at the end of its range), 'speed', 'acceleration', 'certificate', 'solver', 'task' or
        'fixture' (its rows are not finite), or the name that a task or fixture gives its rows.
    structure: id of the anatomy or zone, or name of the joint; '' if there is none.
    weight: multiplier of the row, in units of the scaled objective.
    part: segment of the tool; distance_mm: from it to the structure; point: (3,) on the structure, patient frame.
    joint: index of the joint from 0, or −1 if the constraint is not a joint's.
    words: description of a fixture's own row.
    """

    kind: str
    structure: str = ""
    weight: float = 1.0
    part: str = ""
    distance_mm: float = float("nan")
    point: Array | None = None
    joint: int = -1
    words: str = ""

    @property
    def text(self) -> str:
        """Describe the constraint: 'bone on the shaft, 0.4 mm away', 'joint 6 (insertion) at its limit'."""
        return self.words_with({})

    def words_with(self, names: Mapping[str, str]) -> str:
        """Describe the constraint with the names of structures by id; a structure without a name is shown by its id."""
        if self.kind in ("bone", "zone"):
            bone = self.kind == "bone"
            name = names.get(self.structure, self.structure) if bone else f"protected structure '{self.structure}'"
            return f"{name} on the {self.part}, {max(self.distance_mm, 0.0):.1f} mm away"
        if self.joint >= 0:
            where = {"speed": "at its top speed", "acceleration": "at its acceleration limit"}
            return f"joint {self.joint + 1} ({self.structure}) {where.get(self.kind, 'at its limit')}"
        return self.words or _WORDS.get(self.kind, self.kind)


def active_constraints(problem: Problem, solution: Solution) -> tuple[LimitingConstraint, ...]:
    """Return the active constraints by decreasing multiplier, one per structure and part, joint or reason."""
    found: dict[object, LimitingConstraint] = {}

    def note(key: object, blocker: LimitingConstraint) -> None:
        if key not in found or found[key].weight < blocker.weight:
            found[key] = blocker

    weights, first, state = solution.row_multiplier, 0, problem.state
    for constraint in problem.constraints:
        own = weights[first : first + len(constraint.bound)]
        first += len(constraint.bound)
        for row in np.flatnonzero(own > _ACTIVE):
            blocker = _row_blocker(constraint, int(row), float(own[row]))
            note(blocker.text, blocker)
    for pair in np.flatnonzero(weights[first:] > _ACTIVE):
        blocker = pair_blocker(state, int(pair), float(weights[first + pair]))
        note((blocker.kind, blocker.structure, blocker.part), blocker)
    for joint in np.flatnonzero(np.abs(solution.bound_multiplier) > _ACTIVE):
        note(int(joint), _joint_blocker(problem, int(joint), float(solution.bound_multiplier[joint])))
    return tuple(sorted(found.values(), key=lambda b: -b.weight))


def nearest(state: StepState) -> tuple[LimitingConstraint, ...]:
    """Return the nearest structure, for a step that the certificate refused although no row was active."""
    return (pair_blocker(state, 0, 1.0),) if len(state.pairs) else (LimitingConstraint("certificate"),)


def unsolved(problem: Problem) -> LimitingConstraint:
    """Return the reason why the program has no solution: the source of non-finite rows, or the solver."""
    if not _finite(problem.request.objectives, problem.request.constraints) or not np.isfinite(problem.scale):
        tasks = problem.tasks if isinstance(problem.tasks, (list, tuple)) else (problem.tasks,)
        names = " or ".join(type(task).__name__ for task in tasks)
        return LimitingConstraint("task", names, words=f"the task {names} asks for numbers that are not finite")
    if not _finite(problem.objectives, problem.constraints):
        names = " or ".join(type(fixture).__name__ for fixture in problem.fixtures)
        return LimitingConstraint(
            "fixture", names, words=f"the fixture {names} has rows with numbers that are not finite"
        )
    return LimitingConstraint("solver")


def _finite(objectives: Sequence[Objective], constraints: Sequence[Constraint]) -> bool:
    parts = [part for o in objectives for part in (o.matrix, o.target)]
    parts += [part for c in constraints for part in (c.matrix, c.bound)]
    return all(np.isfinite(part).all() for part in parts)


def pair_blocker(state: StepState, index: int, weight: float) -> LimitingConstraint:
    """Return the limiting constraint of one distance pair of a measured state."""
    pair, context = state.pairs[index], state.context
    body, part = int(pair[BODY]), context.tool.segment_names[int(pair[SEGMENT])]
    kind = "zone" if body > 0 else "bone"
    return LimitingConstraint(kind, context.structures[body], weight, part, float(pair[0]), np.array(pair[7:10]))


def _joint_blocker(problem: Problem, joint: int, weight: float) -> LimitingConstraint:
    """Return the constraint of a joint at its limit, at its top speed, or at its acceleration limit."""
    constants, (low, high) = problem.context.constants, problem.joint_box
    name = problem.context.robot.robot.joints[joint].name
    bound = float(high[joint] if weight > 0 else low[joint])
    last, change = problem.state.velocity[joint] * constants.dt, constants.acceleration[joint] * constants.dt**2
    kind = "joint"
    if abs(bound) >= constants.speed[joint] * constants.dt * (1.0 - 1e-9):
        kind = "speed"
    elif abs(abs(bound - last) - change) <= 1e-9 * (change + abs(last)):
        kind = "acceleration"
    return LimitingConstraint(kind, name, abs(weight), joint=joint)


def _row_blocker(constraint: Constraint, row: int, weight: float) -> LimitingConstraint:
    """Return the limiting constraint for one row of a constraint."""
    text = constraint.text or ("",)
    words = text[row] if len(text) == len(constraint.bound) else text[0]
    return LimitingConstraint(constraint.kind, weight=weight, words=words)
