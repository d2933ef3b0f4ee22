"""``build_step``, ``solve_step``, ``certify_step``: the controller's own step, open to a user's tasks and fixtures."""

from __future__ import annotations

import gc
from copy import copy, deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from tests.engine.control.test_whole_step import SETTINGS, controller_of, drive, narrow_tube, random_task
from tests.engine.scenes import straight_scene, wall
from vfix_engine import errors, tasks, zones
from vfix_engine.control import (
    Certified,
    ControlContext,
    Controller,
    HandCommand,
    Refused,
    StepRequest,
    StepState,
    build_step,
    certify_step,
    solve_step,
)
from vfix_engine.control.relaxations import RELAXATIONS, take_step
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.virtual_fixtures import Constraint, Objective, Rows, Situation, ToolState
from vfix_engine.worlds.rigid.scene import Scene

PUSH = HandCommand(force=np.array([0.0, 5.0, 0.0]), torque=np.zeros(3))
FREE = tasks.MoveFreely()


@pytest.fixture(scope="module")
def tube() -> Scene:
    return narrow_tube()


@pytest.fixture
def control() -> Controller:
    return controller_of(straight_scene(wall(90.0)))


def far(control: Controller) -> StepState:
    return control.start(np.zeros(7))


def driven(control: Controller, task: Any, command: HandCommand, steps: int, fixtures: Any = ()) -> StepState:
    """The state after so many steps of the three functions; every one of them has to be certified."""
    state = far(control)
    for _ in range(steps):
        problem = build_step(state, task, fixtures, command, SETTINGS.dt_s)
        verdict = certify_step(problem, solve_step(problem).dq)
        assert isinstance(verdict, Certified)
        state = verdict.next_state
    return state


def test_the_three_functions_are_the_controllers_step(tube: Scene) -> None:
    """Bit by bit where a step is made as it is."""
    moved = 0
    for state, task, report in drive(controller_of(tube), np.random.default_rng(3), 200):
        if report.outcome != "moved" or report.emergency:
            continue
        problem = build_step(state, task)
        verdict = certify_step(problem, solve_step(problem).dq)
        assert isinstance(verdict, Certified)
        np.testing.assert_array_equal(verdict.next_state.q, report.state.q)
        np.testing.assert_array_equal(verdict.next_state.distance, report.state.distance)
        moved += 1
    assert moved > 100


def same_report(control: Controller, state: StepState, task: Any) -> str:
    """Both ways of a step, compared bit by bit; its outcome."""
    told = []
    for fused in (True, False):
        report = take_step(build_step(state, task, control.fixtures), control.solver, fused)
        words = tuple((b.text, b.weight) for b in report.active_constraints())
        told.append((report, words))
    (one, words), (two, again) = told
    assert (one.outcome, one.share, one.rows, one.emergency) == (two.outcome, two.share, two.rows, two.emergency)
    assert words == again
    for name in ("q", "velocity", "distance", "pairs", "box"):
        np.testing.assert_array_equal(getattr(one.state, name), getattr(two.state, name), err_msg=name)
    return one.outcome


def test_the_fused_kernel_and_the_single_calls_give_the_same_step_bit_by_bit(tube: Scene) -> None:
    """Moved, cut short, held, braked and relaxed steps, in the open, between walls and inside a margin."""
    control = controller_of(tube)
    outcomes = [same_report(control, state, task) for state, task, _ in drive(control, np.random.default_rng(5), 200)]
    random = np.random.default_rng(6)
    near = controller_of(straight_scene(wall(1.4)))
    inside = near.measure(np.zeros(7))
    closer = controller_of(straight_scene(wall(1.15)))
    for _ in range(20):
        task = random_task(inside, random)
        outcomes.append(same_report(closer, closer.measure(inside.q, 0.01 * random.normal(size=7)), task))
        outcomes.append(same_report(near, near.measure(inside.q, random.normal(size=7)), task))
        never = Constraint("never", np.eye(8)[:1], -np.ones(1), np.arange(1), ("never",))
        always = Constraint("always", -np.eye(8)[:1], -np.ones(1), np.arange(1), ("always",))
        stuck = StepRequest(task.objectives, (never, always), task.scale, task.motion_gain)
        outcomes.append(same_report(near, inside, stuck))
        no = StepRequest(task.objectives, (), task.scale, task.motion_gain, lambda _: False)
        outcomes.append(same_report(near, inside, no))
    assert {"moved", "held"} <= set(outcomes)


def test_what_the_fused_kernel_has_solved_is_not_solved_again(tube: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A refused motion goes on with the answer that there is."""
    control = controller_of(tube)
    state = far(control)
    task = random_task(state, np.random.default_rng(2))
    request = StepRequest(task.objectives, (), task.scale, task.motion_gain, lambda _: False)
    monkeypatch.setattr("vfix_engine.control.qp.solve_dual", None)
    monkeypatch.setattr("vfix_engine.control.qp.daqp", None)
    assert control.step(state, request).held


def test_relaxations_name_their_base() -> None:
    known: set[str | None] = {None}
    for relaxation in RELAXATIONS:
        assert relaxation.base in known
        known.add(relaxation.name)
    assert [r.name for r in RELAXATIONS] == ["as_is", "relax_retreat", "drop_acceleration", "allow_hold"]


def test_anatomy_zones_and_joints_are_fixtures_with_the_rows_of_the_problem() -> None:
    """What the reader sees as fixtures is what the kernels write."""
    zone = zones.Zone("nerve", Sphere([0.0, 5.0, 0.0], 1.0), 0.8)
    control = controller_of(straight_scene(wall(5.0)), zones=(zone,))
    state = driven(control, FREE, PUSH, 60)
    problem = build_step(state, FREE, (), PUSH)
    context: ControlContext = control.context
    assert [getattr(f, "structure", "joints") for f in context.fixtures] == ["bone", "nerve", "joints"]
    now = Situation(state, state.named_pairs(), state.body, context.robot.robot, context.tool, SETTINGS.dt_s, 1.0, 1.0)
    program, body = problem.program, state.body
    for fixture in context.fixtures[:-1]:
        (constraint,) = fixture.rows(now).constraints
        own = np.flatnonzero(body == fixture.body)  # type: ignore[attr-defined]
        np.testing.assert_allclose(program.rows[own], constraint.matrix, atol=1e-13)
        np.testing.assert_allclose(program.bound[own] * program.scale, constraint.bound, atol=1e-15)
    limits = context.fixtures[-1].rows(now).constraints
    assert [limit.unit for limit in limits] == ["mm", "rad"]
    for limit in limits:
        low, high = -state.box[0][limit.index], state.box[1][limit.index]
        half = len(limit.index) // 2
        np.testing.assert_allclose(np.append(low[:half], high[half:]), limit.bound, atol=1e-15)
    assert len(body) > 0
    names = [row.name for row in problem.rows]
    assert names[0].startswith(("bone, ", "nerve, "))
    assert "insertion, upper side" in names
    assert {row.unit for row in problem.rows} == {"mm", "rad"}
    assert len(names) == problem.row_count


@dataclass(frozen=True)
class Climb:
    """A user's own task: the tip rises at a speed in mm/s."""

    speed: float

    def request(self, state: StepState, command: Any) -> StepRequest:
        matrix = np.append(state.tip.jacobian[2], 0.0)[None, :]
        return StepRequest((Objective(matrix, np.array([self.speed * SETTINGS.dt_s])),))


def test_a_users_task_needs_objectives_alone_and_is_certified(control: Controller) -> None:
    state = driven(control, Climb(3.0), PUSH, 100)
    assert state.tip.position[2] == pytest.approx(3.0 * 100 * SETTINGS.dt_s, rel=1e-2)
    low = controller_of(straight_scene(wall(90.0)), fixtures=(Lid(0.2),))
    report = low.step(far(low), Climb(3.0))
    for _ in range(200):
        report = low.step(report.state, Climb(3.0))
    assert report.held  # the share of its motion is derived from its rows
    assert [b.text for b in report.blockers] == ["the lid"]
    assert report.state.tip.position[2] == pytest.approx(0.2, abs=1e-3)


class Lid:
    """A user's own fixture."""

    def __init__(self, height: float):
        self.height = height

    def rows(self, now: Situation) -> Rows:
        matrix = np.append(now.state.tip.jacobian[2], 0.0)[None, :]
        bound = now.stop_before(self.height - now.state.tip.position[2])
        return Rows((), (Constraint("lid", matrix, bound, np.arange(1), ("the lid",)),))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        return bool(after.tip.position[2] <= max(self.height, before.tip.position[2]) + 1e-9)


def test_a_users_fixture_is_asked_for_its_verdict(control: Controller) -> None:
    lid = Lid(0.05)
    state = driven(control, Climb(3.0), PUSH, 200, (lid,))
    assert state.tip.position[2] <= 0.05 + 1e-9
    problem = build_step(state, Climb(3.0), (lid,))
    lift = np.linalg.pinv(state.tip.jacobian[2:3])[:, 0] * 0.1
    refused = certify_step(problem, lift)
    assert isinstance(refused, Refused)
    assert refused.by is lid
    into = certify_step(build_step(state, FREE, (), PUSH), np.array([0, 200.0, 0, 0, 0, 0, 0]))
    assert isinstance(into, Refused)
    assert into.by == "certificate"


@dataclass(frozen=True)
class Nonsense:
    """A user's own task with a mistake: what it asks for is no number."""

    target: float
    scale: float | None = None

    def request(self, state: StepState, command: Any) -> StepRequest:
        rows = np.append(state.tip.jacobian[:1], 0.0)[None, :]
        return StepRequest((Objective(rows, np.array([self.target])),), (), self.scale)


@pytest.mark.parametrize("task", [Nonsense(np.nan), Nonsense(np.inf), Nonsense(np.nan, 1.0)])
def test_a_task_that_asks_for_no_number_is_named(control: Controller, task: Nonsense) -> None:
    """HAZ-03: the tool is held, and the blocker says whose numbers those are."""
    for given in (task, (Climb(3.0), task), Nonsense(0.1, np.nan)):
        report = control.step(far(control), given)
        assert report.held
        assert "Nonsense asks for numbers that are not finite" in report.blockers[0].text


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (np.zeros(6), "7 finite joint values"),
        (np.full(7, np.nan), "7 finite joint values"),
        ("home", "no array of real numbers"),
        (np.array([0.0, 0, 0, 0, 0, 0, 1e4]), "joint 7 .* outside"),
    ],
)
def test_a_context_refuses_what_is_no_start(control: Controller, joints: Any, words: str) -> None:
    with pytest.raises(errors.StartRefused, match=words):
        control.context.start(joints)
    if "joint 7" not in words:
        with pytest.raises(errors.InputError, match=words):
            control.context.measure(joints)
        with pytest.raises(errors.InputError):
            control.certify(far(control), joints if len(joints) != 7 else np.zeros((7, 1)))


def test_a_context_refuses_a_start_in_a_margin() -> None:
    """HAZ-04: bone and zones, each by name."""
    near = controller_of(straight_scene(wall(1.15))).context
    with pytest.raises(errors.StartRefused, match="mm from bone, less than the margin"):
        near.start(np.zeros(7))
    zone = zones.Zone("nerve", Sphere([0.0, 2.0, 0.0], 1.0), 0.8)
    among = controller_of(straight_scene(wall(90.0)), zones=(zone,)).context
    with pytest.raises(errors.StartRefused, match="nerve"):
        among.start(np.zeros(7))
    assert (controller_of(straight_scene(wall(90.0))).context.start([0.0] * 7).q == 0.0).all()


@pytest.mark.parametrize("rows", [np.zeros(8), np.zeros((2, 8)), [[0.0] * 8] * 2, np.zeros((1, 9))])
def test_rows_of_wrong_shapes_are_refused(control: Controller, rows: Any) -> None:
    fine = Objective(np.ones((1, 8)), np.ones(1))
    with pytest.raises(errors.InputError, match="an objective has a matrix"):
        solve_step(build_step(far(control), StepRequest((fine, Objective(rows, np.ones(1))))))


def test_rows_may_be_lists(control: Controller) -> None:
    """What is given as lists asks for the same step as arrays do."""
    state = far(control)
    rows = np.append(state.tip.jacobian[:1], [[0.0]], axis=1)
    arrays = control.step(state, StepRequest((Objective(rows, np.array([0.01])),)))
    lists: Any = Objective(rows.tolist(), [0.01])
    np.testing.assert_array_equal(control.step(state, StepRequest((lists,))).state.q, arrays.state.q)
    assert arrays.outcome == "moved"


class NoVerdict:
    def rows(self, now: Situation) -> Rows:
        return Rows()


def test_a_fixture_without_a_verdict_is_refused(control: Controller) -> None:
    problem = build_step(far(control), FREE, (NoVerdict(),), PUSH)  # type: ignore[arg-type]
    with pytest.raises(errors.InputError, match="NoVerdict has no is_admissible"):
        certify_step(problem, np.zeros(7))


class OldNames(NoVerdict):
    def keeps(self, before: ToolState, after: ToolState) -> bool:
        return bool(after.q[0] <= before.q[0])


def test_a_fixture_with_the_names_of_earlier_versions_refuses(control: Controller) -> None:
    """``ToolState`` and ``keeps`` stay, for programs that were written with them, which are told the new name."""
    problem = build_step(far(control), FREE, (OldNames(),), PUSH)  # type: ignore[arg-type]
    step = np.eye(7)[0] * 1e-6
    with pytest.warns(DeprecationWarning, match="OldNames.keeps is is_admissible now"):
        assert not isinstance(certify_step(problem, -step), Refused)
    with pytest.warns(DeprecationWarning, match="is_admissible now"):
        assert isinstance(certify_step(problem, step), Refused)


def test_stop_before_comes_to_rest_where_the_slack_ends(control: Controller) -> None:
    """A row with the slack itself as its bound would have to stop at once."""
    state, speeds = far(control), []
    for _ in range(400):
        report = control.step(state, Climb(20.0))
        problem = build_step(state, Climb(20.0), (Lid(1.0),))
        verdict = certify_step(problem, solve_step(problem).dq)
        assert isinstance(verdict, Certified)
        state = verdict.next_state
        speeds.append(float(state.tip.jacobian[2] @ state.velocity))
    assert report.outcome == "moved"
    assert state.tip.position[2] == pytest.approx(1.0, abs=1e-6)
    assert max(speeds) > 10.0
    assert -np.diff(speeds).min() <= 1.02 * 300.0 * SETTINGS.dt_s


def test_equality_rows_hold_exactly(control: Controller) -> None:
    """The tip's x moves by 0.01 mm a step, whatever the hand wants."""

    @dataclass(frozen=True)
    class Sideways:
        def request(self, state: StepState, command: HandCommand) -> StepRequest:
            asked = FREE.request(state, command)
            matrix = np.append(state.tip.jacobian[0], 0.0)[None, :]
            drift = Constraint("drift", matrix, np.array([0.01]), np.arange(1), ("the drift",), equality=True)
            return StepRequest(asked.objectives, (drift,), asked.scale, asked.motion_gain)

    state = driven(control, Sideways(), PUSH, 50)
    assert state.tip.position[0] == pytest.approx(0.5, abs=1e-4)
    assert state.tip.position[1] > 0.1


def test_weights_count_one_task_against_another(control: Controller) -> None:
    up, down = Climb(1.0), Climb(-1.0)
    state = driven(control, tasks.WeightedTasks([(up, 3.0), (down, 1.0)]), PUSH, 50)
    assert state.tip.position[2] == pytest.approx(0.5 * 50 * SETTINGS.dt_s, rel=2e-2)
    both = driven(control, [up, Climb(3.0)], PUSH, 50)
    assert both.tip.position[2] == pytest.approx(2.0 * 50 * SETTINGS.dt_s, rel=2e-2)
    with pytest.raises(errors.InputError, match="finite number above 0"):
        tasks.WeightedTasks([(up, 0.0)])
    with pytest.raises(errors.InputError, match="at least one task"):
        tasks.WeightedTasks([])


def test_posture_and_damping_shape_what_a_task_leaves_free(control: Controller) -> None:
    posture = np.array([0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.1])
    free, drawn = (
        driven(control, task, PUSH, 200)
        for task in (Climb(1.0), [Climb(1.0), tasks.PostureTask(posture, weight=10.0, time_s=0.1)])
    )
    assert abs(drawn.q[6] - 0.1) < 0.02 < abs(free.q[6] - 0.1)
    assert drawn.tip.position[2] == pytest.approx(free.tip.position[2], rel=0.05)
    state = far(control)
    assert control.step(state, tasks.PostureTask(posture)).outcome == "idle"  # no hand, no motion
    assert control.step(state, tasks.PostureTask(posture, drives=True)).outcome == "moved"
    damped = driven(control, [Climb(1.0), tasks.DampingTask(weight=1e6)], PUSH, 20)
    assert 0.0 < damped.tip.position[2] < 0.5 * 20 * SETTINGS.dt_s
    with pytest.raises(errors.InputError, match="7 finite joint values"):
        control.step(state, tasks.PostureTask(np.zeros(3)))


def test_a_problem_is_read_before_the_next_one_is_built(control: Controller) -> None:
    state = far(control)
    old = build_step(state, FREE, (), PUSH)
    kept = solve_step(old)
    build_step(state, FREE, (), PUSH)
    with pytest.raises(errors.ControlError, match="another problem was built since"):
        solve_step(old)
    assert isinstance(certify_step(build_step(state, FREE, (), PUSH), kept.dq), Certified)  # a solution is its own


def test_what_makes_no_sense_is_told(control: Controller) -> None:
    state = far(control)
    short = StepRequest((Objective(np.zeros((1, 3)), np.zeros(1)),), (), 1.0)
    with pytest.raises(errors.InputError, match=r"an objective has a matrix \(1, 3\)"):
        solve_step(build_step(state, short))
    odd = Constraint("odd", np.zeros((2, 8)), np.zeros(1), np.arange(1))
    with pytest.raises(errors.InputError, match="the constraint 'odd'"):
        control.step(state, StepRequest((Objective(np.zeros((1, 8)), np.ones(1)),), (odd,), 1.0))
    with pytest.raises(errors.InputError, match="at least one task"):
        build_step(state, [])
    with pytest.raises(errors.InputError, match="measured for steps of"):
        build_step(state, FREE, (), PUSH, dt=1e-2)
    loose = StepState(state.q, state.velocity, state.tip, state.segments, state.distance)
    with pytest.raises(errors.ControlError, match="not measured"):
        build_step(loose, FREE, (), PUSH)
    with pytest.raises(errors.InputError, match="one number a joint"):
        certify_step(build_step(state, FREE, (), PUSH), np.zeros(3))
    never = Constraint("never", np.vstack([np.eye(8)[:1], -np.eye(8)[:1]]), -np.ones(2), np.arange(2))
    asked = FREE.request(state, PUSH)
    unsolved = solve_step(build_step(state, StepRequest(asked.objectives, (never,), asked.scale)))
    assert not unsolved.found
    with pytest.raises(errors.ControlError, match="no point fulfils"):
        _ = unsolved.dq


def test_a_copied_controller_outlives_the_one_it_was_made_from(tube: Scene) -> None:
    """Compiled code is handed addresses; a copy has its own, or keeps what it shares."""
    for make in (copy, deepcopy):
        original = controller_of(tube)
        state = far(original)
        task = random_task(state, np.random.default_rng(4))
        wanted = original.step(state, task).state.q
        other = Controller.__new__(Controller)
        other.__dict__.update(original.__dict__)
        other.context = make(original.context)
        del original
        gc.collect()
        filler = [np.full(2048 * 10, np.nan) for _ in range(20)]  # what was freed is overwritten
        np.testing.assert_array_equal(other.step(state, task).state.q, wanted)
        assert len(filler) == 20


def test_without_a_hand_the_problem_is_to_come_to_rest(control: Controller) -> None:
    moving = driven(control, FREE, PUSH, 50)
    assert build_step(moving, Climb(0.0)).rests
    for _ in range(200):
        problem = build_step(moving, Climb(0.0))
        verdict = certify_step(problem, solve_step(problem).dq)
        assert isinstance(verdict, Certified)
        moving = verdict.next_state
    assert not moving.velocity.any()
