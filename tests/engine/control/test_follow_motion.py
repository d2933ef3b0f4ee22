"""A motion from outside as a task's input, and the approach to a chosen point of a path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import Controller, ControlSettings, HandCommand
from vfix_engine.control.tasks import ApproachPath, DesiredMotion, DesiredPose, FollowMotion, MoveFreely, PathPoint
from vfix_engine.errors import ControlError, InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.runtime import Command, SetTask
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.requests import ApproachPoint
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

SETTINGS = ControlSettings(dt_s=5e-3)
LINE = np.array([[0.0, 0.0, 0.0], [0.0, 10.0, 0.0], [2.0, 20.0, 0.0], [4.0, 30.0, 2.0]])


def controller_before(distance: float) -> Controller:
    scene = straight_scene(wall(distance))
    return Controller(scene.placed_robot(), scene.tool, scene.tree, SETTINGS)


def test_a_velocity_from_outside_is_made() -> None:
    controller = controller_before(90.0)
    state = controller.start(np.zeros(7))
    motion = DesiredMotion(np.array([3.0, 1.0, -2.0]), np.array([0.02, 0.0, 0.03]))
    for _ in range(60):
        state = controller.step(state, FollowMotion(), motion).state
    np.testing.assert_allclose(state.tip.jacobian @ state.velocity, [3.0, 1.0, -2.0, 0.02, 0.0, 0.03], atol=2e-3)
    for _ in range(60):
        state = controller.step(state, FollowMotion(), DesiredMotion()).state
    assert not state.velocity.any()


def test_a_pose_from_outside_is_reached_and_kept() -> None:
    controller = controller_before(90.0)
    state = controller.start(np.zeros(7))
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.04, 0.1, -0.05]).as_matrix() @ state.tip.rotation
    pose[:3, 3] = [4.0, 6.0, -3.0]
    fastest, gaps = 0.0, []
    for _ in range(900):
        state = controller.step(state, FollowMotion(), DesiredPose(pose, speed_mm_per_s=6.0)).state
        fastest = max(fastest, float(np.linalg.norm(state.tip.jacobian[:3] @ state.velocity)))
        gaps.append(np.linalg.norm(state.tip.position - pose[:3, 3]))
    assert 5.5 < fastest <= 6.0 * (1 + 1e-3)
    assert gaps[-1] < 1e-3
    assert Rotation.from_matrix(pose[:3, :3] @ state.tip.rotation.T).magnitude() < 1e-4


def test_a_motion_from_outside_stops_before_bone() -> None:
    """HAZ-01: it is certified as any other, and what holds it is told."""
    controller = controller_before(6.0)
    state, pose = controller.start(np.zeros(7)), np.eye(4)
    pose[:3, :3], pose[:3, 3] = state.tip.rotation, [0.0, 30.0, 0.0]
    for _ in range(700):
        report = controller.step(state, FollowMotion(), DesiredPose(pose, 30.0))
        state = report.state
        assert state.clearance >= SETTINGS.margin_mm
    assert report.held
    assert report.blockers[0].kind == "bone"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: DesiredMotion(np.array([1.0, np.nan, 0.0])), "three finite numbers in mm/s"),
        (lambda: DesiredMotion(turn=np.zeros(2)), "three finite numbers in rad/s"),
        (lambda: DesiredPose(np.zeros((4, 4))), "rigid transform"),
        (lambda: DesiredPose(np.diag([1.0, 1.0, -1.0, 1.0])), "rigid transform"),
        (lambda: DesiredPose(np.full((4, 4), np.nan)), "rigid transform"),
        (lambda: DesiredPose(np.eye(3)), "rigid transform"),
        (lambda: DesiredPose(np.eye(4), np.inf), "finite number above 0"),
    ],
)
def test_what_is_no_motion(make: object, words: str) -> None:
    """HAZ-05."""
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]


def test_a_hand_is_no_motion_from_outside() -> None:
    controller = controller_before(90.0)
    with pytest.raises(InputError, match="DesiredMotion or a DesiredPose"):
        controller.step(controller.start(np.zeros(7)), FollowMotion(), HandCommand())
    with pytest.raises(InputError, match="HandCommand"):
        controller.step(controller.start(np.zeros(7)), MoveFreely(), DesiredMotion())


def test_the_task_approaches_a_chosen_point() -> None:
    controller, path = controller_before(90.0), SplinePath(LINE)
    state, chosen = controller.start(np.zeros(7)), PathPoint.at(path, 12.5)
    for _ in range(500):
        state = controller.step(state, ApproachPath(path, chosen), HandCommand(np.array([0.0, 0.0, 4.0]))).state
    np.testing.assert_allclose(state.tip.position, path.position(12.5), atol=0.01)
    assert PathPoint.at(path, 99.0).s == path.length


def test_a_rehearsal_approaches_the_chosen_point_then_follows_from_it() -> None:
    """Li 2004, V; the tip is on the path already and is led to another of its points."""
    rehearsal = Rehearsal(straight_scene(wall(90.0), LINE + np.array([0.0, 0.0, 0.5])), SETTINGS)
    state = rehearsal.system.apply(rehearsal.start(), ApproachPoint(15.0))
    assert state.phase == "approach"
    places = []
    while state.phase == "approach":
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
        places.append(state.tool.position)
    assert snapshot.progress_mm == pytest.approx(15.0, abs=0.2)
    way = np.array(places)
    goal = rehearsal.scene.path.position(15.0)  # type: ignore[union-attr]
    along = goal / np.linalg.norm(goal)
    assert np.linalg.norm(way - np.outer(way @ along, along), axis=1).max() < 0.01  # straight, not along the path
    while state.phase == "follow":
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
    assert state.phase == "done"
    assert rehearsal.system.apply(state, SetTask("free")).chosen is None
    with pytest.raises(ControlError, match="no point at 99"):
        rehearsal.system.apply(state, ApproachPoint(99.0))
    with pytest.raises(ControlError, match="no point at nan"):
        rehearsal.system.apply(state, ApproachPoint(np.nan))


def test_a_run_with_a_chosen_point_repeats_to_the_last_bit(tmp_path: Path) -> None:
    """HAZ-13."""
    scene = straight_scene(wall(90.0), LINE)
    spec = RigidSpec(SceneSpec.of(scene), SETTINGS)
    system = spec.build()
    writer = RunWriter(tmp_path / "one.run", spec, system.row_layout)
    driver = Driver(system, log=writer)
    driver.apply(ApproachPoint(5.0))
    for k in range(400):
        driver.step(Command(np.array([0.1, 0.0, np.sin(k / 30)]), drive=1))
    writer.close()
    run = Run.read(tmp_path / "one.run")
    assert replay(run, RigidSpec.from_parts(run.manifest["spec"], run.arrays)).same
    headless = HeadlessRun(Rehearsal(scene, SETTINGS), lambda snapshot: None, begin_mm=5.0)
    assert headless.follow().phase == "done"
    assert headless.tally.approach > 50
