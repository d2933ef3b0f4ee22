"""Remote centre, orientation cone and Cartesian limits, each by itself (HAZ-06, HAZ-07)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.fixture_states import (
    PLACED,
    ROBOT,
    TOOL,
    anywhere,
    differences,
    situation,
    state_at,
)
from vfix_engine.errors import InputError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.robots import TipState
from vfix_engine.virtual_fixtures import (
    CartesianLimits,
    Fixture,
    OrientationCone,
    RemoteCentre,
    Rows,
    StepState,
    weighted,
)
from vfix_engine.virtual_fixtures.polyhedra import DISC_PLANES, across, disc_planes

NOSTRIL = np.array([1.0, -60.0, -7.0])


def step_of(rows: Rows, step: np.ndarray) -> float:
    """By how much a joint step breaks the worst hard row."""
    x = np.append(step, 0.0)
    return max(float((c.matrix @ x - c.bound).max()) for c in rows.constraints)


def moved(state: StepState, step: np.ndarray, dt: float = 1e-3) -> StepState:
    return state_at(state.q + step, step / dt)


# The polygon in a disc


@pytest.mark.parametrize("distance", [0.0, 0.3, 0.97, 0.985, 0.999, 1.0, 3.0])
def test_the_polygon_lies_in_the_disc_and_holds_the_offset(distance: float) -> None:
    random = np.random.default_rng(4)
    for angle in random.uniform(0, 2 * np.pi, 40):
        offset = distance * np.array([np.cos(angle), np.sin(angle)])
        normals, room = disc_planes(offset, 1.0)
        assert normals.shape == (DISC_PLANES, 2)
        assert room.min() >= 0.0
        radius = max(1.0, distance)
        rays = random.normal(size=(400, 2))
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        push = rays @ normals.T
        reach = np.where(push > 1e-12, room / np.where(push > 1e-12, push, 1.0), np.inf).min(axis=1)
        places = offset + reach[:, None] * rays
        assert np.linalg.norm(places, axis=1).max() <= radius * (1 + 1e-12)
    # and it is nearly all of the disc
    normals, room = disc_planes(np.zeros(2), 1.0)
    assert room == pytest.approx(np.full(DISC_PLANES, 0.9798), abs=1e-4)


# Remote centre


def test_remote_centre_jacobian_against_central_differences() -> None:
    random = np.random.default_rng(6)
    fixture = RemoteCentre(NOSTRIL, tolerance_mm=0.5)
    for _ in range(200):
        q = anywhere(random)
        state = state_at(q)
        plane = across(shaft_of(state))
        matrix = fixture.rows(situation(state)).objectives[0].matrix[:, :-1]
        numeric = differences(lambda s, plane=plane: plane @ (nearest(s) - NOSTRIL), q)
        np.testing.assert_allclose(matrix, numeric, atol=2e-4 * max(1.0, np.abs(numeric).max()))
        assert fixture.error(state) == pytest.approx(np.linalg.norm(nearest(state) - NOSTRIL))


def shaft_of(state: StepState) -> np.ndarray:
    along = state.segments.end[-1] - state.segments.start[-1]
    return along / np.linalg.norm(along)


def nearest(state: StepState) -> np.ndarray:
    """The shaft line's point nearest to the nostril, by least squares."""
    start, along = state.segments.start[-1], shaft_of(state)
    s = np.linalg.lstsq(along[:, None], NOSTRIL - start, rcond=None)[0]
    return start + s[0] * along


@pytest.mark.parametrize("off", [0.0, 0.2, 0.49, 0.6, 4.0])
def test_steps_that_keep_the_rows_keep_the_centre(off: float) -> None:
    """Every step inside the rows passes the verdict, and standing still always keeps the rows."""
    random = np.random.default_rng(2)
    tried = 0
    for _ in range(150):
        q = anywhere(random)
        state = state_at(q)
        side = across(shaft_of(state)).T @ _unit(random.normal(size=2))
        place = state.segments.start[-1] + random.uniform(20, 130) * shaft_of(state)
        fixture = RemoteCentre(place + off * side, tolerance_mm=0.5)
        rows = fixture.rows(situation(state))
        assert step_of(rows, np.zeros(7)) <= 0.0
        for _ in range(20):
            step = random.normal(size=7) * ROBOT.speed * 1e-3 * 0.2
            after = moved(state, step)
            if step_of(rows, step) <= 0.0:
                tried += 1
                assert fixture.error(after) <= max(0.5, fixture.error(state)) + 1e-4
                if off < 0.4:
                    assert fixture.is_admissible(state, after)
            elif fixture.error(after) > max(0.5, fixture.error(state)):
                assert not fixture.is_admissible(state, after)
    assert tried > 100


def test_the_way_to_the_centre_is_bounded_in_speed() -> None:
    q = np.zeros(7)
    state = state_at(q)
    far = RemoteCentre(state.segments.start[-1] + 50 * shaft_of(state) + [3.0, 0, 0], return_mm_per_s=5.0)
    wanted = far.rows(situation(state)).objectives[0].target
    assert np.linalg.norm(wanted) == pytest.approx(5e-3)
    soft = RemoteCentre(far.point, tolerance_mm=np.inf).rows(situation(state))
    assert not soft.constraints
    assert RemoteCentre(far.point, tolerance_mm=np.inf).is_admissible(state, moved(state, np.full(7, 0.01)))


def through(state: StepState, into: np.ndarray, off: np.ndarray) -> RemoteCentre:
    """An opening that the tool's bent tip is half way through, moved by ``off`` (3,)."""
    middle = 0.5 * (state.segments.start[0] + state.segments.end[0])
    return RemoteCentre(middle + off, tolerance_mm=0.5, weight=0.0, into=into)


def test_an_opening_holds_the_part_of_the_tool_that_is_in_it() -> None:
    """Half way along the tip it is the tip that is held; before the tip is there nothing is."""
    state = state_at(np.zeros(7))
    along = state.segments.end[0] - state.segments.start[0]
    side = across(along / np.linalg.norm(along))[0]
    centre = through(state, along, 0.3 * side)
    assert centre.holds(state)
    assert centre.error(state) == pytest.approx(0.3)
    assert len(centre.rows(situation(state)).constraints) == 1
    before = through(state, along, 0.6 * along)
    assert not before.holds(state)
    assert before.rows(situation(state)) == Rows()
    on_shaft = 0.5 * (state.segments.start[-1] + state.segments.end[-1])
    shaft = shaft_of(state)
    assert RemoteCentre(on_shaft + 0.2 * across(shaft)[0], into=shaft).error(state) == pytest.approx(0.2)
    assert RemoteCentre(on_shaft, into=across(shaft)[0] - 0.01 * shaft).error(state) == np.inf  # along the plane
    assert RemoteCentre(on_shaft, into=across(shaft)[0]).rows(situation(state)) == Rows()


def test_the_crossing_s_jacobian_against_central_differences() -> None:
    """The rows' motion is that of the place where the axis crosses the plane, not of a point of the tool."""
    random = np.random.default_rng(8)
    tried = 0
    for _ in range(100):
        q = anywhere(random)
        state = state_at(q)
        shaft = shaft_of(state)
        into = shaft + 0.8 * across(shaft)[0]
        fixture = RemoteCentre(state.segments.start[-1] + 40 * shaft + [1.0, 0.5, 0.2], tolerance_mm=5.0, into=into)
        if not fixture.holds(state):
            continue
        tried += 1
        assert fixture.into is not None
        plane = across(fixture.into)
        matrix = fixture.rows(situation(state)).objectives[0].matrix[:, :-1]
        numeric = differences(lambda s, fixture=fixture, plane=plane: plane @ (crossing(s, fixture) - fixture.point), q)
        np.testing.assert_allclose(matrix, numeric, atol=2e-4 * max(1.0, np.abs(numeric).max()))
        assert fixture.error(state) == pytest.approx(np.linalg.norm(crossing(state, fixture) - fixture.point))
    assert tried > 50


def crossing(state: StepState, fixture: RemoteCentre) -> np.ndarray:
    """Where the shaft's line meets the opening's plane, by solving for the arc length."""
    start, along = state.segments.start[-1], shaft_of(state)
    return start + along * ((fixture.point - start) @ fixture.into / (along @ fixture.into))


def test_a_tip_gets_through_an_opening_within_its_tolerance_only_and_out_again_anywhere() -> None:
    state = state_at(np.zeros(7))
    along = state.segments.end[0] - state.segments.start[0]
    into = along / np.linalg.norm(along)
    side = across(into)[0]
    ahead = state.tip.position + 1e-3 * into
    further = moved_tip(state, 2e-3 * into)
    assert RemoteCentre(ahead, 0.5, into=into).is_admissible(state, further)
    beside = RemoteCentre(ahead + 0.6 * side, 0.5, into=into)
    assert not beside.is_admissible(state, further)
    assert beside.is_admissible(further, state)
    inside = through(state, along, 0.6 * side)  # too far out already: no further
    assert inside.is_admissible(state, moved_tip(state, 0.1 * side))
    assert not inside.is_admissible(state, moved_tip(state, -0.1 * side))


def moved_tip(state: StepState, by: np.ndarray) -> StepState:
    """The same pose, moved by (3,) mm."""
    tip = TipState(state.tip.rotation, state.tip.position + by, state.tip.jacobian)
    segments = Segments(state.segments.start + by, state.segments.end + by, state.segments.radius)
    return StepState(state.q, state.velocity, tip, segments, state.distance)


def test_an_opening_has_a_direction() -> None:
    assert RemoteCentre(NOSTRIL, into=np.array([0.0, 2.0, 0.0])).into == pytest.approx([0.0, 1.0, 0.0])
    for into in ([0.0, 0.0, 0.0], [0.0, np.nan, 1.0], [1.0, 0.0]):
        with pytest.raises(InputError, match="direction"):
            RemoteCentre(NOSTRIL, into=np.array(into))


# Orientation cone


@pytest.mark.parametrize("angle", [1e-9, 0.05, 0.4, 1.2, 3.0])
def test_cone_rows_against_central_differences(angle: float) -> None:
    """The map ε is differenced in the plane that the rows are written in."""
    random = np.random.default_rng(11)
    for _ in range(60):
        q = anywhere(random)
        state = state_at(q)
        view = TOOL.direction(state.tip.rotation)
        axis = _turned(view, angle, random)
        plane = across(axis)

        def chart(s: StepState, axis: np.ndarray = axis, plane: np.ndarray = plane) -> np.ndarray:
            d = TOOL.direction(s.tip.rotation)
            lean = d - (axis @ d) * axis
            size = np.linalg.norm(lean)
            theta = np.arctan2(size, axis @ d)
            return plane @ lean * (theta / size if size > 1e-12 else 1.0)

        fixture = OrientationCone.of_view(TOOL, axis, 0.3)
        rows = fixture.rows(situation(state))
        if angle <= 0.3:
            fixed = disc_planes(chart(state), 0.3)[0]
            expected = fixed @ differences(chart, q)
            np.testing.assert_allclose(rows.constraints[0].matrix[:, :-1], expected, atol=1e-5)
            assert not rows.objectives
        else:
            expected = fixture.lever_mm * differences(chart, q)
            scale = np.abs(expected).max()
            np.testing.assert_allclose(rows.objectives[0].matrix[:, :-1], expected, atol=1e-4 * scale)


@pytest.mark.parametrize("angle", [0.0, 0.1, 0.29, 0.31, 1.0])
def test_steps_that_keep_the_cones_rows_keep_the_cone(angle: float) -> None:
    random = np.random.default_rng(3)
    tried = 0
    for _ in range(150):
        state = state_at(anywhere(random))
        shaft = state.tip.rotation[:, 1]
        fixture = OrientationCone.of_shaft(_turned(shaft, angle, random), 0.3)
        assert fixture.angle(state) == pytest.approx(angle, abs=1e-7)
        rows = fixture.rows(situation(state))
        assert step_of(rows, np.zeros(7)) <= 0.0  # never infeasible, outside the cone neither
        for _ in range(20):
            step = random.normal(size=7) * ROBOT.speed * 1e-3 * 0.2
            if step_of(rows, step) <= 0.0:
                tried += 1
                after = moved(state, step)
                assert fixture.angle(after) <= max(0.3, fixture.angle(state)) + 1e-6
                if angle < 0.25:
                    assert fixture.is_admissible(state, after)
    assert tried > 100


def test_a_cone_that_is_left_refuses_to_be_left_further() -> None:
    state = state_at(np.zeros(7))
    fixture = OrientationCone.of_shaft(_turned(state.tip.rotation[:, 1], 0.5, np.random.default_rng(0)), 0.3)
    for joint in (3, 4):
        for sign in (1, -1):
            step = np.zeros(7)
            step[joint] = 1e-3 * sign
            after = moved(state, step)
            assert fixture.is_admissible(state, after) == (fixture.angle(after) <= fixture.angle(state))
    opposite = OrientationCone.of_shaft(-state.tip.rotation[:, 1], 0.3)
    rows = opposite.rows(situation(state))
    assert all(np.isfinite(c.matrix).all() and np.isfinite(c.bound).all() for c in rows.constraints)
    assert np.isfinite(rows.objectives[0].matrix).all()


# Cartesian limits


def test_steps_that_keep_the_rows_keep_the_speeds() -> None:
    """Tip displacement and its change over one step, measured from poses; and the rows give away less than a tenth."""
    random = np.random.default_rng(5)
    dt, fixture = 1e-3, CartesianLimits(8.0, 500.0, 0.1)
    largest = 0.0
    for _ in range(150):
        velocity = random.normal(size=7) * ROBOT.speed * 0.02
        state = state_at(anywhere(random), velocity)
        if max(fixture.speeds(state)[0] / 7.0, fixture.speeds(state)[1] / 0.09) > 1.0:
            continue
        rows = fixture.rows(situation(state, dt))
        assert [c.kind for c in rows.constraints] == ["speed", "acceleration", "turn"]
        assert step_of(rows, velocity * dt) <= 0.0  # going on as before is allowed
        was = state.tip.jacobian[:3] @ velocity
        for _ in range(30):
            step = (velocity + random.normal(size=7) * ROBOT.acceleration * dt * random.uniform(0, 0.5)) * dt
            if step_of(rows, step) > 0.0:
                continue
            after = moved(state, step, dt)
            moving = (after.tip.position - state.tip.position) / dt
            largest = max(largest, float(np.linalg.norm(moving - was)) / dt)
            assert np.linalg.norm(moving) <= 8.0
            assert np.linalg.norm(moving - was) <= 500.0 * dt
            assert fixture.is_admissible(state, after)
    assert largest > 0.85 * 500.0


def test_a_tool_that_is_too_fast_may_only_get_slower() -> None:
    fixture = CartesianLimits(speed_mm_per_s=5.0)
    before = state_at(np.zeros(7), np.array([10.0, 0, 0, 0, 0, 0, 0]))
    assert fixture.is_admissible(before, state_at(np.zeros(7), np.array([9.0, 0, 0, 0, 0, 0, 0])))
    assert not fixture.is_admissible(before, state_at(np.zeros(7), np.array([10.1, 0, 0, 0, 0, 0, 0])))


def test_a_limit_at_the_grip() -> None:
    """A point fixed to the tool, here the grip: its speed against central differences of its place."""
    grip = TOOL.grip(np.eye(3), np.zeros(3))
    fixture = CartesianLimits(speed_mm_per_s=5.0, point_in_tip=tuple(grip))
    random = np.random.default_rng(1)
    for _ in range(50):
        q, velocity = anywhere(random), random.normal(size=7)
        places = [TOOL.grip(*PLACED.tip_pose(q + s * 1e-6 * velocity)) for s in (1, -1)]
        expected = np.linalg.norm(places[0] - places[1]) / 2e-6
        assert fixture.speeds(state_at(q, velocity))[0] == pytest.approx(expected, rel=1e-5)


# Weights and refusals


def test_a_weight_counts_for_wishes_and_not_for_limits() -> None:
    state = state_at(np.zeros(7))
    plain: Fixture = RemoteCentre(NOSTRIL, weight=2.0)
    heavy = weighted(plain, 3.0)
    a, b = plain.rows(situation(state)), heavy.rows(situation(state))
    assert b.objectives[0].weight == pytest.approx(6.0)
    np.testing.assert_array_equal(a.constraints[0].bound, b.constraints[0].bound)
    assert heavy.is_admissible(state, state)
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="weight"):
            weighted(plain, wrong)


def test_nonsense_is_refused() -> None:
    """HAZ-05."""
    with pytest.raises(InputError, match="remote centre"):
        RemoteCentre(np.array([0.0, np.nan, 0.0]))
    with pytest.raises(InputError, match="tolerance"):
        RemoteCentre(NOSTRIL, tolerance_mm=0.0)
    with pytest.raises(InputError, match="axis"):
        OrientationCone.of_shaft(np.zeros(3), 0.3)
    with pytest.raises(InputError, match="angle"):
        OrientationCone.of_shaft(NOSTRIL, np.nan)
    with pytest.raises(InputError, match="limit"):
        CartesianLimits(speed_mm_per_s=-1.0)
    with pytest.raises(InputError, match="point"):
        CartesianLimits(point_in_tip=(0.0, np.inf, 0.0))


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _turned(direction: np.ndarray, angle: float, random: np.random.Generator) -> np.ndarray:
    """A unit vector at ``angle`` rad from ``direction``."""
    side = across(direction).T @ _unit(random.normal(size=2))
    return np.cos(angle) * direction + np.sin(angle) * side
