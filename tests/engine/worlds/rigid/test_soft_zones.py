"""Soft zones in closed loop: a steady hand stands at δ = f / k, bone stays hard beneath, no hand no motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.scenes import CoalJudge, curved_tube, placed_scene, straight_scene, wall
from vfix_engine.control import Controller, ControlSettings, HandCommand, StepReport, StepState, Task
from vfix_engine.control.tasks import ApproachTarget, FollowPath, InspectTarget, MoveFreely, view_point
from vfix_engine.geometry.shapes import HalfSpace, Sphere
from vfix_engine.virtual_fixtures import Fixture, SoftZone, weighted
from vfix_engine.worlds.rigid.scene import Scene

SLOW = ControlSettings(dt_s=2e-2)
PATH = np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]])
AHEAD = np.array([0.0, 1.0, 0.0])


def controller(scene: Scene, soft: Fixture, settings: ControlSettings = SLOW) -> Controller:
    return Controller(scene.placed_robot(), scene.tool, scene.tree, settings, fixtures=(soft,))


def pushed(control: Controller, state: StepState, force: np.ndarray, steps: int, mode: str, scene: Scene) -> StepReport:
    """A steady hand for some steps; stops early once the tool stands."""
    for _ in range(steps):
        if mode == "free":
            task: Task = MoveFreely()
        else:
            assert scene.path is not None
            task = FollowPath(scene.path)
        report = control.step(state, task, HandCommand(force))
        state = report.state
    return report


@pytest.mark.parametrize("mode", ["free", "path"])
@pytest.mark.parametrize(("stiffness", "force"), [(0.5, 0.4), (2.0, 1.5), (100.0, 5.0)])
def test_a_steady_hand_stands_where_the_spring_holds_it(mode: str, stiffness: float, force: float) -> None:
    """δ = f / k within 5 %, measured by coal as layer minus clearance; then half the force, half as deep.

    The stiffest would overshoot further at every step (gain · k · Δt = 4) were its force taken at the step's start.
    """
    scene = straight_scene(wall(6.0), PATH)
    judge = CoalJudge(scene.tree.mesh)
    soft = SoftZone("mucosa", 2.0, stiffness)
    control = controller(scene, soft)
    report = pushed(control, control.start(scene.q_start), force * AHEAD, 700, mode, scene)
    depth = 2.0 - judge.clearance(report.state.segments)
    assert depth == pytest.approx(force / stiffness, rel=0.05)
    assert soft.penetration(report.state, scene.tree) == pytest.approx(depth, abs=1e-6)
    if mode == "free":
        report = pushed(control, report.state, force / 2 * AHEAD, 500, mode, scene)
        assert 2.0 - judge.clearance(report.state.segments) == pytest.approx(force / 2 / stiffness, rel=0.05)


def test_a_weighted_layer_is_as_much_stiffer() -> None:
    """In closed loop the tool stands at δ = f / (w k)."""
    scene = straight_scene(wall(6.0), PATH)
    control = controller(scene, weighted(SoftZone("mucosa", 2.0, 0.5), 4.0))
    report = pushed(control, control.start(scene.q_start), 1.5 * AHEAD, 700, "path", scene)
    depth = 2.0 - CoalJudge(scene.tree.mesh).clearance(report.state.segments)
    assert depth == pytest.approx(1.5 / (4.0 * 0.5), rel=0.05)


def test_bone_under_the_layer_stays_hard() -> None:
    """HAZ-01: five newtons would compress the layer by ten times what there is of it."""
    scene = straight_scene(wall(6.0), PATH)
    control = controller(scene, SoftZone("mucosa", 2.0, 0.25))
    for mode in ("free", "path"):
        report = pushed(control, control.start(scene.q_start), 5.0 * AHEAD, 250, mode, scene)
        clearance = CoalJudge(scene.tree.mesh).clearance(report.state.segments)
        assert SLOW.margin_mm <= clearance <= SLOW.margin_mm + 0.02


def test_the_deepest_contact_is_one_spring_however_many_pairs_there_are() -> None:
    """Inside a curved tube the whole tool touches the layer: still U = ½ k δ² of the deepest point."""
    scene = placed_scene(*curved_tube())
    soft, settings = SoftZone("mucosa", 3.0, 1.0), replace(SLOW, threshold_mm=4.0)
    control = controller(scene, soft, settings)
    assert scene.path is not None
    state = control.start(scene.q_start)
    side = np.array([1.0, 0.0, 0.0])  # across the plane of the bend: the tool meets the wall broadside
    depths = []
    for _ in range(600):
        state = control.step(state, MoveFreely(), HandCommand(1.2 * side)).state
        depths.append(soft.penetration(state, scene.tree))
    assert len(soft._pairs(state.segments, scene.tree, 0.0)) > 3
    assert depths[-1] == pytest.approx(1.2, rel=0.05)


@pytest.mark.parametrize("over", [Sphere([0.0, 8.0, 0.0], 3.0), HalfSpace([0.0, 6.0, 0.0], [0.0, -1.0, 0.0])])
def test_a_soft_shape_without_thickness_is_soft_itself(over: Sphere | HalfSpace) -> None:
    """The tip goes f / k deep into it; depth by a formula of its own."""
    scene = straight_scene(wall(60.0), PATH)
    soft = SoftZone("polyp", 0.0, 1.0, over)
    control = controller(scene, soft)
    report = pushed(control, control.start(scene.q_start), 0.6 * AHEAD, 900, "path", scene)
    tip, radius = report.state.tip.position, scene.tool.radius[0]
    if isinstance(over, Sphere):
        depth = over.radius + radius - np.linalg.norm(tip - over.centre)
    else:
        depth = tip[1] + radius - 6.0
    assert depth == pytest.approx(0.6, rel=0.05)


def test_without_a_hand_nothing_moves_and_with_a_light_one_nothing_jumps() -> None:
    """Deep in the layer the robot stands still when the hand lets go, and a light touch brings it out slowly."""
    scene = straight_scene(wall(6.0), PATH)
    soft = SoftZone("mucosa", 2.0, 2.0)
    control = controller(scene, soft)
    state = pushed(control, control.start(scene.q_start), 3.0 * AHEAD, 500, "free", scene).state
    depth = soft.penetration(state, scene.tree)
    assert depth > 1.3
    for _ in range(60):
        state = control.step(state, MoveFreely(), HandCommand(np.zeros(3))).state
    still = state.q
    for _ in range(5):
        state = control.step(state, MoveFreely(), HandCommand(np.zeros(3))).state
    np.testing.assert_array_equal(state.q, still)
    for force in (0.02 * AHEAD, -0.02 * AHEAD, np.array([0.02, 0, 0])):
        touched = state
        for _ in range(50):
            before = touched
            touched = control.step(touched, MoveFreely(), HandCommand(force)).state
            moved = np.linalg.norm(touched.tip.position - before.tip.position)
            assert moved <= 3.0 * 0.02 * SLOW.gain_mm_per_s_per_n * SLOW.dt_s
        assert soft.penetration(touched, scene.tree) < soft.penetration(state, scene.tree)


def test_what_slows_the_tool_is_named() -> None:
    scene = straight_scene(wall(6.0), PATH)
    control = controller(scene, SoftZone("mucosa", 2.0, 1.0))
    report = pushed(control, control.start(scene.q_start), 1.0 * AHEAD, 400, "path", scene)
    assert report.blockers[0].text == "mucosa, 1.0 mm deep"


def test_swinging_about_a_target_yields_to_tissue_as_well() -> None:
    """Inspection: the torque of the spring about the view's centre balances the hand's, within 5 %."""
    scene = replace(straight_scene(wall(60.0)), targets=np.array([[0.0, 13.0, 7.5]]), target_names=("t",))
    settings = replace(SLOW, target_tolerance_mm=0.05)
    goal = scene.targets[0]
    free = Controller(scene.placed_robot(), scene.tool, scene.tree, settings)
    state = free.start(scene.q_start)
    for _ in range(400):
        state = free.step(state, ApproachTarget(goal), HandCommand(np.array([2.0, 0, 0]))).state
    centre = view_point(state, scene.tool, settings.view_distance_mm)
    assert np.linalg.norm(centre - goal) < 0.5 * settings.target_tolerance_mm
    # A wall beside the shaft, which a torque about x swings into it.
    torque, arm = np.array([60.0, 0.0, 0.0]), state.segments.start[1]
    soft = SoftZone("fold", 0.0, 1.0, HalfSpace([0, 0, arm[2] - 3.0], [0, 0, 1.0]))
    control = Controller(scene.placed_robot(), scene.tool, scene.tree, settings, fixtures=(soft,))
    for _ in range(3000):
        state = control.step(state, InspectTarget(goal), HandCommand(torque=torque)).state
    depth = soft.penetration(state)
    assert depth > 0.05
    pair = soft._pairs(state.segments, None, 0.0)
    lever = pair.on_tool[0] - view_point(state, scene.tool, settings.view_distance_mm)
    assert abs(np.cross(lever, depth * 1.0 * pair.normal[0])[0]) == pytest.approx(60.0, rel=0.05)
