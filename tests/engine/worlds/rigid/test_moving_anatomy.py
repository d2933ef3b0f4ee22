"""Anatomy that moves around the tool: never deeper, out at a bounded speed, and nothing without a hand (HAZ-04)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.scenes import CoalJudge, curved_tube, placed_scene, straight_scene, wall
from vfix_engine.control import Controller, ControlSettings, HandCommand, StepState
from vfix_engine.control.tasks import MoveFreely
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shapes import Box, HalfSpace, Sphere
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import Tool
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal
from vfix_engine.worlds.rigid.scene import Scene

FAST = ControlSettings(dt_s=5e-3, k_tau=1.0)


def moved(mesh: TriangleMesh, by: np.ndarray) -> ProximityTree:
    return ProximityTree(TriangleMesh(mesh.vertices + by, mesh.faces))


def hand(random: np.random.Generator) -> np.ndarray:
    push = random.normal(size=3)
    force: np.ndarray = 5.0 * push / np.linalg.norm(push)
    return force


def poor(state: StepState, margin: np.ndarray) -> np.ndarray:
    """Distances (B, S) cut at each body's margin: what may never become less."""
    return np.minimum(state.distance, margin[:, None])


def test_from_a_thousand_starts_inside_a_margin_nothing_ever_gets_nearer() -> None:
    """HAZ-04: walls, a ball and a box, alone and together, over any part of the tool; whatever the hand does."""
    random = np.random.default_rng(11)
    base = straight_scene(wall(200.0))
    walls = [ProximityTree(wall(y)) for y in np.linspace(1.05, 1.25, 10)]  # tip radius 1, margin 0.3
    robot, worst, held, steps = base.placed_robot(), 0.0, 0, 0
    for start in range(1000):
        tree = walls[start % 10] if start % 3 else base.tree
        zones: tuple[Zone, ...] = ()
        if start % 3 != 1:
            away = random.normal(size=3)
            place = random.uniform(0, 1) * np.array([0, -15 * 0.87, -7.5]) + 2.5 * away / np.linalg.norm(away)
            zones = (Zone("ball", Sphere(place, random.uniform(1.3, 3.4)), 0.8),)
        if start % 5 == 0:
            placing = np.eye(4)
            placing[:3, 3] = random.uniform(2.0, 4.0) * np.array([1.0, -1, 1])
            zones = (*zones, Zone("box", Box(placing, [1.5, 1.5, 2.0]), 0.5))
        control = Controller(robot, base.tool, tree, FAST, zones=zones)
        margin = np.array([FAST.margin_mm, *(zone.margin_mm for zone in control.zones)])
        state = control.measure(np.concatenate([random.uniform(-0.02, 0.02, 3), random.uniform(-2e-3, 2e-3, 4)]))
        assert (state.distance < margin[:, None]).any() or start % 3 == 0
        push = hand(random)
        for step in range(6):
            if step % 3 == 0:
                push = hand(random)
            torque = random.normal(size=3) * 100
            report = control.step(state, MoveFreely(), HandCommand(push, torque))
            worst = min(worst, float((poor(report.state, margin) - poor(state, margin)).min()))
            held += report.held
            steps += 1
            state = report.state
    assert worst >= 0.0
    assert held < 0.3 * steps  # it is recovery, not holding for ever


@pytest.mark.parametrize("push", [[0.0, -5, 0], [5.0, 0, 0], [0, 5.0, 0], [0, 0, 5.0], [-3.0, 2.0, 1.0]])
def test_the_tool_comes_out_of_the_margin_whatever_the_hand_wants(push: list[float]) -> None:
    """There is free way behind: the margin is reached, no faster than the approach's deceleration allows in a step."""
    scene = straight_scene(wall(1.05))
    control = Rehearsal(scene, FAST).controller
    state = control.measure(np.zeros(7))
    assert state.clearance == pytest.approx(0.05)
    retreat = FAST.approach_deceleration_mm_per_s2 * FAST.dt_s**2
    for _ in range(200):
        report = control.step(state, MoveFreely(), HandCommand(np.array(push)))
        if push[1] >= 0.0:  # a hand that pulls back goes as fast as it pulls
            assert report.state.clearance - state.clearance <= retreat + 0.02
        if state.clearance < FAST.margin_mm - retreat:
            assert report.outcome != "idle"  # against the hand, but never as if there were none
            assert report.state.clearance > state.clearance
        state = report.state
    assert state.clearance >= FAST.margin_mm
    assert CoalJudge(scene.tree.mesh).clearance(state.segments) >= FAST.margin_mm - 1e-6


def test_between_two_walls_the_tool_takes_what_room_there_is() -> None:
    """The retreat from one wall is more than the other leaves: as much of it as can be had, and none of the other's."""
    tool, settings = Tool.load("straight_pointer"), replace(FAST, dt_s=2e-2)
    base, radius = np.eye(4), float(tool.radius.max())
    base[:3, 3] = -tool.tip_in_flange
    left, right = HalfSpace([radius + 0.9, 0, 0], [-1, 0, 0]), HalfSpace([-radius - 1.06, 0, 0], [1, 0, 0])
    zones = (Zone("left", left, 1.0), Zone("right", right, 1.0))
    scene = replace(straight_scene(wall(200.0)), tool=tool, base=base, zones=zones)
    control = Rehearsal(scene, settings).controller
    state = control.measure(np.zeros(7))
    assert state.distance[1:].min(axis=1) == pytest.approx([0.9, 1.06])
    for _ in range(100):
        state = control.step(state, MoveFreely(), HandCommand(np.array([3.0, 0, 0]))).state
    one, other = state.distance[1:].min(axis=1)
    assert one > 0.93
    assert other >= 1.0


def test_a_long_step_out_of_a_margin_is_cut_until_it_can_be_proven() -> None:
    """At 50 Hz a turn moves the shaft's far end by a millimetre: the bound on the way refuses all but a creep."""
    scene = straight_scene(wall(200.0))
    zone = Zone("eye", Sphere([3.4, -20.0, -7.5], 1.2), 1.0)
    settings = replace(FAST, dt_s=2e-2)
    control = Rehearsal(replace(scene, zones=(zone,)), settings).controller
    state = control.measure(np.zeros(7))
    start = float(state.distance[1].min())
    assert start < 1.0
    for _ in range(300):
        state = control.step(state, MoveFreely(), HandCommand(np.array([5.0, 0, 0]), np.array([0, 0, 600.0]))).state
    assert state.distance[1].min() > min(start + 0.2, 0.999)


def test_breathing_anatomy() -> None:
    """A tube shifts by up to 0.5 mm around a driven tool, rebuilt every tenth step: only anatomy takes clearance."""
    scene = placed_scene(*curved_tube())
    mesh, random = scene.tree.mesh, np.random.default_rng(2)
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start("path")
    for _ in range(300):
        state, _ = rehearsal.step(state, Command(np.zeros(3), drive=1))
    state = rehearsal.with_mode(state, "free")
    push, inside, recovered, least, last = hand(random), 0, 0, np.inf, np.zeros(3)
    for i in range(1500):
        if i % 10 == 0:
            breath = 0.5 * np.sin(2 * np.pi * i / 400) * np.array([0.6, 0.0, 0.8])
            rehearsal, last = rehearsal.with_anatomy(moved(mesh, breath)), breath
            state = replace(state, tool=rehearsal.controller.measure(state.tool.q))
        if i % 75 == 0:
            push = hand(random)
        idle = i % 300 >= 260
        before = state.tool
        state, _ = rehearsal.step(state, Command(np.zeros(3) if idle else push))
        if before.clearance < FAST.margin_mm:
            inside += 1
            recovered += state.tool.clearance > before.clearance
            assert (np.minimum(state.tool.distance, 0.3) >= np.minimum(before.distance, 0.3)).all()
        else:
            assert state.tool.clearance >= FAST.margin_mm
        least = min(least, state.tool.clearance)
    judge = CoalJudge(TriangleMesh(mesh.vertices + last, mesh.faces))
    assert judge.clearance(state.tool.segments) == pytest.approx(state.tool.clearance, abs=1e-6)
    assert inside > 50  # the breath did press bone into the margin
    assert recovered > 0.5 * inside
    assert least > 0.0


def test_a_patch_moves_with_the_anatomy() -> None:
    """Zones are given again where they moved; those that are not given stay."""
    scene = straight_scene(wall(3.5))
    mesh = scene.tree.mesh
    chosen = np.abs(mesh.triangles.mean(axis=1)[:, [0, 2]]).max(axis=1) < 8.0
    zones = (Zone.of_faces("stem", mesh, chosen, 1.0), Zone("eye", Sphere([0, 0, 9], 2.0), 0.5))
    rehearsal = Rehearsal(replace(scene, zones=zones), FAST)
    state = rehearsal.start("free")
    nearer = moved(mesh, np.array([0.0, -1.0, 0.0]))
    later = rehearsal.with_anatomy(nearer, (Zone.of_faces("stem", nearer.mesh, chosen, 1.0), zones[1]))
    before, after = state.tool.distance, later.controller.measure(state.tool.q).distance
    assert [z.name for z in later.controller.zones] == ["stem", "eye"]
    assert (after[:2, 0] < before[:2, 0]).all()
    assert after[2] == pytest.approx(before[2])
    assert rehearsal.with_anatomy(nearer).controller.measure(state.tool.q).distance[1] == pytest.approx(before[1])


def test_without_a_hand_moving_anatomy_moves_nothing() -> None:
    """The robot never goes by itself, not even out of a margin; a light touch is enough."""
    scene = straight_scene(wall(3.0))
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start("free")
    rehearsal = rehearsal.with_anatomy(moved(scene.tree.mesh, np.array([0.0, -1.85, 0])))
    for _ in range(5):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3)))
    np.testing.assert_array_equal(state.tool.q, scene.q_start)
    assert snapshot.clearance_mm == pytest.approx(0.15)
    for _ in range(300):
        state, snapshot = rehearsal.step(state, Command(np.array([0.0, 0.01, 0.0])))
    assert snapshot.clearance_mm >= FAST.margin_mm


def test_anatomy_that_has_reached_the_axis_holds_the_tool() -> None:
    """From there on the distance cannot tell deep from shallow, so no motion could be proven harmless."""
    scene = straight_scene(wall(3.0))
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start("free")
    rehearsal = rehearsal.with_anatomy(moved(scene.tree.mesh, np.array([0.0, -6.0, 0])))
    for push in np.vstack([5 * np.eye(3), -5 * np.eye(3)]):
        state, snapshot = rehearsal.step(state, Command(push))
        assert snapshot.held
        assert snapshot.reason.startswith("bone on the tip, 0.")
        np.testing.assert_array_equal(state.tool.q, scene.q_start)


def test_out_of_a_solid_shape_from_any_depth() -> None:
    """A shape has an inside: a tool in the middle of a ball is led out the shortest way, as soon as a hand drives."""
    scene: Scene = replace(straight_scene(wall(200.0)), zones=(Zone("eye", Sphere([0.5, 1.0, 0], 3.0), 0.5),))
    control = Rehearsal(scene, FAST).controller
    state = control.measure(np.zeros(7))
    depth = float(state.distance[1].min())
    assert depth < -2.0
    for _ in range(900):
        report = control.step(state, MoveFreely(), HandCommand(np.array([0.0, 1.0, 0.0])))
        deepest = float(report.state.distance[1].min())
        assert deepest >= min(float(state.distance[1].min()), 0.5)
        state = report.state
    assert deepest >= 0.5
