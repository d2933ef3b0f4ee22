"""The controller of one robot with one tool: certified steps from state to state (Li 2007, section IV)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import StartRefused
from ..fixtures import Fixture, Objective, StepState
from ..fixtures.zones import Zone, refuse_start
from ..geometry.proximity import Proximity
from ..robots import PlacedRobot, Tool
from . import qp
from .context import ControlContext
from .relaxations import RELAXATIONS, take_step
from .settings import ControlSettings
from .step import braking, build_step, solve_step
from .step_report import StepReport
from .step_request import StepRequest, Task

Array = NDArray[np.float64]


class Controller:
    """Turns tasks into certified joint steps for one robot with one tool among anatomy and no-fly zones.

    ``step`` builds, solves and certifies (``build_step``, ``solve_step``, ``certify_step``), relaxes what has no answer
    (``relaxations``), and holds the tool where nothing can be certified.

    Args:
        tree: the anatomy, body 0; zones: further bodies, each with its own margin.
        fixtures: stand there whatever the task is; their rows join the task's, and they have a say in every verdict.
        solver: of the QP; 'dual' is part of the compiled step, 'daqp' is called natively, others through qpsolvers.

    Raises:
        ControlError: no such solver is installed.
    """

    def __init__(
        self,
        robot: PlacedRobot,
        tool: Tool,
        tree: Proximity,
        settings: ControlSettings,
        solver: str = qp.DUAL,
        zones: Sequence[Zone] = (),
        fixtures: Sequence[Fixture] = (),
    ):
        qp.check_solver(solver)
        self.robot, self.tool, self.settings, self.solver = robot, tool, settings, solver
        self.tree, self.fixtures = tree, tuple(fixtures)
        self.context = ControlContext(robot, tool, tree, settings, zones)
        self.zones = self.context.zones

    def with_anatomy(self, tree: Proximity, zones: Sequence[Zone] | None = None) -> Controller:
        """The same controller among anatomy that has moved; states of this one are measured anew at its next step.

        ``zones`` are those that moved with it, all of them; None: as they were.
        """
        zones = self.zones if zones is None else zones
        return Controller(self.robot, self.tool, tree, self.settings, self.solver, zones, self.fixtures)

    def start(self, q: Array) -> StepState:
        """The state at q (n,), refused when it is outside the joints' ranges or inside a margin (HAZ-04).

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
        state = self.measure(q)
        if not state.clearance >= self.settings.margin_mm:  # NaN is refused as well
            part = self.tool.segment_names[int(state.distance[0].argmin())]
            raise StartRefused(
                f"the {part} would start {state.clearance:.2f} mm from bone, less than the margin of "
                f"{self.settings.margin_mm:g} mm; move the entry away from bone or tilt the robot"
            )
        refuse_start(self.zones, state.distance[1:], self.tool.segment_names)
        return state

    def measure(self, q: Array, velocity: Array | None = None) -> StepState:
        """The state at q (n,), at rest unless a velocity (n,) is given, without any verdict."""
        return self.context.measure(q, velocity)

    def certify(self, state: StepState, step: Array) -> StepState | None:
        """The certificate alone: the state after a joint step (n,), whoever proposes it, or None where it is refused.

        Limits of the joints' speeds and the standing fixtures have no say in it.
        """
        return self.context.certify(self.context.remeasured(state), step)

    def step(self, state: StepState, tasks: Task | Sequence[Task], command: Any = None) -> StepReport:
        """One certified step; never raises on bad luck: what cannot be certified is held (HAZ-01, HAZ-03)."""
        if not state.measured_by(self.context):
            state = self.context.remeasured(state)
        return take_step(build_step(state, tasks, self.fixtures, command), self.solver)

    def warm_up(self, state: StepState) -> None:
        """Load all compiled code that a step may need, also that of unusual steps; nothing moves.

        A kernel that is compiled where it is first needed would halt a running robot for seconds.
        """
        dof = len(state.q)
        task = StepRequest((Objective(np.zeros((1, dof + 1)), np.zeros(1)),), (), 1.0, np.zeros(dof))
        state = self.context.remeasured(state)
        take_step(build_step(state, task), self.solver)
        problem = build_step(state, task)
        for relaxation in RELAXATIONS:
            solve_step(relaxation.change(problem), self.solver)
        moving = self.context.measure(state.q, np.full(dof, 1e-9))
        self.context.certify(moving, braking(moving))
