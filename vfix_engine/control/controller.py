"""One step of constrained control: rows, QP, certificate, explanation (Li 2007, section IV)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import StartRefused
from ..fixtures import (
    Constraint,
    Fixture,
    Objective,
    Rows,
    Situation,
    ToolState,
    brake,
    joint_bounds,
    little_motion,
    step_box,
)
from ..fixtures.zones import Zone, refuse_start
from ..geometry.proximity import Proximity
from ..robots import PlacedRobot, Tool
from . import qp
from .certificate import Certifier, answer, measured
from .explain import Blocker, Box, Explainer
from .problem_kernel import prepare
from .settings import ControlSettings
from .surroundings import Surroundings
from .task import StepReport, Task

Array = NDArray[np.float64]

SHRINKS = (1.0, 0.5, 0.25, 0.1)  # shares of a step that are tried before holding
CREEPS = (0.03, 0.01)  # and out of a margin, where the bound on the way leaves no room but that of its tolerance
HELD_SHARE = 0.02  # a step that achieves less of the wanted motion than this counts as held
SLOWED_SHARE = 0.9  # a step that achieves less of it is explained
_STOPPING_MM = 1e-6  # stands for the length of a wish that is none, where the program brings the tool to rest
_ROUNDING = 1e-9  # share of an acceleration limit that is the last bits of a velocity


class _Plan(NamedTuple):
    """A solved step that waits for its certificate.

    gently: within every acceleration limit as it is; limits: the constraints, those of acceleration among them.
    """

    state: ToolState
    task: Task
    solution: qp.Solution
    constraints: Sequence[Constraint]
    box: Array
    rows: int
    gently: bool
    limits: Sequence[Constraint] = ()


class Controller:
    """Turns a task into a certified joint step for one robot with one tool among anatomy and no-fly zones.

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
        surroundings = Surroundings(robot, tool, tree, settings, zones)
        self.zones, self._world, self._packed = surroundings.zones, surroundings.world, surroundings.packed
        self._certifier = Certifier(surroundings)
        self._explainer = Explainer(robot.robot, tool, self.zones)
        rows = little_motion(robot.robot)
        self._little = rows.matrix.T @ (rows.weight * rows.matrix)
        self._nothing_given = qp.join_constraints((), len(rows.target) + 1)
        self._no_way = np.zeros(len(rows.target))

    def with_anatomy(self, tree: Proximity, zones: Sequence[Zone] | None = None) -> Controller:
        """The same controller among anatomy that has moved; states of this one are measured anew at its next step.

        ``zones`` are those that moved with it, all of them; None: as they were.
        """
        zones = self.zones if zones is None else zones
        return Controller(self.robot, self.tool, tree, self.settings, self.solver, zones, self.fixtures)

    def start(self, q: Array) -> ToolState:
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

    def measure(self, q: Array, velocity: Array | None = None) -> ToolState:
        """The state at q (n,), at rest unless a velocity (n,) is given, without any verdict."""
        return self._certifier.measure(q, velocity)

    def warm_up(self, state: ToolState) -> None:
        """Load all compiled code that a step may need, also that of unusual steps; nothing moves.

        A kernel that is compiled where it is first needed would halt a running robot for seconds.
        """
        dof = len(state.q)
        objective = Objective(np.zeros((1, dof + 1)), np.zeros(1))
        task = Task((objective,), (), 1.0, np.zeros(dof))
        state = self._certifier.knows(state)
        self._at_once(state, task, task.objectives, ())
        self._by_parts(state, task, task.objectives, ())
        problem, box, _ = self._problem(state, task.objectives, (), task.scale)
        problem.boxed(box[0], box[1])
        moving = self._certifier.measure(state.q, np.full(dof, 1e-9))
        self._held(self._rest(moving, task).state, (), 0, ())

    def certify(self, state: ToolState, step: Array) -> ToolState | None:
        """The certificate alone: the state after a joint step (n,), whoever proposes it, or None where it is refused.

        Limits of the joints' speeds and the standing fixtures have no say in it.
        """
        return self._certifier.certify(self._certifier.knows(state), step)

    def step(self, state: ToolState, task: Task) -> StepReport:
        """One certified step; never raises on bad luck: what cannot be certified is held (HAZ-01, HAZ-03)."""
        state = self._certifier.knows(state)
        if not task.scale > 0.0:
            return self._rest(state, task)
        objectives, constraints = task.objectives, task.constraints
        if self.fixtures:
            standing = self._standing(state, task)
            objectives = (*objectives, *(o for rows in standing for o in rows.objectives))
            constraints = (*constraints, *(c for rows in standing for c in rows.constraints))
        return self._solved(state, task, objectives, constraints)

    def _standing(self, state: ToolState, task: Task) -> list[Rows]:
        """What the standing fixtures give to this step."""
        now = self._situation(state, task)
        return [fixture.rows(now) for fixture in self.fixtures]

    def _solved(
        self, state: ToolState, task: Task, objectives: Sequence[Objective], constraints: Sequence[Constraint]
    ) -> StepReport:
        at_once = self._at_once(state, task, objectives, constraints)
        return self._by_parts(state, task, objectives, constraints) if at_once is None else at_once

    def _at_once(
        self, state: ToolState, task: Task, objectives: Sequence[Objective], constraints: Sequence[Constraint]
    ) -> StepReport | None:
        """The step in one compiled call, as it goes nearly always; None where it does not."""
        if self.solver != qp.DUAL:
            return None
        little, given, along = self._little, self._nothing_given, task.along
        if constraints:
            given = qp.join_constraints(constraints, len(little))
            if given.soft:
                return None
        wanted = qp.join_objectives(objectives, len(little))
        way = self._no_way if along is None else along
        done = self._certifier.attempt(measured(state), wanted, little, given, task.scale, way)
        if done is None:
            return None
        after, share, room, rows, broken = done
        if (task.accepts is not None or self.fixtures) and not self._accepted(state, after, task):
            return None
        sides = rows + 2 * len(self._no_way)

        def plan() -> _Plan:
            solution, box = answer(room, len(self._no_way), rows)
            return _Plan(state, task, solution, constraints, box, sides, broken == 0)

        rushed = broken > 0 and self._rushed(state, room[: len(self._no_way)])
        achieved = 1.0 if along is None else share
        if achieved >= SLOWED_SHARE:
            return StepReport(after, "moved", achieved, (), sides, rushed, lambda: self._why(plan())[0], task.begun)
        outcome, why = self._slowed(plan(), achieved, "moved")
        return StepReport(after, outcome, achieved, why, sides, rushed, begun=task.begun)

    def _by_parts(
        self, state: ToolState, task: Task, objectives: Sequence[Objective], constraints: Sequence[Constraint]
    ) -> StepReport:
        """The step part by part: any solver, soft rows, programs without a solution, motions to be cut short."""
        limits = constraints
        problem, box, broken = self._problem(state, objectives, constraints, task.scale)
        solution = qp.solve(problem, self.solver)
        gently = solution is not None and broken == 0
        if solution is None:
            # Where a retreat cannot be had as a whole, as much of it as the accelerations allow.
            solution = qp.solve(problem.holdable(len(problem.rows) - len(measured(state).pairs)), self.solver)
            gently = solution is not None and broken == 0
        if solution is None:
            # Where braking within the accelerations is not enough, keeping the distance comes first.
            hard = tuple(c for c in constraints if c.kind != "acceleration")
            if len(hard) < len(constraints):
                constraints = hard
                problem, _, _ = self._problem(state, objectives, constraints, task.scale)
            low, high = joint_bounds(self.robot.robot, state.q, self._world.dt)
            box, problem = np.stack([low, high]), problem.boxed(low, high)
            # Walls on opposite sides may leave no room for the buffer: then holding must be allowed.
            solution = qp.solve(problem, self.solver) or qp.solve(problem.holdable(), self.solver)
        if solution is None:
            reason = Blocker("solver", "no safe step was found", 1.0)
            return self._held(state, (reason,), problem.row_count, limits)
        return self._take(_Plan(state, task, solution, constraints, box, problem.row_count, gently, limits))

    def _situation(self, state: ToolState, task: Task) -> Situation:
        """What the standing fixtures are told."""
        near = measured(state)
        settings = self.settings
        compliance = settings.gain_mm_per_s_per_n * settings.dt_s if task.compliance is None else task.compliance
        return Situation(
            state, near.as_pairs(), near.bodies, self.robot.robot, self.tool, settings.dt_s, task.scale, compliance,
            self.tree,
        )  # fmt: skip

    def _problem(
        self, state: ToolState, objectives: Sequence[Objective], constraints: Sequence[Constraint], scale: float
    ) -> tuple[qp.Problem, Array, int]:
        """The QP of this step with the boundary's rows last, the joints' box, and how many joints break a limit."""
        near = measured(state)
        n = len(state.q)
        given = qp.join_constraints(constraints, n + 1) if constraints else self._nothing_given
        arrays, box = qp.blank(n, given, len(near.pairs)), np.empty((2, n))
        wanted = qp.join_objectives(objectives, n + 1)
        hessian, gradient, matrix, upper, lower = arrays
        scale, broken = prepare(
            self._packed.numbers, self._packed.counts, near.moment, wanted.matrix, wanted.target, wanted.weight,
            self._little, given.matrix, given.bound, scale,
            hessian, gradient, matrix, upper, lower, box,
        )  # fmt: skip
        problem = qp.Problem(*arrays, scale, n)
        if given.soft:
            qp.soften(problem, given)
        return problem, box, broken

    def _take(self, plan: _Plan) -> StepReport:
        """The largest certified share of the solution's step."""
        state, task = plan.state, plan.task
        inside = bool((state.distance < self._world.margin[:, None]).any())
        for share in (*SHRINKS, *CREEPS) if inside else SHRINKS:
            step = plan.solution.step
            if share < 1.0:  # less of a step is more of braking, not of halting: it keeps the accelerations
                slow = self._braking(state)
                step = slow + share * (step - slow)
            after = self._certified(state, step, task)
            if after is None:
                continue
            achieved = task.achieved(step)
            why: tuple[Blocker, ...] = ()
            outcome = "moved" if share == 1.0 else "shrunk"
            if achieved < SLOWED_SHARE:
                outcome, why = self._slowed(plan, achieved, outcome)
            rushed = not (share == 1.0 and plan.gently) and self._rushed(state, step, plan.limits)
            return StepReport(after, outcome, achieved, why, plan.rows, rushed, lambda: self._why(plan)[0], task.begun)
        return self._held(state, self._why(plan)[0], plan.rows, plan.limits)

    def _slowed(self, plan: _Plan, achieved: float, outcome: str) -> tuple[str, tuple[Blocker, ...]]:
        """Outcome and reasons of a step that makes less than was wanted."""
        why, gathering = self._why(plan)
        # A robot that gathers speed is not held, however little it makes of its first step.
        held = achieved < HELD_SHARE and (len(why) > 0 or not gathering)
        return ("held", why or self._explainer.nearest(plan.state)) if held else (outcome, why)

    def _why(self, plan: _Plan) -> tuple[tuple[Blocker, ...], bool]:
        """What acts on a step, but for accelerations; and whether those do as well."""
        box = Box(plan.box[0], plan.box[1], self._world.dt)
        every = self._explainer.blockers(plan.solution, plan.constraints, plan.state, box)
        why = tuple(b for b in every if b.kind != "acceleration")
        return why, len(why) < len(every)

    def _rest(self, state: ToolState, task: Task) -> StepReport:
        """Nothing is wanted: the tool stands still, or comes to rest as gently as every limit asks for."""
        if not state.velocity.any():
            return StepReport(state, "idle", 1.0, (), 0)
        limits: tuple[Constraint, ...] = ()
        if self.fixtures:
            # What would bring the tool anywhere is left out: without a hand it only comes to rest.
            limits = tuple(c for rows in self._standing(state, task) for c in rows.constraints if c.penalty is None)
            if (state.distance >= self._world.margin[:, None]).all():
                stopping = replace(task, scale=_STOPPING_MM, along=None)
                report = self._solved(state, stopping, task.objectives, (*task.constraints, *limits))
                return report._replace(outcome="idle", share=1.0, blockers=(), told=tuple)
        step = self._braking(state)
        for share in SHRINKS:
            after = self._certified(state, share * step, task)
            if after is not None:
                return StepReport(after, "idle", 1.0, (), 0, self._rushed(state, share * step, limits))
        return StepReport(self._stopped(state), "idle", 1.0, (), 0, self._rushed(state, 0.0 * step, limits))

    def _braking(self, state: ToolState) -> Array:
        """The step (n,) of a robot that comes to rest, within every limit of its joints."""
        if not state.velocity.any():
            return np.zeros(len(state.q))
        world, low, high = self._world, np.empty(len(state.q)), np.empty(len(state.q))
        limits = (world.lower, world.upper, world.speed, world.acceleration, world.dt)
        step_box(state.q, state.velocity, *limits, low, high)
        step: Array = np.clip(brake(state.velocity, world.acceleration, world.dt), low, high)
        return step

    def _certified(self, state: ToolState, step: Array, task: Task) -> ToolState | None:
        """The state after ``step``, if the certificate, the task and every fixture take it."""
        after = self._certifier.certify(state, step)
        return after if after is not None and self._accepted(state, after, task) else None

    def _accepted(self, state: ToolState, after: ToolState, task: Task) -> bool:
        """Whether the task and every standing fixture take a certified state."""
        if task.accepts is not None and not task.accepts(after):
            return False
        return not self.fixtures or all(fixture.keeps(state, after) for fixture in self.fixtures)

    def _held(self, state: ToolState, why: tuple[Blocker, ...], rows: int, limits: Sequence[Constraint]) -> StepReport:
        rushed = self._rushed(state, np.zeros(len(state.q)), limits)
        return StepReport(self._stopped(state), "held", 0.0, why or self._explainer.nearest(state), rows, rushed)

    def _stopped(self, state: ToolState) -> ToolState:
        """The same pose at rest."""
        return self._certifier.measure(state.q) if state.velocity.any() else state

    def _rushed(self, state: ToolState, step: Array, limits: Sequence[Constraint] = ()) -> bool:
        """Whether a step from a state exceeds an acceleration: a joint's, or one that a fixture limits."""
        world = self._world
        last, change = state.velocity * world.dt, world.acceleration * world.dt**2
        if (np.abs(step - last) > change + _ROUNDING * (change + np.abs(last))).any():
            return True
        return any(
            (c.matrix[:, :-1] @ step > c.bound + _ROUNDING * np.abs(c.bound).max()).any()
            for c in limits
            if c.kind == "acceleration"
        )
