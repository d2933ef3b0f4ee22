"""One control step as a quadratic program: its named rows, its numbers, and the fixtures that check its result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..arrays import Array
from ..certificate.certify_kernel import KEPT, REFUSED
from ..errors import ControlError
from ..virtual_fixtures import Constraint, Fixture, Objective, StepState
from ..virtual_fixtures.state_kernel import BODY, SEGMENT
from . import qp
from .context import ControlContext
from .problem_kernel import prepare
from .program import Program, Solution
from .step_kernel import DISPLACEMENT, NEEDED, SCALE, UNSOLVED, AnswerViews, answer_of, fused_step
from .step_request import StepRequest, Task


class Row(NamedTuple):
    """One inequality row of a problem for display: a·Δq ≤ bound, in ``unit``.

    name: description; kind: 'bone', 'zone', 'joint', or the name that a task or fixture gives.
    """

    name: str
    kind: str
    unit: str
    bound: float


class Problem:
    """The program of one step over x = (Δq / L, λ, slacks / L), Δq (n,) in mm and rad.

    Minimise ½ xᵀH x + fᵀx subject to lower ≤ x ≤ upper and G x ≤ h.
    Its numbers are stored in the workspace of its ``ControlContext``: building the next problem overwrites them, and
    reading them afterwards raises ControlError.

    state: start of the step; request: of all tasks together; fixtures: active in every step.
    objectives, constraints: of tasks and fixtures; the rows of anatomy, zones and joints are derived from the state.
        Anatomy, zones and joint limits are checked by the certificate.
    scale: length L of the wanted step in mm; rests: no motion is requested, the tool decelerates to rest.
    brakes: it does so without a program, within the acceleration limits of the joints.
    box: (2, n) lower and upper bounds of Δq; tasks: as passed to ``build_step``.
    """

    rests = False
    brakes = False
    box: Array | None = None  # None: the bounds of the state
    tasks: Task | Sequence[Task] = ()
    share = 1.0  # fraction of the wanted motion that the fused kernel's solution achieves
    broken = False  # a joint must exceed its acceleration limit, as the fused kernel tells
    own_failed = False  # the fused kernel found no solution that passes its check
    full_refused = False  # the full step of its solution was refused
    _program: Program | None = None
    _numbers: Array | None = None  # of the fused kernel: the state after the step, and its answer
    _count = 0  # rows of the program, after the fused kernel
    _joined: tuple[qp.ObjectiveRows, qp.ConstraintRows] | None = None

    def __init__(
        self,
        state: StepState,
        request: StepRequest,
        fixtures: Sequence[Fixture],
        objectives: Sequence[Objective],
        constraints: Sequence[Constraint],
        scale: float,
    ):
        context: ControlContext = state.context
        self.state, self.context, self.request, self.fixtures = state, context, request, fixtures
        self.objectives, self.constraints, self.scale = objectives, constraints, scale
        self._generation = context.generation = context.generation + 1

    @property
    def motion_gain(self) -> Array:
        """(n,) wanted motion, as a fraction, per unit of each joint's motion; 0 if no motion is wanted."""
        motion_gain = self.request.motion_gain
        return self.context.no_gain if motion_gain is None or self.rests else motion_gain

    @property
    def joined(self) -> tuple[qp.ObjectiveRows, qp.ConstraintRows]:
        """Rows of all objectives and of all constraints, each in one array.

        Raises:
            InputError: a row does not have n + 1 columns.
        """
        if self._joined is None:
            size, constraints = self.context.layout.dof + 1, self.constraints
            given = qp.join_constraints(constraints, size) if constraints else self.context.no_rows
            self._joined = qp.join_objectives(self.objectives, size), given
        return self._joined

    @property
    def program(self) -> Program:
        """Numbers of the program; the rows of the constraints come first, then those of the state's pairs.

        Raises:
            ControlError: another problem has been built since and overwrote them.
        """
        if self._generation != self.context.generation:
            raise ControlError("the problem's numbers are overwritten: another problem was built since")
        if self._program is None:
            if self._numbers is None:
                self._program = self._assembled()
            else:
                dof, scale = self.context.layout.dof, float(self._answer(self._numbers).told[SCALE])
                workspace = self.context.program_workspace(dof + 1, self._count)
                self._program = qp.program_in(workspace, dof, 0, self._count, scale)
        return self._program

    @property
    def joint_box(self) -> Array:
        """(2, n) lower and upper bounds of Δq in mm and rad."""
        box: Array = self.state.box if self.box is None else self.box
        return box

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows with their names, in the order of ``program.rows``; then both bounds of every joint."""
        return row_names(self)

    @property
    def row_count(self) -> int:
        """Number of inequality rows as the papers count them: constraints and both bounds of every joint."""
        if self._numbers is not None:
            return self._count + 2 * self.context.layout.dof
        return self.program.row_count

    def changed(
        self,
        program: Program,
        constraints: Sequence[Constraint] | None = None,
        box: Array | None = None,
    ) -> Problem:
        """Return this step with another program, as a relaxation builds it."""
        other = object.__new__(Problem)
        other.__dict__.update(self.__dict__)
        other._program, other._numbers = program, None
        other.own_failed = other.full_refused = False
        other.constraints = self.constraints if constraints is None else constraints
        other.box = self.box if box is None else box
        return other

    def without(self, kind: str) -> Problem:
        """Return this step without the constraints of a kind, overwriting this one; itself if there are none."""
        kept = tuple(c for c in self.constraints if c.kind != kind)
        if len(kept) == len(self.constraints):
            return self
        other = Problem(self.state, self.request, self.fixtures, self.objectives, kept, self.scale)
        other.rests, other.brakes, other.tasks = self.rests, self.brakes, self.tasks
        return other

    def fused_step(self) -> StepState | None:
        """Assemble, solve and certify this problem in one compiled call, unless it has slack variables.

        The program is the one that ``solve_step`` would assemble.
        Returns None if there is no solution or the motion is refused, and records which in this problem.
        """
        wanted, given = self.joined
        if given.soft:
            return None
        context, state, gain = self.context, self.state, self.request.motion_gain
        if gain is None or self.rests:
            gain = context.no_gain
        numbers = self._numbers = context.step_numbers(len(given.bound))
        verdict, self.share, self._count, self.broken = fused_step(
            context.table, state.numbers, *wanted, given.matrix, given.bound, self.scale, gain, numbers
        )
        self.own_failed, self.full_refused = verdict == UNSOLVED, verdict != UNSOLVED
        if verdict == KEPT:
            return StepState.measured(context, context.layout, numbers)
        if verdict in (UNSOLVED, REFUSED):
            return None
        told = self._answer(numbers).told
        context.provide(verdict, int(told[NEEDED]), state.numbers, numbers, float(told[DISPLACEMENT]))
        return context.certify(state, self.found_step())

    def found_solution(self) -> Solution | None:
        """Return the fused kernel's solution; None if it has none or has not run."""
        if self._numbers is None or self.own_failed:
            return None
        answer, dof = self._answer(self._numbers), self.context.layout.dof
        return Solution(answer.step, float(answer.x[dof]), answer.multiplier, dof + 1)

    def found_step(self) -> Array:
        """Return the step (n,) of that solution."""
        if self._numbers is None or self.own_failed:
            raise ControlError("the fused kernel has found no answer to this problem")
        return self._answer(self._numbers).step

    def _answer(self, numbers: Array) -> AnswerViews:
        layout = self.context.layout
        return answer_of(numbers, layout.size, layout.dof, self._count)

    def _assembled(self) -> Program:
        context, state, dof = self.context, self.state, self.context.layout.dof
        wanted, given = self.joined
        slacks, count = given.slacks, len(given.bound) + len(state.pairs)
        workspace = context.program_workspace(dof + 1 + slacks, count)
        program = qp.program_in(workspace, dof, slacks, count, self.scale)
        scale = prepare(*context.packed, state.numbers, *wanted, given.matrix, given.bound, self.scale, *program[:5])
        program = program._replace(scale=scale)
        if given.soft:
            qp.soften(program, given)
        return program


def row_names(problem: Problem) -> tuple[Row, ...]:
    """See ``Problem.rows``."""
    context, program = problem.context, problem.program
    parts, names, rows = context.tool.segment_names, context.structures, []
    for constraint in problem.constraints:
        for i in range(len(constraint.bound)):
            text = constraint.text[i] if len(constraint.text) == len(constraint.bound) else constraint.kind
            rows.append(Row(f"{text}, row {i + 1}", constraint.kind, constraint.unit, float(constraint.bound[i])))
    first = len(rows)
    for pair, bound in zip(problem.state.pairs, program.bound[first:], strict=True):
        body = int(pair[BODY])
        kind, name = "zone" if body else "bone", f"{names[body]}, {parts[int(pair[SEGMENT])]}, {pair[0]:.3f} mm"
        rows.append(Row(name, kind, "mm", float(bound * program.scale)))
    low, high = problem.joint_box
    for joint, least, most in zip(context.robot.robot.joints, low, high, strict=True):
        rows.append(Row(f"{joint.name}, lower side", "joint", joint.unit, float(-least)))
        rows.append(Row(f"{joint.name}, upper side", "joint", joint.unit, float(most)))
    return tuple(rows)
