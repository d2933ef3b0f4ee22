"""One control step as a quadratic program: its rows by name, its numbers, and who has a say in its verdict."""

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
from .step_kernel import UNSOLVED, answer_views
from .step_request import StepRequest, Task


class Row(NamedTuple):
    """One inequality row of a problem, for people: a·Δq ≤ bound, in ``unit``.

    name: what it is; kind: 'bone', 'zone', 'joint', or the word of a task or fixture.
    """

    name: str
    kind: str
    unit: str
    bound: float


class Problem:
    """The program of one step over x = (Δq / L, λ, slacks / L), Δq (n,) in mm and rad.

    Minimise ½ xᵀH x + fᵀx subject to lower ≤ x ≤ upper and G x ≤ h.
    Its numbers lie in the workspace of its ``ControlContext``: building the next problem overwrites them, and
    reading them after that raises ControlError.

    state: the step begins here; request: of all tasks together; fixtures: those of every step.
    objectives, constraints: of tasks and fixtures; the rows of the boundary, the zones and the joints come with the
    state. Anatomy, zones and joints have their say in the verdict through the certificate.
    scale: length L of the wanted step in mm; rests: nothing is wanted, the tool comes to rest.
    brakes: it does so without a program, as gently as every limit of the joints allows.
    box: (2, n) least and largest Δq; tasks: as they were handed to ``build_step``.
    """

    rests = False
    brakes = False
    box: Array | None = None  # None: that of the state
    tasks: Task | Sequence[Task] = ()
    share = 1.0  # of the wanted motion that the fused kernel's answer makes
    own_failed = False  # the fused kernel has found no answer that passes its check
    full_refused = False  # the motion of its whole answer is refused
    _program: Program | None = None
    _filled: tuple[Array, int, float] | None = None
    _answer: Array | None = None
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
        """(n,) share of the wanted motion that a unit of each joint's motion makes; 0 where there is none to make."""
        motion_gain = self.request.motion_gain
        return self.context.no_gain if motion_gain is None or self.rests else motion_gain

    @property
    def joined(self) -> tuple[qp.ObjectiveRows, qp.ConstraintRows]:
        """The rows of all objectives and of all constraints, each in one array.

        Raises:
            InputError: a row has another number of columns than n + 1.
        """
        if self._joined is None:
            size, constraints = self.context.layout.dof + 1, self.constraints
            given = qp.join_constraints(constraints, size) if constraints else self.context.no_rows
            self._joined = qp.join_objectives(self.objectives, size), given
        return self._joined

    @property
    def program(self) -> Program:
        """The numbers of the program; the rows of the constraints come first, then those of the state's pairs.

        Raises:
            ControlError: another problem was built since; its numbers are where this one's were.
        """
        if self._generation != self.context.generation:
            raise ControlError("the problem's numbers are overwritten: another problem was built since")
        if self._program is None:
            if self._filled is None:
                self._program = self._assembled()
            else:
                workspace, count, scale = self._filled
                self._program = qp.program_in(workspace, self.context.layout.dof, 0, count, scale)
        return self._program

    @property
    def joint_box(self) -> Array:
        """(2, n) least and largest Δq in mm and rad."""
        box: Array = self.state.box if self.box is None else self.box
        return box

    @property
    def rows(self) -> tuple[Row, ...]:
        """Every row by name, in the order of ``program.rows``; then both sides of every joint."""
        return row_names(self)

    @property
    def row_count(self) -> int:
        """Inequality rows the way the papers count them: constraints and both sides of every joint bound."""
        if self._filled is not None:
            return self._filled[1] + 2 * self.context.layout.dof
        return self.program.row_count

    def changed(
        self,
        program: Program,
        constraints: Sequence[Constraint] | None = None,
        box: Array | None = None,
    ) -> Problem:
        """This step with another program, as a relaxation makes it."""
        other = object.__new__(Problem)
        other.__dict__.update(self.__dict__)
        other._program, other._filled, other._answer = program, None, None
        other.own_failed = other.full_refused = False
        other.constraints = self.constraints if constraints is None else constraints
        other.box = self.box if box is None else box
        return other

    def without(self, kind: str) -> Problem:
        """This step without the constraints of a kind, which overwrites this one; itself where there are none."""
        kept = tuple(c for c in self.constraints if c.kind != kind)
        if len(kept) == len(self.constraints):
            return self
        other = Problem(self.state, self.request, self.fixtures, self.objectives, kept, self.scale)
        other.rests, other.brakes, other.tasks = self.rests, self.brakes, self.tasks
        return other

    def fused_step(self) -> StepState | None:
        """Assemble, solve and certify this problem, which has no slacks, in one compiled call.

        The problem is filled as ``solve_step`` would fill it.
        None where there is no answer or the motion is refused, which the problem then says as well.
        """
        context, state = self.context, self.state
        wanted, given = self.joined
        done = context.fused_step(state, wanted, given, self.scale, self.motion_gain)
        solved = done.verdict != UNSOLVED
        self._filled = done.workspace, done.rows, done.scale
        self._answer = done.answer if solved else None
        self.own_failed, self.full_refused, self.share = not solved, solved, done.share
        if done.verdict == KEPT:
            return StepState.measured(context, context.layout, done.after)
        if done.verdict in (UNSOLVED, REFUSED):
            return None
        context.provide(done.verdict, done.needed, state.numbers, done.after, done.displacement)
        return context.certify(state, self.found_step())

    def found_solution(self) -> Solution | None:
        """The fused kernel's answer, with arrays of its own; None where it has none or has not run."""
        if self._answer is None or self._filled is None:
            return None
        dof = self.context.layout.dof
        step, x, multiplier = answer_views(self._answer, dof, dof + 1, self._filled[1])
        return Solution(step, float(x[dof]), multiplier, dof + 1)

    def found_step(self) -> Array:
        """The step (n,) of that answer."""
        if self._answer is None:
            raise ControlError("the fused kernel has found no answer to this problem")
        return self._answer[: self.context.layout.dof]

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
