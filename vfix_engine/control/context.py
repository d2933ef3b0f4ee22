"""One tool among its surroundings: measures step states and certifies motions (HAZ-01, HAZ-02, HAZ-04).

What a certificate means, and why it holds, stands at ``judge_kernel`` and in docs/safety.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ControlError
from ..fixtures import Boundary, Fixture, JointLimits, StepState
from ..fixtures.state import Layout
from ..fixtures.zones import Zone
from ..geometry.array_table import table_of
from ..geometry.pairs import MAX_ROWS
from ..geometry.proximity import Proximity
from ..robots import PlacedRobot, Tool
from . import qp
from .judge_kernel import KEPT, OVERFULL, REFUSED, UNCOVERED, judge, look
from .settings import ControlSettings
from .step_kernel import UNSOLVED, answer_size, fused_step, program_size
from .surroundings import SLACK_MM, Surroundings

if TYPE_CHECKING:
    from .problem import Problem

Array = NDArray[np.float64]
Index = NDArray[np.int32]
Counts = NDArray[np.int64]

_PAIRS = 2048  # that the workspace holds at first
LEAD = 0.8  # of the slack, how far ahead of a moving tool the triangles around it are gathered
_RESTING_MM = 1e-6  # a shorter motion has no direction
_ATTEMPTS = 4  # a motion is judged at most once more for each thing that can be missing


class ControlContext:
    """Robot, tool, anatomy, zones and settings of a control step; what stays the same from step to step.

    It keeps workspaces and a cache of near triangles; neither changes any result.
    One context serves one thread, and one ``Problem`` at a time: the next one uses the workspace of its numbers again.

    Args:
        robot: placed in the patient frame; tool: in its hold.
        tree: the anatomy, body 0; zones: further bodies, each with its own margin.
        settings: of the controller; the control period is ``settings.dt_s``.
    """

    def __init__(
        self,
        robot: PlacedRobot,
        tool: Tool,
        tree: Proximity,
        settings: ControlSettings,
        zones: Sequence[Zone] = (),
    ):
        self.robot, self.tool, self.tree, self.settings = robot, tool, tree, settings
        self.surroundings = surroundings = Surroundings(robot, tool, tree, settings, zones)
        self.zones, self.world, self.packed = surroundings.zones, surroundings.world, surroundings.packed
        world = surroundings.world
        self.layout = Layout(len(world.lower), world.radius, len(world.margin))
        self.no_rows = qp.join_constraints((), self.layout.dof + 1)
        self.no_share = np.zeros(self.layout.dof)
        self.generation = 0  # of the problem that the program's workspace belongs to
        self._rows = MAX_ROWS
        self._program = np.empty(program_size(self.layout.dof + 1, self._rows))
        self._state_size = self.layout.size
        self._answer_size = answer_size(self.layout.dof, self.layout.dof + 1, MAX_ROWS)
        self._pairs = _pair_workspace(_PAIRS)
        self._table = self._made_table()

    @property
    def structures(self) -> tuple[str, ...]:
        """The id of every body, in the order of ``StepState.distance``."""
        return (self.surroundings.structure, *(zone.name for zone in self.zones))

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """What stands in every step among these surroundings: anatomy and zones, then the joints' limits."""
        deceleration, keep = self.settings.approach_deceleration_mm_per_s2, self.world.keep.tolist()
        bodies = [Boundary(keep[i], deceleration, i, name) for i, name in enumerate(self.structures)]
        return (*bodies, JointLimits())

    def measure(self, q: Array, velocity: Array | None = None) -> StepState:
        """The state at joints q (n,), at rest unless a velocity (n,) is given; distances exact up to the threshold."""
        layout, numbers = self.layout, np.empty(self.layout.size)
        layout.part(numbers, "q")[:] = q
        layout.part(numbers, "velocity")[:] = 0.0 if velocity is None else velocity
        for _ in range(_ATTEMPTS):
            verdict, needed = look(*self.surroundings.arrays, numbers, *self._pairs)
            if verdict == KEPT:
                return StepState.measured(self, layout, numbers)
            self._provide(verdict, needed, numbers, numbers, 0.0)
        raise ControlError("the surroundings of the tool could not be gathered")

    def remeasured(self, state: StepState) -> StepState:
        """The same state, measured here: among these surroundings, with these margins."""
        return state if state.measured_by(self) else self.measure(state.q, state.velocity)

    def certify(self, state: StepState, step: Array) -> StepState | None:
        """The state after ``step`` (n,) if all of the motion keeps every body's margin, else None.

        From a state already inside a margin only motions that never deepen are accepted (HAZ-04).

        Raises:
            ControlError: the state was not measured here.
        """
        if not state.measured_by(self):
            raise ControlError("a motion is judged from a state that was measured among the same surroundings")
        before: Array = state.numbers
        after = np.empty(self.layout.size)
        for _ in range(_ATTEMPTS):
            verdict, needed, displacement = judge(*self.surroundings.arrays, before, step, after, *self._pairs)
            if verdict == KEPT:
                return StepState.measured(self, self.layout, after)
            if verdict not in (UNCOVERED, OVERFULL):
                return None
            self._provide(verdict, needed, before, after, displacement)
        return None

    def fused_step(self, problem: Problem) -> StepState | None:
        """Assemble, solve and certify a problem without slacks in one compiled call, as it goes nearly always.

        The problem is filled as ``solve_step`` would fill it.
        None where there is no answer or the motion is refused, which is told to the problem as well.
        """
        (matrix, target, weight), given = problem.joined
        state, after = problem.state, np.empty(self._state_size)
        if given is self.no_rows:
            workspace, answer = self._program, np.empty(self._answer_size)
        else:
            dof, count = self.layout.dof, len(given.bound) + MAX_ROWS
            workspace, answer = self.program_workspace(dof + 1, count), np.empty(answer_size(dof, dof + 1, count))
        verdict, needed, displacement, share, rows, scale = fused_step(
            self._table, state.numbers, matrix, target, weight, given.matrix, given.bound,
            problem.scale, problem.along, answer, after,
        )  # fmt: skip
        problem.fill(workspace, answer, rows, scale, verdict != UNSOLVED, share)
        if verdict == KEPT:
            return StepState.measured(self, self.layout, after)
        if verdict in (UNSOLVED, REFUSED):
            return None
        self._provide(verdict, needed, state.numbers, after, displacement)
        return self.certify(state, problem.found_step())

    def program_workspace(self, unknowns: int, rows: int) -> Array:
        """The workspace of a program, large enough for so many unknowns and rows."""
        usual = unknowns == self.layout.dof + 1
        if usual and rows <= self._rows:
            return self._program
        size = program_size(unknowns, rows)
        if size > len(self._program):
            self._program = np.empty(size)
            self._table = self._made_table()
        if usual:
            self._rows = rows
        return self._program

    def _made_table(self) -> Counts:
        """What every fused step is handed, as one; the arrays are kept here, so that their memory is."""
        self._in_table = (*self.surroundings.arrays, *self._pairs, self._program)
        return table_of(self._in_table)

    def __getstate__(self) -> dict[str, Any]:
        """Without the table, whose addresses are those of this context's arrays: a copy makes its own."""
        state = self.__dict__.copy()
        del state["_table"], state["_in_table"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._table = self._made_table()

    def _provide(self, verdict: int, needed: int, before: Array, after: Array, displacement: float) -> None:
        """What a kernel missed on the motion between two states: workspace for pairs, or the triangles around it."""
        if verdict == OVERFULL:
            self._pairs = _pair_workspace(2 * needed)
        else:
            part = self.layout.part
            start, end = part(before, "start"), part(before, "end")
            new_start, new_end = part(after, "start"), part(after, "end")
            # A tool that moves goes on for a while: triangles are gathered around where it will be.
            ahead = LEAD * SLACK_MM / displacement if displacement > _RESTING_MM else 0.0
            self.surroundings.gather(
                new_start + ahead * (new_start - start), new_end + ahead * (new_end - end), displacement
            )
        self._table = self._made_table()


def _pair_workspace(pairs: int) -> tuple[Array, Index, Index]:
    """Rows, labels and bodies of so many pairs, see ``measure_kernel.measure``."""
    return np.empty((pairs, 10)), np.empty((pairs, 2), np.int32), np.empty(pairs, np.int32)
