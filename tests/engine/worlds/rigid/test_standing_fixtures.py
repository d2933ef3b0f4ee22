"""Standing virtual fixtures in closed loop, alone and together (Li 2007, eq. 1-5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.engine.scenes import head_corridor, head_mesh, placed_scene, straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.virtual_fixtures import CartesianLimits, Fixture, OrientationCone, RemoteCentre, StepState, weighted
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

FAST = ControlSettings(dt_s=5e-3)


@pytest.fixture(scope="module")
def open_field() -> Scene:
    return straight_scene(wall(90.0))


def first_state(scene: Scene) -> StepState:
    return Rehearsal(scene, FAST).start("free").tool


def shaft(state: StepState) -> np.ndarray:
    along = state.segments.end[-1] - state.segments.start[-1]
    return along / np.linalg.norm(along)


def behind(state: StepState, distance: float) -> np.ndarray:
    """A point on the shaft's axis."""
    return state.segments.end[-1] - distance * shaft(state)


def roam(
    scene: Scene, fixtures: tuple[Fixture, ...], steps: int, measure: Callable[[StepState], float], seed: int = 3
) -> tuple[np.ndarray, list[RigidSnapshot]]:
    """A hand that pushes, turns and rests at random at full force; what is measured after every step."""
    random = np.random.default_rng(seed)
    rehearsal = Rehearsal(replace(scene, fixtures=fixtures), FAST)
    state = rehearsal.start("free")
    values, kept, left = [], [], 0
    for _ in range(steps):
        if left == 0:
            left, push = int(random.integers(20, 200)), random.normal(size=3)
            push *= FAST.force_cap_n * (random.integers(5) > 0) / np.linalg.norm(push)
            twist = int(random.integers(-1, 2))
        left -= 1
        state, snapshot = rehearsal.step(state, Command(push, twist=twist))
        values.append(measure(state.tool))
        kept.append(snapshot)
    assert state.emergencies == 0
    return np.array(values), kept


def span(kept: list[RigidSnapshot]) -> float:
    return float(np.ptp([s.tip for s in kept], axis=0).min())


def test_the_shaft_stays_in_the_remote_centre(open_field: Scene) -> None:
    centre = RemoteCentre(behind(first_state(open_field), 60.0), tolerance_mm=0.5)
    without, _ = roam(open_field, (), 1000, centre.error)
    errors, kept = roam(open_field, (centre,), 1000, centre.error)
    assert without.max() > 5.0
    assert errors.max() < 0.01
    assert span(kept) > 5.0  # the tip still goes everywhere


def test_a_tolerance_that_the_task_uses_up_is_kept(open_field: Scene) -> None:
    """Without the soft rows the hand decides where in the tolerance the shaft passes: up to its edge, not beyond."""
    centre = RemoteCentre(behind(first_state(open_field), 60.0), tolerance_mm=0.5, weight=0.0)
    errors, _ = roam(open_field, (centre,), 1000, centre.error)
    assert 0.45 < errors.max() <= 0.5


def test_the_way_to_the_remote_centre_never_leads_away_from_it(open_field: Scene) -> None:
    state = first_state(open_field)
    centre = RemoteCentre(behind(state, 60.0) + np.array([3.0, 0, 1]), tolerance_mm=0.5, return_mm_per_s=5.0)
    errors, _ = roam(open_field, (centre,), 1000, centre.error)
    outside = errors > 0.5
    assert outside[0]
    assert not outside[-1]
    assert (np.diff(errors[outside]) <= 1e-12).all()
    assert np.abs(np.diff(errors)).max() <= 5.0 * FAST.dt_s * 1.05


@pytest.mark.parametrize("start", [0.0, 0.3])
def test_the_shaft_stays_in_its_cone(open_field: Scene, start: float) -> None:
    """From inside it is never left; from outside it is entered and nothing gets worse on the way."""
    cone = OrientationCone.of_shaft(np.array([np.sin(start), np.cos(start), 0.0]), 0.1)
    without, _ = roam(open_field, (), 1000, cone.angle)
    angles, kept = roam(open_field, (cone,), 1000, cone.angle)
    assert without[200:].max() > 0.15
    outside = angles > 0.1
    assert (np.diff(angles[outside]) <= 1e-12).all()
    assert not outside[-1]
    assert outside[0] == (start > 0.1)
    assert angles.max() == pytest.approx(max(start, 0.1), rel=0.05)  # the edge was reached
    assert span(kept) > 5.0


def test_tip_speed_acceleration_and_turn_are_limited(open_field: Scene) -> None:
    """Measured from the recorded places of the tip."""
    limits = CartesianLimits(speed_mm_per_s=4.0, acceleration_mm_per_s2=400.0, turn_rad_per_s=0.05)
    turns, kept = roam(open_field, (limits,), 800, lambda state: limits.speeds(state)[1])
    velocity = np.diff([s.tip for s in kept], axis=0) / FAST.dt_s
    speed = np.linalg.norm(velocity, axis=1)
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / FAST.dt_s
    assert 3.7 < speed.max() <= 4.0 * (1 + 1e-6)
    assert change.max() <= 400.0 * (1 + 1e-3)
    assert 0.045 < turns.max() <= 0.05
    assert any("the speed limit" in s.active for s in kept)
    _, loose = roam(open_field, (), 600, lambda state: 0.0)
    assert (np.linalg.norm(np.diff([s.tip for s in loose], axis=0), axis=1) / FAST.dt_s).max() > 8.0


@pytest.mark.parametrize("most", [50.0, 120.0])
def test_a_gentle_tip_also_comes_to_rest_gently(open_field: Scene, most: float) -> None:
    """HAZ-06: slower than the wish of the hand, in the drive and after the release; what exceeds it is counted."""
    limits = CartesianLimits(acceleration_mm_per_s2=most)
    rehearsal = Rehearsal(replace(open_field, fixtures=(limits,)), FAST)
    state, velocity, counted = rehearsal.start("free"), [], []
    for k in range(600):
        state, snapshot = rehearsal.step(state, Command(np.array([2.0, 0.0, 0.0]) if k < 150 else np.zeros(3)))
        velocity.append(state.tool.tip.jacobian[:3] @ state.tool.velocity)
        counted.append(snapshot.emergencies)
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / FAST.dt_s
    gently = np.diff(counted) == 0
    assert change[gently].max() <= most * (1 + 1e-3)
    assert gently.mean() > 0.99
    assert np.linalg.norm(velocity[149]) > 3.0  # it was driven,
    assert not np.any(velocity[-1])  # and stands


def test_all_of_them_together(open_field: Scene) -> None:
    state = first_state(open_field)
    centre = RemoteCentre(behind(state, 60.0), tolerance_mm=0.5)
    cone = OrientationCone.of_shaft(shaft(state), 0.08)
    limits = CartesianLimits(speed_mm_per_s=6.0, turn_rad_per_s=0.1)
    fixtures = (weighted(centre, 0.1), cone, limits)
    worst, kept = roam(
        open_field,
        fixtures,
        1200,
        lambda s: max(
            centre.error(s) / 0.5, cone.angle(s) / 0.08, limits.speeds(s)[0] / 6.0, limits.speeds(s)[1] / 0.1
        ),
    )
    assert 0.9 < worst.max() <= 1.0
    assert span(kept) > 3.0


def test_weights_decide_between_wishes_that_cannot_both_be_had(open_field: Scene) -> None:
    """Two soft centres that no line passes at once with the hand's wish: the heavier one comes nearer to its own."""
    state, aside = first_state(open_field), np.array([2.0, 0, 0])
    one = RemoteCentre(behind(state, 40.0) + aside, tolerance_mm=np.inf)
    two = RemoteCentre(behind(state, 40.0) - aside, tolerance_mm=np.inf)
    ratio = {}
    for weight in (0.1, 1.0, 10.0):
        fixtures = (weighted(one, weight), two)
        _, kept = roam(open_field, fixtures, 300, one.error)
        last = Rehearsal(open_field, FAST).controller.measure(kept[-1].q)
        ratio[weight] = one.error(last) / two.error(last)
    assert ratio[10.0] < 0.3 < 0.7 < ratio[1.0] < 1.4 < 3.0 < ratio[0.1]


def test_the_inner_half_of_a_real_corridor_through_the_nostril(trial_data: Path) -> None:
    """The remote centre takes the sideways motion out of the nostril and costs the path nothing."""
    scene = placed_scene(head_mesh(trial_data), head_corridor(trial_data))
    assert scene.path is not None
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start()
    while rehearsal.snapshot(state).progress_mm < 45.0:
        state, _ = rehearsal.step(state, Command(np.zeros(3), drive=1))
    entry = scene.path.position(0.0)
    nostril = behind(state.tool, float(shaft(state.tool) @ (state.tool.segments.end[-1] - entry)))
    centre = RemoteCentre(nostril, tolerance_mm=0.5, weight=0.01)
    worst = {}
    for fixtures in ((), (centre,)):
        inside = Rehearsal(replace(scene, fixtures=fixtures, q_start=state.tool.q), FAST)
        now = inside.start()
        errors = []
        while now.phase != "done" and now.steps < 1500:
            now, snapshot = inside.step(now, Command(np.zeros(3), drive=1))
            errors.append(centre.error(now.tool))
            assert snapshot.tip_error_mm < 0.05
            assert snapshot.clearance_mm >= FAST.margin_mm
        assert now.phase == "done"
        worst[len(fixtures)] = max(errors)
    assert worst[0] > 3.0
    assert worst[1] < 0.1


def test_bone_comes_before_a_limit_of_comfort() -> None:
    """A tip that may only brake at 20 mm/s² cannot stop before bone as the boundary asks: the boundary wins."""
    scene = straight_scene(wall(12.0))
    limits = CartesianLimits(acceleration_mm_per_s2=20.0)
    rehearsal = Rehearsal(replace(scene, fixtures=(limits,)), FAST)
    state = rehearsal.start("free")
    least, fastest = np.inf, 0.0
    for _ in range(1000):
        state, snapshot = rehearsal.step(state, Command(np.array([0.0, 5.0, 0.0])))
        least, fastest = min(least, snapshot.clearance_mm), max(fastest, limits.speeds(state.tool)[0])
    assert fastest > 8.0
    assert FAST.margin_mm <= least < FAST.margin_mm + 0.03
    assert 0 < state.emergencies < 20  # told as what they are; the joints could do it all along
