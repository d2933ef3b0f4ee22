"""What each task asks of a step: compiled requests against the same formulas in plain NumPy (Li 2007, section IV)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlContext, ControlSettings, HandCommand, StepRequest, StepState, Task
from vfix_engine.control.tasks import ApproachPath, ApproachTarget, FollowPath, InspectTarget, MoveFreely, PathPoint
from vfix_engine.errors import ControlError, InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.virtual_fixtures.motion import point_jacobian
from vfix_engine.virtual_fixtures.polyhedra import BALL_DIRECTIONS, ball_inner
from vfix_engine.virtual_fixtures.stopping import approach_bounds, stoppable_step

Array = np.ndarray

SETTINGS = ControlSettings(k_tau=0.1, target_tolerance_mm=0.2)
PATH = SplinePath([[0.0, 0, 0], [0, 5, 0.3], [1, 10, 0], [2, 20, 1]])
GOAL = np.array([1.0, 14.0, 5.0])


@pytest.fixture(scope="module")
def context() -> ControlContext:
    scene = straight_scene(wall(60.0))
    return ControlContext(scene.placed_robot(), scene.tool, scene.tree, SETTINGS)


def states(context: ControlContext, count: int = 200) -> list[tuple[StepState, HandCommand]]:
    """Poses with speeds, and hands of all strengths; some reach no further than a little."""
    random = np.random.default_rng(5)
    box = np.where(context.robot.robot.revolute, 0.1, 2.0)
    found = []
    for i in range(count):
        speed = 10.0 ** random.uniform(-6, 0.5) * random.normal(size=len(box)) * (i % 4 > 0)
        state = context.measure(box * random.uniform(-1, 1, len(box)), speed)
        strength = 0.0 if i % 9 == 0 else 10.0 ** random.uniform(-6, 0.7)
        reach = float(10.0 ** random.uniform(-4, 0)) if i % 5 == 0 else np.inf
        hand = HandCommand(strength * random.normal(size=3), 60.0 * strength * random.normal(size=3), reach)
        found.append((state, hand))
    return found


def stoppable(remaining: float, change: float) -> float:
    dt = SETTINGS.dt_s
    return stoppable_step(remaining, change * dt) / dt if remaining < np.inf else np.inf


def cut(vector: Array, cap: float) -> Array:
    size = np.linalg.norm(vector)
    return vector if size <= cap else vector * (cap / size)


def slewed(now: Array, wanted: Array, change: float) -> tuple[Array, float]:
    after = now + cut(wanted - now, change)
    whole = np.linalg.norm(wanted - now)
    return after, min(change / whole, 1.0) if whole > 0.0 else 1.0


def sight_turn(state: StepState) -> float:
    ends = np.concatenate([state.segments.start, state.segments.end]) - state.tip.position
    return SETTINGS.sight_speed_mm_per_s / max(np.linalg.norm(ends, axis=1).max(), 1.0)


def check(
    request: StepRequest,
    jacobian: Array,
    desired: Array,
    wish: Array,
    ramp: float,
    reward: float,
    worth: float,
    lever: float = 1.0,
) -> None:
    """Rows and figures of a motion ``desired`` with a progress variable; ``worth``: compliance with a whole ramp."""
    objective, n = request.objectives[0], jacobian.shape[1]
    size, weight = np.linalg.norm(desired), reward * np.linalg.norm(desired)
    np.testing.assert_allclose(objective.matrix[:4, :n], np.vstack([jacobian, np.zeros(n)]), atol=1e-12)
    np.testing.assert_allclose(objective.matrix[:4, n], np.append(-desired, weight), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(objective.target[:4], [0, 0, 0, weight], rtol=1e-9, atol=1e-15)
    moves = size > lever * 1e-9
    assert request.scale == pytest.approx(size if moves else request.scale, rel=1e-9)
    if request.motion_gain is not None:
        np.testing.assert_allclose(request.motion_gain, desired @ jacobian / size**2, rtol=1e-8)
    assert (request.motion_gain is None) != moves
    assert request.compliance == pytest.approx(worth * ramp * reward**2 / (1 + reward**2), rel=1e-9)
    whole = np.linalg.norm(wish)
    assert request.ramp_fraction == pytest.approx(min(size / whole, 1.0) if whole > 0 else 1.0, rel=1e-7)


def test_following_a_path(context: ControlContext) -> None:
    """Eq. 9-12: the law of admittance, its limits, and no step that leaves the path at its ends."""
    dt, change, gain = SETTINGS.dt_s, SETTINGS.acceleration_mm_per_s2 * SETTINGS.dt_s, SETTINGS.gain_mm_per_s_per_n
    for state, hand in states(context):
        s, place, t = PATH.closest(state.tip.position)
        force, offset = hand.force, place - state.tip.position
        motion_gain, across = t * (t @ force), offset - t * (t @ offset)
        preferred = (1 - SETTINGS.k_d) * motion_gain
        preferred = preferred + SETTINGS.k_d * np.linalg.norm(force) * cut(across / SETTINGS.capture_mm, 1.0)
        wanted = SETTINGS.k_tau * gain * (force - motion_gain)
        if np.linalg.norm(preferred) > 0.0:
            direction = preferred / np.linalg.norm(preferred)
            share = direction @ force
            wanted = gain * max(share, 0.0) * direction + gain * SETTINGS.k_tau * (force - share * direction)
        wanted = cut(wanted, min(SETTINGS.sight_speed_mm_per_s, stoppable(hand.reach, change)))
        jacobian = state.tip.jacobian[:3]
        velocity, ramp = slewed(jacobian @ state.velocity, wanted, change)
        kept = np.clip(velocity @ t, -stoppable(s, change), stoppable(PATH.length - s, change))
        desired = (velocity + t * (kept - velocity @ t)) * dt
        request = FollowPath(PATH).request(state, hand)
        check(request, jacobian, desired, wanted * dt, ramp, 0.1, gain * dt)
        near = FollowPath(PATH, PathPoint(s, place, t)).request(state, hand)
        np.testing.assert_array_equal(near.objectives[0].matrix, request.objectives[0].matrix)


@pytest.mark.parametrize("of_view", [False, True])
def test_approaching_a_path_and_a_target(context: ControlContext, of_view: bool) -> None:
    """The tip, or the virtual point ahead of it, goes straight to its goal, as fast as the hand pushes."""
    dt, change, gain = SETTINGS.dt_s, SETTINGS.acceleration_mm_per_s2 * SETTINGS.dt_s, SETTINGS.gain_mm_per_s_per_n
    task: Task = ApproachTarget(GOAL) if of_view else ApproachPath(PATH)
    for state, hand in states(context):
        tip, tool = state.tip, context.tool
        view = tip.position + SETTINGS.view_distance_mm * tool.direction(tip.rotation)
        point = view if of_view else tip.position
        goal = GOAL if of_view else PATH.closest(tip.position)[1]
        jacobian, towards = point_jacobian(tip, point), goal - point
        distance = np.linalg.norm(towards)
        fastest = min(SETTINGS.sight_speed_mm_per_s, stoppable(min(distance, hand.reach), change))
        wanted = towards * min(gain * np.linalg.norm(hand.force), fastest) / distance
        velocity, ramp = slewed(jacobian @ state.velocity, wanted, change)
        check(task.request(state, hand), jacobian, velocity * dt, wanted * dt, ramp, 0.3 if of_view else 0.1, gain * dt)


def test_inspecting_a_target(context: ControlContext) -> None:
    """Eq. 22-24: the turn with a progress variable, the wish for the centre, and the planes of the ball."""
    dt, change, lever = SETTINGS.dt_s, SETTINGS.turn_acceleration_rad_per_s2 * SETTINGS.dt_s, SETTINGS.view_distance_mm
    for state, hand in states(context):
        tip, gain = state.tip, SETTINGS.rotation_gain_rad_per_s_per_nmm
        wanted = cut(gain * hand.torque, min(sight_turn(state), stoppable(hand.reach, change)))
        spin, ramp = slewed(tip.jacobian[3:] @ state.velocity, wanted, change)
        request = InspectTarget(GOAL).request(state, hand)
        check(
            request,
            lever * tip.jacobian[3:],
            lever * spin * dt,
            lever * wanted * dt,
            ramp,
            0.3,
            lever**2 * gain * dt,
            lever,
        )
        view = tip.position + lever * context.tool.direction(tip.rotation)
        jacobian, objective, (ball,) = point_jacobian(tip, view), request.objectives[0], request.constraints
        np.testing.assert_allclose(objective.matrix[4:], np.hstack([jacobian, np.zeros((3, 1))]), atol=1e-12)
        np.testing.assert_allclose(objective.target[4:], GOAL - view, atol=1e-12)
        room = SETTINGS.target_tolerance_mm * ball_inner() - BALL_DIRECTIONS @ (view - GOAL)
        np.testing.assert_allclose(ball.matrix[:, :-1], BALL_DIRECTIONS @ jacobian, atol=1e-11)
        deceleration = SETTINGS.approach_deceleration_mm_per_s2 * dt * dt
        np.testing.assert_allclose(ball.bound, approach_bounds(room, deceleration), rtol=1e-9, atol=1e-12)
        assert not ball.matrix[:, -1].any()


def test_an_inspection_admits_no_view_that_gets_worse_outside_the_ball(context: ControlContext) -> None:
    pairs = [state for state, _ in states(context, 40)]
    verdicts = []
    for before, after in pairwise(pairs):
        views = [s.tip.position + 15.0 * context.tool.direction(s.tip.rotation) for s in (before, after)]
        for near in views:  # the view gets worse on the way from the goal's neighbourhood, and better on the way there
            goal = near + 0.25 * before.tip.rotation[:, 0]
            one, two = (float(np.linalg.norm(view - goal)) for view in views)
            verdict = InspectTarget(goal).request(before, HandCommand()).is_admissible
            assert verdict is not None
            assert verdict(after) == (two <= max(0.2, one))
            verdicts.append(verdict(after))
        at_goal = InspectTarget(views[1] + [0.0, 0.19, 0.0]).request(before, HandCommand()).is_admissible
        assert at_goal is not None
        assert at_goal(after)
    assert verdicts.count(True) >= 10
    assert verdicts.count(False) >= 10


def test_moving_freely(context: ControlContext) -> None:
    """Eq. 4: six rows, one share of the change for displacement and turn."""
    dt, lever = SETTINGS.dt_s, SETTINGS.view_distance_mm
    speed, turn = SETTINGS.acceleration_mm_per_s2 * dt, SETTINGS.turn_acceleration_rad_per_s2 * dt
    size = np.repeat([1.0 / speed, 1.0 / turn], 3)
    scale = np.repeat([1.0, lever], 3)
    for state, hand in states(context):
        push = SETTINGS.gain_mm_per_s_per_n * hand.force
        push = cut(push, min(SETTINGS.sight_speed_mm_per_s, stoppable(hand.reach, speed)))
        wanted = np.append(push, cut(SETTINGS.rotation_gain_rad_per_s_per_nmm * hand.torque, sight_turn(state)))
        after, ramp = slewed(size * (state.tip.jacobian @ state.velocity), size * wanted, 1.0)
        desired = scale * after / size * dt
        request = MoveFreely().request(state, hand)
        (objective,) = request.objectives
        jacobian = scale[:, None] * state.tip.jacobian
        np.testing.assert_allclose(objective.matrix, np.hstack([jacobian, np.zeros((6, 1))]), atol=1e-12)
        np.testing.assert_allclose(objective.target, desired, rtol=1e-8, atol=1e-15)
        length = np.linalg.norm(desired)
        if length > 1e-9:
            assert request.motion_gain is not None
            assert request.scale == pytest.approx(length, rel=1e-9)
            np.testing.assert_allclose(request.motion_gain, desired @ jacobian / length**2, rtol=1e-8)
        assert request.compliance == pytest.approx(SETTINGS.gain_mm_per_s_per_n * dt * ramp, rel=1e-9)
        whole = np.linalg.norm(size * wanted)
        assert request.ramp_fraction == pytest.approx(min(np.linalg.norm(after) / whole, 1.0) if whole else 1.0)


def test_rest_is_told_from_a_turn_of_mind(context: ControlContext) -> None:
    """No hand and no speed want nothing; a wish to stand still on the way to the hand's is no rest."""
    still = context.measure(np.zeros(7))
    for task in (MoveFreely(), FollowPath(PATH), ApproachPath(PATH), ApproachTarget(GOAL), InspectTarget(GOAL)):
        request = task.request(still, HandCommand())
        assert (request.scale, request.motion_gain) == (0.0, None)
    velocity = np.linalg.pinv(still.tip.jacobian) @ np.array([-SETTINGS.acceleration_mm_per_s2 * 1e-3, 0, 0, 0, 0, 0])
    turning = MoveFreely().request(context.measure(still.q, velocity), HandCommand(np.array([0.1, 0.0, 0.0])))
    assert turning.scale is not None
    assert 0.0 < turning.scale <= 1e-6


def test_rows_hold_the_virtual_point_inside_its_ball(context: ControlContext) -> None:
    """HAZ-07: from 0.2 µm inside a corner of the planes, steps so short that everything can stop at once."""
    state = context.measure(np.zeros(7))
    view = state.tip.position + 15.0 * context.tool.direction(state.tip.rotation)
    jacobian = point_jacobian(state.tip, view)
    facets = ConvexHull(BALL_DIRECTIONS).equations
    corners = facets[facets[:, 3] >= facets[:, 3].max() - 1e-9, :3]  # those that lie on the ball
    length = SETTINGS.approach_deceleration_mm_per_s2 * SETTINGS.dt_s**2
    random, counts = np.random.default_rng(3), {(a, b): 0 for a in (True, False) for b in (True, False)}
    for corner in corners:
        goal = view - 0.1998 * corner
        (ball,) = InspectTarget(goal).request(state, HandCommand()).constraints
        for move in random.normal(size=(20, 3)):
            dq = np.linalg.lstsq(jacobian, length * move / np.linalg.norm(move), rcond=None)[0]
            after = context.measure(dq).tip
            reached = after.position + 15.0 * context.tool.direction(after.rotation)
            # 1e-9 mm: what the rows, which are linear, leave out of so short a step
            inside = bool(np.linalg.norm(reached - goal) <= 0.2 + 1e-9)
            counts[bool((ball.matrix[:, :-1] @ dq <= ball.bound).all()), inside] += 1
    assert counts[True, False] == 0
    assert min(counts[True, True], counts[False, False]) > 50


def test_the_virtual_points_jacobian_against_central_differences(context: ControlContext) -> None:
    random = np.random.default_rng(2)
    for _ in range(50):
        q = np.where(context.robot.robot.revolute, 0.3, 5.0) * random.uniform(-1, 1, 7)
        rows = ApproachTarget(GOAL).request(context.measure(q), HandCommand(np.ones(3))).objectives[0].matrix
        for i in range(7):
            d = np.zeros(7)
            d[i] = 1e-5
            (r1, p1), (r0, p0) = context.robot.tip_pose(q + d), context.robot.tip_pose(q - d)
            numeric = (p1 + 15.0 * context.tool.direction(r1) - p0 - 15.0 * context.tool.direction(r0)) / 2e-5
            np.testing.assert_allclose(rows[:3, i], numeric, atol=1e-5)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"force": np.zeros(2)}, "three finite numbers in N"),
        ({"torque": [0.0, np.nan, 0.0]}, r"the torque .* three finite numbers in N·mm"),
        ({"force": "hard"}, "no array of real numbers"),
        ({"force": [[1.0, 2.0, 3.0]]}, "three finite numbers"),
        ({"reach": -1.0}, "the reach is -1.0"),
        ({"reach": np.nan}, "the reach is nan"),
        ({"reach": "far"}, "the reach is 'far'"),
    ],
)
def test_a_hand_is_checked_where_it_is_made(given: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        HandCommand(**given)  # type: ignore[arg-type]


def test_lists_and_whole_numbers_make_a_hand(context: ControlContext) -> None:
    state, task = context.measure(np.zeros(7)), MoveFreely()
    one = task.request(state, HandCommand([1, 2, 3], (0, 0, 4), 2))  # type: ignore[arg-type]
    two = task.request(state, HandCommand(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 4.0]), 2.0))
    np.testing.assert_array_equal(one.objectives[0].target, two.objectives[0].target)


@pytest.mark.parametrize("task", [MoveFreely(), FollowPath(PATH), ApproachPath(PATH), ApproachTarget(GOAL)])
def test_tasks_say_what_they_are_driven_by(context: ControlContext, task: Task) -> None:
    with pytest.raises(InputError, match=f"{type(task).__name__} is driven by a HandCommand"):
        task.request(context.measure(np.zeros(7)), None)
    unmeasured = context.measure(np.zeros(7))
    by_hand = StepState(unmeasured.q, unmeasured.velocity, unmeasured.tip, unmeasured.segments, unmeasured.distance)
    with pytest.raises(ControlError, match="was not measured"):
        task.request(by_hand, HandCommand())
