"""The controller of one robot with one tool: certified steps from state to state (Li 2007, section IV)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..proximity.proximity import Proximity
from ..robots import PlacedRobot, Tool
from ..validate import real_array, several
from ..virtual_fixtures import Fixture, Objective, StepState
from ..virtual_fixtures.tip_limit import narrowed
from ..virtual_fixtures.zones import Zone
from . import qp
from .context import ControlContext
from .relaxations import RELAXATIONS, take_step
from .request_kernel import load_requests
from .settings import ControlSettings
from .shaft_kernel import load_shaft_rows
from .step import braking, build_step, problem_of, solve_step
from .step_report import StepReport
from .step_request import StepRequest, Task


class Controller:
    """Turns tasks into certified joint steps for one robot with one tool among anatomy and no-fly zones.

    ``step`` builds, solves and certifies (``build_step``, ``solve_step``, ``certify_step``), relaxes programs that are
    infeasible (``relaxations``), and holds the tool if nothing can be certified.

    Args:
        tree: the anatomy, obstacle 0; zones: further obstacles, each with its own margin.
        fixtures: active in every step; their rows are added to the task's, and each of them checks every motion. Tubes
            and envelopes are narrowed by what the settings compensate, as every margin grows by it.
        solver: of the QP; 'dual' is part of the compiled step, 'daqp' is called natively, others through qpsolvers.

    Raises:
        ControlError: the solver is not installed.

    Example:
        >>> import numpy as np
        >>> from vfix_engine.control.tasks import MoveFreely
        >>> from vfix_engine import HandCommand, ProximityTree, RobotModel, Tool, TriangleMesh
        >>> robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
        >>> wall = TriangleMesh([(-50, 3, -50), (50, 3, -50), (0, 3, 100)], [(0, 1, 2)])
        >>> base = np.eye(4)
        >>> base[:3, 3] = -tool.tip_in_flange  # the tip starts at the origin, 2 mm from the wall
        >>> settings = ControlSettings(margin_mm=0.5)
        >>> controller = Controller(robot.placed(base, tool), tool, ProximityTree(wall), settings)
        >>> state = controller.start(robot.home)
        >>> push = HandCommand(force=np.array([0.0, 2.0, 0.0]))  # N, towards the wall
        >>> for _ in range(500):
        ...     report = controller.step(state, MoveFreely(), push)
        ...     state = report.state
        >>> report.held, state.clearance >= settings.margin_mm
        (True, True)
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
        self.tree, self._given = tree, several("fixtures", fixtures)
        self.fixtures = narrowed(self._given, settings.deflection_mm)
        self.context = ControlContext(robot, tool, tree, settings, zones)
        self.zones = self.context.zones

    def with_anatomy(self, tree: Proximity, zones: Sequence[Zone] | None = None) -> Controller:
        """Return the same controller with anatomy that has moved; it measures states of the old one again.

        ``zones`` replaces all zones; None keeps them.
        """
        zones = self.zones if zones is None else zones
        return Controller(self.robot, self.tool, tree, self.settings, self.solver, zones, self._given)

    def start(self, q: Array) -> StepState:
        """Return the state at rest at q (n,). Raises StartRefused, see ``ControlContext.start``, also by a fixture."""
        state = self.context.start(q)
        for fixture in self.fixtures:
            refuse = getattr(fixture, "refuse_start", None)
            if refuse is not None:
                refuse(state, self.tool.segment_names)
        return state

    def measure(self, q: Array, velocity: Array | None = None) -> StepState:
        """Return the state at q (n,), at rest unless a velocity (n,) is given, unchecked. Raises InputError."""
        return self.context.measure(q, velocity)

    def certify(self, state: StepState, step: Array) -> StepState | None:
        """Return the state after a joint step (n,) from any source if the certificate accepts it, else None.

        Joint speed limits and the controller's fixtures are not checked.

        Raises:
            InputError: the step does not have n numbers.
        """
        given = real_array("the step", step)
        if given.shape != (self.context.layout.dof,):
            raise InputError(f"the step has the shape {given.shape}; it is {self.context.layout.dof} numbers")
        return self.context.certify(self.context.remeasured(state), given)

    def step(self, state: StepState, tasks: Task | Sequence[Task], command: Any = None) -> StepReport:
        """Make one certified step; where no motion can be certified the tool is held, without raising (HAZ-01, HAZ-03).

        Raises:
            InputError: state, task or command has the wrong type, or rows have wrong shapes.
        """
        if not isinstance(state, StepState):
            raise InputError(f"the state is a {type(state).__name__}; it must be a StepState, such as of start(q)")
        if not state.measured_by(self.context):
            state = self.context.remeasured(state)
        return take_step(problem_of(state, tasks, self.fixtures, command), self.solver)

    def warm_up(self, state: StepState) -> None:
        """Load all compiled code that a step can need, also in rare cases; nothing moves.

        A kernel that is compiled at its first call would stop a running robot for seconds.
        """
        dof = len(state.q)
        task = StepRequest((Objective(np.zeros((1, dof + 1)), np.zeros(1)),), (), 1.0, np.zeros(dof))
        state = self.context.remeasured(state)
        take_step(build_step(state, task), self.solver)
        problem = build_step(state, task)
        for relaxation in RELAXATIONS:
            solve_step(relaxation.change(problem), self.solver)
        load_requests(self.context.kernel_sizes, state.numbers)
        load_shaft_rows(self.context.kernel_sizes, state.numbers)
        for fixture in self.fixtures:
            load = getattr(fixture, "warm_up", None)
            if load is not None:
                load(state)
        moving = self.context.measure(state.q, np.full(dof, 1e-9))
        self.context.certify(moving, braking(moving))
