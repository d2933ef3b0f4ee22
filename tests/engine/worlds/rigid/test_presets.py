"""The papers' presets: their program, its fallback, r = 0, and 30 Hz over a servo."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.engine.scenes import curved_tube, placed_scene, straight_scene, wall
from vfix_engine.control import Controller, ControlSettings, HandCommand, build_step, solve_step
from vfix_engine.control.problem import Problem
from vfix_engine.control.program import Solution
from vfix_engine.control.qp import DUAL
from vfix_engine.control.tasks import FollowPath, InspectTarget, PathPoint
from vfix_engine.control.tasks.printed_path import DEMAND, PrintedPath, PrintedWeights
from vfix_engine.errors import InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.runtime import Command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.rigid.covariance_watch import CovarianceWatch
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.presets import OUTER_S, PRESETS
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.servo import ServoWatch, servo_poses
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec
from vfix_engine.worlds.rigid.system import RigidSystem

LINE = np.array([[0.0, 0.0, 0.0], [0.0, 10.0, 0.0], [2.0, 20.0, 0.0], [4.0, 30.0, 2.0]])


@pytest.mark.parametrize("name", PRESETS)
def test_the_rows_are_the_printed_ones(name: str) -> None:
    """(13) with rotation, (17) with ζ_k, (14), and W_j of (19), against the formulas in NumPy."""
    preset = PRESETS[name]
    scene = preset.in_scene(straight_scene(wall(2.0), LINE))
    settings = preset.in_settings(ControlSettings())
    controller = Controller(scene.placed_robot(), scene.tool, scene.tree, settings)
    state, path = controller.start(np.zeros(7)), SplinePath(LINE)
    near = PathPoint(*path.closest(state.tip.position))
    hand = HandCommand(np.array([0.2, 3.0, 0.4]))
    request = PrintedPath(path, near, preset.weights).request(state, hand)
    weights, jacobian = preset.weights, state.tip.jacobian
    desired = -FollowPath(path, near).request(state, hand).objectives[0].matrix[:3, -1]
    tip, pairs = request.objectives
    scales = np.array([weights.tip_mm] * 3 + [weights.tip_rad] * 3)
    np.testing.assert_allclose(tip.matrix[:, :-1], scales[:, None] * jacobian, atol=1e-12)
    np.testing.assert_allclose(tip.target, np.append(weights.tip_mm * desired, np.zeros(3)), atol=1e-15)
    assert pairs.matrix.shape == (3 * len(state.pairs), 8)
    lever = state.pairs[0][4:7] - state.tip.position
    moved = jacobian[:3] + np.cross(jacobian[3:].T, lever).T
    np.testing.assert_allclose(pairs.matrix[:3, :-1], weights.near * moved, atol=1e-12)
    (demand,) = request.constraints
    size = np.linalg.norm(desired)
    np.testing.assert_allclose(demand.matrix[0, :-1] * size, -desired @ jacobian[:3], atol=1e-12)
    assert demand.bound[0] * size == pytest.approx(-(1 - weights.tolerance) * size**2)
    np.testing.assert_allclose(scene.robot.joint_weights * 0.01, preset.joints)
    assert not np.any(tip.matrix[:, -1])
    assert demand.kind == DEMAND
    assert build_step(state, PrintedPath(path, near, weights), (), hand).program.row_count > 14


@pytest.mark.parametrize("name", PRESETS)
def test_a_path_is_driven_at_30_hz(name: str) -> None:
    """The end is reached, the tip stays near the path, and bone at every tick of the servo."""
    mesh, points = curved_tube()
    preset = PRESETS[name]
    settings = preset.in_settings(ControlSettings())
    scene = preset.in_scene(placed_scene(mesh, points[:4], settings))
    watch, rehearsal = ServoWatch(), Rehearsal(scene, settings)
    trees = CovarianceWatch(rehearsal.controller)
    run = HeadlessRun(rehearsal, lambda snapshot: None, servo=watch, covariance=trees)
    assert settings.dt_s == OUTER_S
    assert run.follow().phase == "done"
    report = run.tally.report()
    assert report["tip_error_mm"]["mean"] < 0.1
    assert watch.ticks == 33 * report["steps"]
    assert watch.report()["min_bone_clearance_mm"] >= settings.margin_mm - 1e-3
    assert run.fallbacks < 0.2 * report["steps"]
    pairs = trees.report()
    assert pairs["poses"] == report["steps"]
    assert pairs["poses_with_other_pairs"] == 0, "the papers' tree and the product's find the same triangles"
    assert pairs["pairs"]["max"] > pairs["pairs"]["min"] >= 0
    assert pairs["grouped_pairs"]["max"] < pairs["pairs"]["max"]


def test_where_the_demand_has_no_solution_the_usual_program_goes_on(tmp_path: Path) -> None:
    """A wall across the path: steps are counted, nothing is deeper than the margin, and the run repeats."""
    preset = PRESETS["li2007"]
    scene = preset.in_scene(straight_scene(wall(8.0), LINE))
    settings = preset.in_settings(ControlSettings())
    spec = RigidSpec(SceneSpec.of(scene), settings)
    system = spec.build()
    writer = RunWriter(tmp_path / "one.run", spec, system.row_layout)
    driver = Driver(system, log=writer)
    for _ in range(90):
        state = driver.step(Command(np.zeros(3), drive=1))
        assert state.tool.clearance >= settings.margin_mm
    writer.close()
    assert state.fallbacks > 20
    assert state.last is not None
    assert state.last.report.held
    run = Run.read(tmp_path / "one.run")
    again = RigidSpec.from_parts(json.loads(json.dumps(run.manifest["spec"])), run.arrays)
    assert again.scene.printed == preset.weights
    assert replay(run, again).same


def test_a_tool_turns_about_its_own_tip() -> None:
    """r = 0: the tip is the virtual point, stays on the target and the tool turns."""
    scene = straight_scene(wall(90.0), LINE)
    settings = ControlSettings(dt_s=5e-3, view_distance_mm=0.0, target_tolerance_mm=0.1)
    controller = Controller(scene.placed_robot(), scene.tool, scene.tree, settings)
    state = controller.start(np.zeros(7))
    target, first = state.tip.position + np.array([0.02, 0.0, 0.0]), state.tip.rotation
    worst = 0.0
    for k in range(400):
        torque = 150.0 * np.array([np.cos(k / 60), 0.3, np.sin(k / 60)])
        state = controller.step(state, InspectTarget(target), HandCommand(torque=torque)).state
        worst = max(worst, float(np.linalg.norm(state.tip.position - target)))
    turned = np.degrees(np.arccos((np.trace(first.T @ state.tip.rotation) - 1.0) / 2.0))
    assert worst <= 0.1
    assert turned > 1.0


def test_the_servo_goes_straight_in_joint_space() -> None:
    before, after = np.zeros(7), np.arange(7.0)
    poses = servo_poses(before, after, OUTER_S)
    assert len(poses) == 33
    assert np.array_equal(poses[-1], after)
    np.testing.assert_allclose(np.diff(poses, axis=0), np.tile(after / 33, (32, 1)), atol=1e-12)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("near", -1.0, "the weight near is -1"),
        ("tip_mm", np.inf, "the weight tip_mm is inf"),
        ("tip_rad", np.nan, "the weight tip_rad is nan"),
        ("tolerance", 0.0, r"the tolerance of \(14\) is 0"),
        ("tolerance", 1.0, r"the tolerance of \(14\) is 1"),
    ],
)
def test_weights_that_make_no_program(field: str, value: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        replace(PrintedWeights(), **{field: value})


def test_another_solver_decides_on_its_own_program() -> None:
    """What is driven by another solver asks that one whether (14) has a solution."""
    preset = PRESETS["li2007"]
    asked: list[str] = []
    scene = preset.in_scene(straight_scene(wall(90.0), LINE))
    system = RigidSystem(scene, preset.in_settings(ControlSettings()), "daqp")

    def look(problem: Problem, solver: str = DUAL) -> Solution:
        asked.append(solver)
        return solve_step(problem, solver)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vfix_engine.worlds.rigid.system.solve_step", look)
        state = system.start()
        for _ in range(5):
            state = system.step(state, Command(np.zeros(3), drive=1))
    assert set(asked) == {"daqp"}
    assert state.fallbacks == 0


@pytest.mark.parametrize("name", PRESETS)
def test_what_is_not_printed_is_listed(name: str) -> None:
    report = PRESETS[name].report()
    assert {"k of (10)", "saturation of u", "accelerations"} <= set(report["assumed"])  # type: ignore[call-overload]
    assert json.loads(json.dumps(report)) == report
