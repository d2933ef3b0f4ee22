"""One step of constrained control: rows, QP, certificate, explanation (Li 2007, section IV)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import StartRefused
from ..fixtures import (
    Constraint,
    Fixture,
    Objective,
    Situation,
    ToolState,
    boundary,
    joint_bounds,
    little_motion,
)
from ..geometry.proximity import ProximityTree
from ..robots import PlacedRobot, Tool
from . import qp
from .certificate import Certifier
from .explain import Blocker, blockers, bone_blocker
from .settings import ControlSettings
from .surroundings import Surroundings

Array = NDArray[np.float64]

BUFFER_MM = 0.012  # rows keep this much more than the margin, so that the certificate rarely has to say no
SHRINKS = (1.0, 0.5, 0.25, 0.1)  # shares of a step that are tried before holding
HELD_SHARE = 0.02  # a step that achieves less of the wanted motion than this counts as held


@dataclass(frozen=True)
class Task:
    """What one step is asked to do.

    objectives, constraints: rows of the task itself, without boundary and joints.
    scale: length L of the wanted step in mm; 0 means nothing is wanted.
    achieved: share of the wanted motion that a joint step (n,) makes.
    accepts: further verdict on the predicted state, or None.
    compliance: in mm/N, see ``Situation``; None: gain · dt, where the objectives weigh the tip's motion with 1.
    """

    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    scale: float
    achieved: Callable[[Array], float]
    accepts: Callable[[ToolState], bool] | None = None
    compliance: float | None = None


@dataclass(frozen=True)
class StepReport:
    """What became of one step.

    outcome: 'idle' (nothing wanted), 'moved', 'shrunk' or 'held'; share: part of the wanted motion that was made.
    emergency: the step had to exceed a joint's acceleration limit.
    """

    state: ToolState
    outcome: str
    share: float
    blockers: tuple[Blocker, ...]
    rows: int
    emergency: bool = False

    @property
    def held(self) -> bool:
        return self.outcome == "held"


class Controller:
    """Turns a task into a certified joint step for one robot with one tool among one anatomy."""

    def __init__(
        self,
        robot: PlacedRobot,
        tool: Tool,
        tree: ProximityTree,
        settings: ControlSettings,
        solver: str = "daqp",
        fixtures: Sequence[Fixture] = (),
    ):
        """The robot among its surroundings; ``fixtures`` stand there whatever the task is."""
        self.fixtures = tuple(fixtures)
        self.robot, self.tool, self.settings, self._solver = robot, tool, settings, solver
        self._tree = tree
        self._surroundings = Surroundings(tree, settings)
        self._certifier = Certifier(robot, tool, self._surroundings, settings.dt_s)
        self._little_motion = little_motion(robot.robot)

    def start(self, q: Array) -> ToolState:
        """The state at q (n,), refused when it is outside the joints' ranges or inside the margin (HAZ-04).

        Raises:
            StartRefused: says which joint or how much clearance is missing.
        """
        q = np.asarray(q, dtype=float)
        robot = self.robot.robot
        if q.shape != robot.lower.shape or not np.isfinite(q).all():
            raise StartRefused(f"the start needs {len(robot.joints)} finite joint values")
        outside = np.flatnonzero((q < robot.lower) | (q > robot.upper))
        if len(outside):
            i = int(outside[0])
            raise StartRefused(
                f"joint {i + 1} ({robot.joints[i].name}) would start at {q[i]:.2f} {robot.joints[i].unit}, "
                f"outside {robot.lower[i]:g} … {robot.upper[i]:g}; place the robot nearer to the entry"
            )
        state = self._certifier.measure(q)
        if state.clearance < self.settings.margin_mm:
            part = self.tool.segment_names[int(state.distance.argmin())]
            raise StartRefused(
                f"the {part} would start {state.clearance:.2f} mm from bone, less than the margin of "
                f"{self.settings.margin_mm:g} mm; move the entry away from bone or tilt the robot"
            )
        return state

    def measure(self, q: Array) -> ToolState:
        """The state at q without any verdict."""
        return self._certifier.measure(q)

    def step(self, state: ToolState, task: Task) -> StepReport:
        """One certified step; never raises on bad luck: what cannot be certified is held (HAZ-01, HAZ-03)."""
        if not task.scale > 0.0:
            return StepReport(state, "idle", 1.0, (), 0)
        pairs = self._surroundings.pairs(state.segments)
        wall = boundary(pairs, state.tip, self.settings.margin_mm + BUFFER_MM)
        here = np.zeros(len(pairs), np.int32)
        compliance = self.settings.gain_mm_per_s_per_n * self.settings.dt_s
        if task.compliance is not None:
            compliance = task.compliance
        dt = self.settings.dt_s
        now = Situation(state, pairs, here, self.robot.robot, self.tool, dt, task.scale, compliance, self._tree)
        standing = [fixture.rows(now) for fixture in self.fixtures]
        constraints = (*task.constraints, *(c for rows in standing for c in rows.constraints), wall)
        low, high = joint_bounds(self.robot.robot, state.q, self.settings.dt_s)
        objectives = (*task.objectives, *(o for rows in standing for o in rows.objectives), self._little_motion)
        problem = qp.stack(objectives, constraints, low, high, task.scale)
        solution = qp.solve(problem, self._solver)
        if solution is None:
            # Walls on opposite sides may leave no room for the buffer: then holding must be allowed.
            problem = qp.holdable(problem)
            solution = qp.solve(problem, self._solver)
        if solution is None:
            reason = Blocker("solver", "no safe step was found", 1.0)
            return StepReport(state, "held", 0.0, (reason,), problem.row_count)
        why = blockers(solution, constraints, pairs, self.tool, self.robot.robot, state.q)
        return self._take(state, task, solution.step, why, problem.row_count)

    def _take(self, state: ToolState, task: Task, step: Array, why: tuple[Blocker, ...], rows: int) -> StepReport:
        """The largest certified share of the step."""
        for share in SHRINKS:
            after = self._certifier.certify(state, share * step)
            if after is None or (task.accepts is not None and not task.accepts(after)):
                continue
            if not all(fixture.keeps(state, after) for fixture in self.fixtures):
                continue
            achieved = task.achieved(share * step)
            outcome = "held" if achieved < HELD_SHARE else "moved" if share == 1.0 else "shrunk"
            return StepReport(after, outcome, achieved, why, rows)
        return StepReport(state, "held", 0.0, why or self._nearest(state), rows)

    def _nearest(self, state: ToolState) -> tuple[Blocker, ...]:
        """The closest bone, where the certificate held a step that no row had slowed."""
        pairs = self._surroundings.pairs(state.segments)
        if len(pairs) == 0:
            return (Blocker("certificate", "the motion could not be certified", 1.0),)
        return (bone_blocker(pairs, int(pairs.distance.argmin()), self.tool, 1.0),)
