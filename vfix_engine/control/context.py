"""One tool in its surroundings: measures step states and certifies motions (HAZ-01, HAZ-02, HAZ-04).

For the meaning and the proof of a certificate see ``certify_kernel`` and docs/safety.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray
from ..certificate.certify_kernel import KEPT, OVERFULL, UNCOVERED, certify_motion, measure_state
from ..certificate.inputs import MOTION_SPACE, PairSpace
from ..certificate.sweep_kernel import motion_sag
from ..errors import ControlError, InputError, StartRefused
from ..kernels.array_table import table_of
from ..proximity.pairs import MAX_ROWS
from ..proximity.proximity import Proximity
from ..robots import PlacedRobot, Tool
from ..validate import real_array
from ..virtual_fixtures import Boundary, Fixture, JointLimits, StepState
from ..virtual_fixtures.state import Layout
from ..virtual_fixtures.zones import Zone, refuse_start
from . import qp
from .request_kernel import task_numbers
from .settings import ControlSettings
from .step_kernel import answer_size, workspace_size
from .surroundings import SLACK_MM, Surroundings

_PAIRS = 2048  # initial capacity of the workspace
LEAD = 0.8  # lookahead of the candidate search for a moving tool, as a fraction of the slack
_RESTING_MM = 1e-6  # a shorter motion has no direction
_ATTEMPTS = 4  # a motion is certified again at most once for each kind of missing data


class ControlContext:
    """Robot, tool, anatomy, zones and settings: everything that is constant over the steps of a controller.

    It holds workspaces and a cache of near triangles; neither affects any result. ``table`` has the addresses of these
    and of the constants, see ``certificate.inputs``.
    A context serves one thread and one ``Problem`` at a time: the next problem reuses the workspace.

    Args:
        robot: placed in the patient frame; tool: attached to its flange.
        tree: the anatomy, obstacle 0; zones: further obstacles, each with its own margin.
        settings: of the controller; the control period is ``settings.dt_s``.

    Raises:
        InputError: the robot is not placed, the tool is not a ``Tool``, or the anatomy is not indexed.

    Example:
        >>> import numpy as np
        >>> from vfix_engine.control import ControlSettings, HandCommand, build_step, certify_step, solve_step, tasks
        >>> from vfix_engine import ProximityTree, RobotModel, Tool, TriangleMesh
        >>> robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
        >>> wall = TriangleMesh([(-50, 3, -50), (50, 3, -50), (0, 3, 100)], [(0, 1, 2)])
        >>> base = np.eye(4)
        >>> base[:3, 3] = -tool.tip_in_flange  # the tip starts at the origin, 2 mm from the wall
        >>> context = ControlContext(robot.placed(base, tool), tool, ProximityTree(wall), ControlSettings())
        >>> state = context.start(robot.home)
        >>> push = HandCommand(force=np.array([0.0, 2.0, 0.0]))  # N, towards the wall
        >>> problem = build_step(state, tasks.MoveFreely(), command=push)
        >>> solution = solve_step(problem)
        >>> type(certify_step(problem, solution.dq)).__name__
        'Certified'
        >>> certify_step(problem, 5.0 / np.linalg.norm(solution.dq) * solution.dq).by  # 5 mm
        'certificate'
    """

    def __init__(
        self,
        robot: PlacedRobot,
        tool: Tool,
        tree: Proximity,
        settings: ControlSettings,
        zones: Sequence[Zone] = (),
    ):
        _check_kinds(robot, tool, tree)
        self.robot, self.tool, self.tree, self.settings = robot, tool, tree, settings
        self.surroundings = surroundings = Surroundings(robot, tool, tree, settings, zones)
        self.zones, self.constants, self.packed = surroundings.zones, surroundings.constants, surroundings.packed
        constants = surroundings.constants
        self.layout = Layout(len(constants.lower), constants.radius, len(constants.margin))
        # Arguments of the tasks' kernels: settings and tool, and the sizes of a packed state.
        sizes = len(constants.lower), len(constants.radius), len(constants.margin)
        self.kernel_sizes = (task_numbers(settings, tool), *sizes)
        self.no_rows = qp.join_constraints((), self.layout.dof + 1)
        self.no_gain = np.zeros(self.layout.dof)
        self.generation = 0  # number of the problem that owns the program's workspace
        dof = self.layout.dof
        self._rows = MAX_ROWS
        self._program = np.empty(workspace_size(dof + 1, self._rows))
        # Of the state after a step and the answer of a program without given rows, of which each takes one more.
        self._step_size = self.layout.size + answer_size(dof, dof + 1, MAX_ROWS)
        self._pairs, self._scratch = PairSpace.of(_PAIRS), np.empty(MOTION_SPACE.size(*sizes))
        self.table = self._made_table()

    @property
    def structures(self) -> tuple[str, ...]:
        """Ids of all obstacles, in the order of ``StepState.distance``."""
        return (self.surroundings.structure, *(zone.name for zone in self.zones))

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """Fixtures of every step in these surroundings: anatomy and zones, then the joints' limits."""
        deceleration, margins = self.settings.approach_deceleration_mm_per_s2, self.constants.buffered_margin.tolist()
        bodies = [Boundary(margins[i], deceleration, i, name) for i, name in enumerate(self.structures)]
        return (*bodies, JointLimits())

    def start(self, q: ArrayLike) -> StepState:
        """Return the state at rest at q (n,); refuse joints outside their ranges or a tool inside a margin (HAZ-04).

        Raises:
            StartRefused: the message names the joint, or the missing clearance and the structure.
        """
        robot = self.robot.robot
        try:
            q = self._joints("the start", q)
        except InputError as error:
            raise StartRefused(str(error)) from error
        outside = np.flatnonzero((q < robot.lower) | (q > robot.upper))
        if len(outside):
            i = int(outside[0])
            raise StartRefused(
                f"joint {i + 1} ({robot.joints[i].name}) would start at {q[i]:.2f} {robot.joints[i].unit}, "
                f"outside {robot.lower[i]:g} … {robot.upper[i]:g}; place the robot nearer to the entry"
            )
        state = self.measure(q)
        if not state.clearance >= self.settings.kept_mm:  # NaN is refused as well
            part = self.tool.segment_names[int(state.distance[0].argmin())]
            raise StartRefused(
                f"the {part} would start {state.clearance:.2f} mm from bone, less than the margin of "
                f"{self.settings.kept_mm:g} mm; move the entry away from bone or tilt the robot"
            )
        refuse_start(self.zones, state.distance[1:], self.tool.segment_names, self.settings.deflection_mm)
        return state

    def measure(self, q: ArrayLike, velocity: ArrayLike | None = None) -> StepState:
        """Return the state at joints q (n,), at rest unless a velocity (n,) is given, without checking it.

        Distances are exact up to the threshold.

        Raises:
            InputError: q or velocity does not have n finite numbers.
        """
        layout, numbers = self.layout, np.empty(self.layout.size)
        layout.part(numbers, "q")[:] = self._joints("q", q)
        layout.part(numbers, "velocity")[:] = 0.0 if velocity is None else self._joints("the velocity", velocity)
        for _ in range(_ATTEMPTS):
            verdict, needed = measure_state(self.table, numbers)
            if verdict == KEPT:
                return StepState.measured(self, layout, numbers)
            self.provide(verdict, needed, numbers, numbers, 0.0)
        raise ControlError("the surroundings of the tool could not be gathered")

    def _joints(self, what: str, values: ArrayLike) -> Array:
        """Convert to n finite numbers, one per joint. Raises InputError."""
        joints = real_array(what, values)
        if joints.shape != (self.layout.dof,) or not np.isfinite(joints).all():
            raise InputError(f"{what} is {joints.tolist()!r:.80}; it is {self.layout.dof} finite joint values")
        return joints

    def sag_mm(self, before: StepState, after: StepState) -> float:
        """Bound the deviation in mm of a point of the tool from the chord between its two positions in a motion."""
        return motion_sag(*self.packed, before.q, after.q)

    def remeasured(self, state: StepState) -> StepState:
        """Return the same state measured in this context, with its surroundings and margins."""
        return state if state.measured_by(self) else self.measure(state.q, state.velocity)

    def certify(self, state: StepState, step: Array) -> StepState | None:
        """Return the state after ``step`` (n,) if the whole motion respects every obstacle's margin, else None.

        From a state inside a margin only motions that never decrease the clearance are accepted (HAZ-04).

        Raises:
            ControlError: the state was not measured by this context.
        """
        if not state.measured_by(self):
            raise ControlError("a motion is certified from a state that was measured among the same surroundings")
        before: Array = state.numbers
        after = np.empty(self.layout.size)
        for _ in range(_ATTEMPTS):
            verdict, needed, displacement = certify_motion(self.table, before, step, after)
            if verdict == KEPT:
                return StepState.measured(self, self.layout, after)
            if verdict not in (UNCOVERED, OVERFULL):
                return None
            self.provide(verdict, needed, before, after, displacement)
        return None

    def step_numbers(self, rows: int) -> Array:
        """Allocate the packed state after a step and its answer, for a program with so many given rows."""
        if rows + MAX_ROWS > self._rows:
            self.program_workspace(self.layout.dof + 1, rows + MAX_ROWS)
        return np.empty(self._step_size + rows)

    def program_workspace(self, unknowns: int, rows: int) -> Array:
        """Return the workspace of a program, enlarged if needed for the given numbers of unknowns and rows."""
        usual = unknowns == self.layout.dof + 1
        if usual and rows <= self._rows:
            return self._program
        size = workspace_size(unknowns, rows)
        if size > len(self._program):
            self._program = np.empty(size)
            self.table = self._made_table()
        if usual:
            self._rows = rows
        return self._program

    def _made_table(self) -> IntArray:
        """Build the kernels' table of inputs; the arrays are kept as attributes to keep their memory alive."""
        self._in_table = (*self.surroundings.arrays, *self._pairs, self._scratch, self._program)
        return table_of(self._in_table)

    def __getstate__(self) -> dict[str, Any]:
        """Omit the table, which holds addresses of this context's arrays; a copy builds its own."""
        state = self.__dict__.copy()
        del state["table"], state["_in_table"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.table = self._made_table()

    def provide(self, verdict: int, needed: int, before: Array, after: Array, displacement: float) -> None:
        """Provide what a kernel lacked for the motion between two states: pair workspace, or triangles around it."""
        if verdict == OVERFULL:
            self._pairs = PairSpace.of(2 * needed)
        else:
            part = self.layout.part
            start, end = part(before, "start"), part(before, "end")
            new_start, new_end = part(after, "start"), part(after, "end")
            # A moving tool usually continues: gather triangles around its extrapolated pose.
            ahead = LEAD * SLACK_MM / displacement if displacement > _RESTING_MM else 0.0
            self.surroundings.gather(
                new_start + ahead * (new_start - start), new_end + ahead * (new_end - end), displacement
            )
        self.table = self._made_table()


def context_of(state: StepState) -> ControlContext:
    """Return the context that measured the state; ControlError if there is none."""
    context = getattr(state, "context", None)
    if not isinstance(context, ControlContext) or not state.measured_by(context):
        raise ControlError("the state was not measured by a ControlContext; take one from its measure()")
    return context


def _check_kinds(robot: Any, tool: Any, tree: Any) -> None:
    """Raise InputError for arguments of wrong types."""
    if not isinstance(robot, PlacedRobot):
        raise InputError(f"the robot is a {type(robot).__name__}; place it: robot.placed(base, tool)")
    if not isinstance(tool, Tool):
        raise InputError(f"the tool is a {type(tool).__name__}; it must be a Tool, such as Tool.load('bent_30')")
    if not hasattr(tree, "candidates"):
        raise InputError(f"the anatomy is a {type(tree).__name__}; index it first: ProximityTree(mesh)")
