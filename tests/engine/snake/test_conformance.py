"""Conformance and follow-the-leader: exact where the joints can, within limits and continuous where they cannot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vfix_engine.errors import PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.transport import transported
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.conform.conform_kernel import Body, ChainTask, CurveSamples, normal_matrix, shape_cost
from vfix_engine.snake.conform.conform_solve import box_step
from vfix_engine.snake.conform.conformance import FASTEST, Insertion, ShapeSolution, conform

LINK = 28.0


def arc(radius: float, turn: float = 2.5) -> Curve:
    """A piece of a circle from the origin along +z towards +x, exact at every sample."""
    count = round(radius * turn / 0.5)
    angle = np.linspace(0.0, turn, count + 1)
    points = np.column_stack([radius * (1.0 - np.cos(angle)), np.zeros(count + 1), radius * np.sin(angle)])
    return Curve(points, radius * turn / count)


def helix() -> Curve:
    angle = np.linspace(0.0, 5.0, 200)
    return Curve.through(np.column_stack([60.0 * np.cos(angle), 60.0 * np.sin(angle), 25.0 * angle]))


def s_curve() -> Curve:
    z = np.linspace(0.0, 300.0, 200)
    return Curve.through(np.column_stack([25.0 * np.sin(z / 45.0), 15.0 * np.sin(z / 70.0), z]))


def hairpin() -> Curve:
    """Straight, round a bend of 22 mm radius by 160°, straight: 28 mm chords turn by 79° there."""
    straight = np.column_stack([np.zeros(60), np.zeros(60), np.linspace(0.0, 118.0, 60)])
    angle = np.linspace(0.0, math.radians(160.0), 60)
    bend = np.column_stack([22.0 * (1.0 - np.cos(angle)), np.zeros(60), 120.0 + 22.0 * np.sin(angle)])
    ahead = np.array([math.sin(angle[-1]), 0.0, math.cos(angle[-1])])
    return Curve.through(np.concatenate([straight, bend, bend[-1] + np.linspace(2.0, 150.0, 75)[:, None] * ahead]))


def joint_centres(snake: SnakeModel, found: ShapeSolution) -> np.ndarray:
    return snake.frames(found.q, found.base)[:, :3, 3]


def to_polyline(points: np.ndarray, curve: Curve) -> np.ndarray:
    """Distance of points (n, 3) to a curve that goes straight on before its start; of a check of its own."""
    before = curve.points[0] - np.array([1000.0]) * curve.tangent(0.0)
    line = np.vstack([before, curve.points])
    along = np.diff(line, axis=0)
    share = np.einsum("nsk,sk->ns", points[:, None] - line[None, :-1], along) / (along**2).sum(axis=1)
    nearest = line[None, :-1] + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


@pytest.mark.parametrize("curve", [arc(40.0), arc(120.0), helix(), s_curve()], ids=["arc40", "arc120", "helix", "s"])
def test_joint_centres_lie_on_the_curve(curve):
    snake = SnakeModel(8)
    for tip in (0.0, 5.0, 60.0, 0.5 * curve.length, curve.length):
        found = conform(snake, curve, tip)
        assert found.exact
        assert found.offset_mm.max() < 1e-9
        centres = joint_centres(snake, found)
        assert to_polyline(centres, curve).max() < 1e-9
        np.testing.assert_allclose(centres[-1], curve.position(tip), atol=1e-9)
        np.testing.assert_allclose(centres, curve.position(found.joint_s), atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(np.diff(centres, axis=0), axis=1), LINK, atol=1e-9)
        assert (np.diff(found.joint_s) > 0.0).all()
        assert np.abs(found.q).max() <= snake.q_max


def test_angles_on_an_arc_have_the_closed_form():
    radius = 60.0
    curve = arc(radius)
    found = conform(SnakeModel(4), curve, curve.length, roll=0.0)
    turn = 2.0 * math.asin(0.5 * LINK / radius)
    turned = [math.acos(math.cos(a) * math.cos(b)) for a, b in found.q.reshape(-1, 2)]
    np.testing.assert_allclose(turned[1:], turn, atol=1e-4)  # the curve is a polyline of half millimetres
    assert turned[0] == pytest.approx(0.5 * turn, abs=1e-3)  # from the tangent to the first chord


def test_every_joint_passes_where_the_tip_passed():
    snake, curve = SnakeModel(7), helix()
    insertion = Insertion(snake, curve)
    before, left = insertion.state, []
    while insertion.tip_s + 0.7 <= curve.length:
        now = insertion.advance(0.7)
        assert now is insertion.state
        assert now.exact
        change = np.abs(now.q - before.q).max()
        assert change <= 0.05 * 0.7
        assert np.abs(now.q).max() <= snake.q_max
        assert np.linalg.norm(now.base[:3, 3] - before.base[:3, 3]) < 1.0
        # The base does not turn about its axis while it goes straight in.
        if now.joint_s[0] < 0.0:
            np.testing.assert_allclose(now.base[:3, :3], before.base[:3, :3], atol=1e-12)
        left.append(to_polyline(joint_centres(snake, now), curve).max())
        before = now
    assert max(left) < 1e-6
    assert insertion.links_inside == 7
    out = insertion.advance(-insertion.tip_s)
    np.testing.assert_allclose(out.q, 0.0, atol=1e-12)
    assert insertion.links_inside == 0


def test_where_the_limits_bind_they_are_kept_and_nothing_jumps():
    snake, curve = SnakeModel(9), hairpin()
    slack = np.full(len(curve.points), 5.0)
    insertion = Insertion(snake, curve, slack)
    before, bound, worst = insertion.state, 0, 0.0
    while insertion.tip_s + 1.0 <= curve.length:
        now = insertion.advance(1.0)
        assert np.abs(now.q).max() <= snake.q_max
        if not (now.exact and before.exact):
            assert np.abs(now.q - before.q).max() <= FASTEST * 1.0 + 1e-12
        assert np.linalg.norm(now.base[:3, 3] - before.base[:3, 3]) <= 4.0
        centres = joint_centres(snake, now)
        np.testing.assert_allclose(to_polyline(centres, curve), now.offset_mm, atol=0.02)
        bound += int(now.at_limit.any())
        worst = max(worst, float(now.offset_mm.max()))
        before = now
    assert bound > 30
    assert 1.0 < worst < 12.0
    assert np.linalg.norm(centres[-1] - curve.position(insertion.tip_s)) < 3.0


def test_exact_again_when_the_bend_is_behind():
    snake, curve = SnakeModel(3), hairpin()
    insertion = Insertion(snake, curve, np.full(len(curve.points), 5.0))
    seen = []
    while insertion.tip_s + 1.0 <= curve.length:
        seen.append(insertion.advance(1.0).exact)
    assert seen[0]
    assert seen[-1]
    assert not all(seen)
    assert insertion.state.offset_mm.max() < 1e-9


def test_links_that_are_still_outside_change_nothing():
    """What lies inside is the same whatever is still to come: two robots, one three times as long."""
    curve = hairpin()
    slack = np.full(len(curve.points), 5.0)
    short, long = (Insertion(SnakeModel(links), curve, slack, roll=0.3) for links in (6, 18))
    bound = 0
    while short.tip_s + 1.0 <= 6.0 * LINK:
        one, two = short.advance(1.0), long.advance(1.0)
        np.testing.assert_allclose(two.q[-12:], one.q, atol=1e-4)
        np.testing.assert_allclose(two.joint_s[-7:], one.joint_s, atol=1e-2)
        np.testing.assert_allclose(
            joint_centres(SnakeModel(18), two)[-7:], joint_centres(SnakeModel(6), one), atol=1e-2
        )
        bound += int(one.at_limit.any())
    assert bound > 10
    np.testing.assert_array_equal(two.q[: 2 * 10], 0.0)


def test_the_roll_is_chosen_for_where_the_robot_goes():
    """A bend behind its reach does not change the roll of a robot that never comes there."""
    curve, snake = hairpin(), SnakeModel(4)
    turned = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    other = Curve(curve.points @ turned.T, curve.step_mm)
    chosen = {Insertion(snake, line, deepest=100.0).roll for line in (curve, other)}
    assert chosen == {0.0}  # straight as far as that, so any does
    assert any(Insertion(snake, line).roll != 0.0 for line in (curve, other))


def test_a_moved_curve_begins_where_the_snake_is():
    snake, curve = SnakeModel(6), hairpin()
    one = conform(snake, curve, 200.0)
    moved = Curve(curve.points + np.array([0.0, 0.5, 0.0]), curve.step_mm)
    two = conform(snake, moved, 200.0, near=one)
    assert np.abs(two.q).max() <= snake.q_max
    assert two.curve is moved
    assert two.roll == one.roll
    assert np.abs(two.q - one.q).max() < 0.3


def test_what_cannot_be_is_refused():
    curve = arc(80.0)
    snake = SnakeModel(4)
    with pytest.raises(PathwayError, match="5 mm beyond the end"):
        conform(snake, curve, curve.length + 5.0)
    with pytest.raises(PathwayError, match=r"30 links of 28 mm are 840 mm long, the path has 200 mm: take 7 links"):
        conform(SnakeModel(30), curve, 100.0, outside=False)
    with pytest.raises(PathwayError, match="not finite"):
        conform(snake, curve, math.nan)
    with pytest.raises(PathwayError, match="slack"):
        conform(snake, curve, 10.0, slack=np.zeros(3))
    insertion = Insertion(snake, curve, tip_s=50.0)
    for step in (math.nan, math.inf, curve.length):
        with pytest.raises(PathwayError):
            insertion.advance(step)
    assert insertion.tip_s == 50.0
    assert insertion.state.tip_s == 50.0


def test_the_gradient_is_that_of_the_cost():
    snake, curve, links = SnakeModel(5), hairpin(), 5
    slack = np.full(len(curve.points), 2.0)
    found = conform(snake, curve, 290.0, slack=slack)
    assert 125.0 < found.joint_s[0] < 175.0  # the base turns with the bend as it goes on
    weights = np.array([0.1, 1.0, 1.0, 10.0, 1000.0, 1.0, 2.0])
    line = CurveSamples(curve.points, curve.tangents, transported(curve.points, curve.tangents), slack, curve.step_mm)
    rng = np.random.default_rng(3)
    near = np.append(found.q, found.joint_s[0])
    state = near + rng.normal(0.0, 0.02, len(near))
    task = ChainTask(LINK, found.roll, 290.0, weights, near)
    begin = np.empty(2 * links)
    begin[0::2], begin[1::2] = 0.5 * (found.joint_s[:-1] + found.joint_s[1:]), found.joint_s[1:]

    def body() -> Body:
        return Body(
            np.empty((3, 4)), np.empty((links, 3, 4)), np.empty((links, 6)), np.empty((links, 6, 6)), np.empty((7, 3))
        )

    def cost(at: np.ndarray) -> float:
        return shape_cost(line, task, at, begin.copy(), body())

    size, filled = len(state), body()
    shape_cost(line, task, state, begin.copy(), filled)
    gradient, hessian = np.empty(size), np.empty((size, size))
    normal_matrix(line, task, filled, state, np.empty((size, 6)), np.empty(6), gradient, hessian)
    steps = 1e-6 * np.eye(size)
    slopes = np.array([(cost(state + step) - cost(state - step)) / 2e-6 for step in steps])
    # The curve is a polyline whose tangents are smoothed: the two differ by its corners.
    np.testing.assert_allclose(gradient, slopes, atol=2e-2 * np.abs(slopes).max())
    assert np.linalg.eigvalsh(hessian).min() > 0.0
    np.testing.assert_array_equal(hessian, hessian.T)


def test_a_step_in_a_box_is_the_best_there():
    rng = np.random.default_rng(1)
    for _ in range(50):
        size = 9
        root = rng.normal(size=(size, size)) * np.exp(rng.normal(size=size) * 2.0)
        hessian, gradient = root @ root.T + 1e-6 * np.eye(size), rng.normal(size=size) * 10.0
        lower, upper = -rng.uniform(0.0, 0.3, size), rng.uniform(0.0, 0.3, size)
        lower[2], upper[5] = 0.0, 0.0
        x = np.empty(size)
        box_step(
            hessian, gradient, lower, upper, np.empty((size, size)), np.empty((3, size)), np.empty(size, np.int64), x
        )
        slope = hessian @ x + gradient
        assert (x >= lower).all()
        assert (x <= upper).all()
        small = 1e-5 * np.abs(gradient).max()
        assert (slope[x < upper] > -small).all()
        assert (slope[x > lower] < small).all()
