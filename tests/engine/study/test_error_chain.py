"""The error chain: each stage against its formula, live against recorded, and labels that must not behave alike."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tests.engine.scenes import CoalJudge, curved_tube
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.registration import register_points
from vfix_engine.robots import Tool
from vfix_engine.runtime.command import Command, Master
from vfix_engine.runtime.control_mode import Control, ControlMode
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.requests import SetTask
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.error_chain import (
    PAPERS,
    Compliance,
    EncoderError,
    ErrorChain,
    HeadMotion,
    RegistrationError,
    Sample,
    ServoLag,
    TrueTool,
    Truth,
    TruthTally,
    sample_of,
)
from vfix_engine.study.error_chain.chain import FLE_MM
from vfix_engine.study.metrics import score_run
from vfix_engine.worlds.rigid.operators import PushingOperator
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec
from vfix_engine.worlds.rigid.system import RigidSystem

MESH, POINTS = curved_tube(radius=6.0)
SETTINGS = ControlSettings(dt_s=0.01, gain_mm_per_s_per_n=4.0)
EMPTY = ErrorChain()


@dataclass
class Drive:
    """A drive of half the tube, by a hand or by a master that moves alike; its run and its snapshots."""

    run: Run
    scene: Scene
    snapshots: list[RigidSnapshot] = field(default_factory=list)

    def tally(self, chain: ErrorChain) -> tuple[dict[str, Any], list[Truth]]:
        tally = TruthTally(chain, self.scene, SETTINGS.margin_mm)
        truths = [tally.add(one) for one in self.snapshots]
        return tally.report(), truths

    @property
    def on_path(self) -> np.ndarray:
        """Once the approach has arrived, as the tally of every rehearsal has it."""
        return np.maximum.accumulate([one.tip_error_mm <= 0.02 for one in self.snapshots])

    @property
    def tip(self) -> np.ndarray:
        return np.array([one.tip for one in self.snapshots])


def drive(folder: Path, mode: ControlMode, compensated: float = 0.0) -> Drive:
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange
    scene = SceneSpec(MESH.vertices, MESH.faces, "steady_hand", "bent_30", base, np.zeros(7), POINTS)
    spec = RigidSpec(scene, replace(SETTINGS, compliance_mm_per_n=compensated))
    system = spec.build()
    writer = RunWriter(folder / mode, spec, system.row_layout, control=Control(mode))
    driver = Driver(system, log=writer)
    found = Drive(Run({}, {}, np.zeros((0, 14)), (), True, 0), system.scene)
    for i in range(250):
        pull = 2.0 * np.array([np.sin(0.05 * i), np.cos(0.05 * i), 0.0]) + [0.0, 0.0, 1.0]
        tangent = driver.state.nearest.tangent
        force = 4.0 * tangent + pull - (pull @ tangent) * tangent
        force = force * (1.0 if i < 230 else 0.0)
        master = None if mode == "hands-on" else Master(0.08 * tangent)
        driver.step(Command(force, master=master))
        found.snapshots.append(system.snapshot(driver.state))
    writer.close()
    return replace(found, run=Run.read(folder / mode))


@pytest.fixture(scope="module")
def hands_on(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    return drive(tmp_path_factory.mktemp("errors"), "hands-on")


@pytest.fixture(scope="module")
def teleoperated(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    return drive(tmp_path_factory.mktemp("errors"), "teleoperated")


def test_an_empty_chain_has_the_tip_error_and_the_certified_clearance(hands_on: Drive) -> None:
    report, truths = hands_on.tally(EMPTY)
    errors = np.array([one.tip_error_mm for one in hands_on.snapshots])[hands_on.on_path]
    assert report["true_error_mm"] == {"mean": errors.mean(), "max": errors.max()}
    assert report["error_chain"] == dict.fromkeys(("registration", "encoders", "servo", "compliance", "head")) | {
        "seed": 0
    }
    least = min(one.clearance_mm for one in hands_on.snapshots)
    truth = {"largest_difference_mm": 0.0, "min_true_clearance_mm": least, "steps_below_margin": 0, "steps_in_bone": 0}
    assert report["truth"] == truth
    np.testing.assert_allclose(truths[-1].segments.start, hands_on.snapshots[-1].segments_start, atol=1e-9)
    score = score_run(hands_on.run, errors=EMPTY)
    assert score.path_error_mm is not None
    assert score.path_error_mm.true_frame == score.path_error_mm.robot_frame
    assert score.truth == pytest.approx(truth)


def test_a_pure_shift_has_the_analytic_error_at_every_sample(hands_on: Drive) -> None:
    shift = np.array([0.4, -0.2, 0.3])
    chain = ErrorChain(RegistrationError(tuple(shift)))
    report, truths = hands_on.tally(chain)
    np.testing.assert_allclose([one.true - one.believed for one in truths], np.tile(shift, (250, 1)), atol=1e-12)
    chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(POINTS, axis=0), axis=1))])
    curve = make_interp_spline(chords, POINTS, k=5)(np.linspace(0.0, chords[-1], 100_001))
    on_path = hands_on.on_path
    away = cKDTree(curve).query(hands_on.tip[on_path] + shift)[0]
    assert report["true_error_mm"] == pytest.approx({"mean": away.mean(), "max": away.max()}, abs=1e-4)
    # Across a straight path it is the shift itself, along it nothing.
    tangent = np.array([hands_on.scene.path.closest(tip)[2] for tip in hands_on.tip[on_path]])
    across = np.linalg.norm(shift - (tangent @ shift)[:, None] * tangent, axis=1)
    beyond_the_ends = np.array([one.progress_mm for one in hands_on.snapshots])[on_path] > 1.0
    assert np.abs(away - across)[beyond_the_ends].max() < 0.005, "the curve's own bend over half a millimetre"
    score = score_run(hands_on.run, errors=chain).path_error_mm
    assert score == score_run(hands_on.run, transform_believed_to_true=chain.registration.transform).path_error_mm
    assert score.true_frame.mean == pytest.approx(report["true_error_mm"]["mean"], rel=1e-3)  # other first samples
    with pytest.raises(InputError, match="not both"):
        score_run(hands_on.run, transform_believed_to_true=np.eye(4), errors=EMPTY)


def test_a_hand_on_the_robot_deflects_it_by_its_force_and_a_master_does_not(
    hands_on: Drive, teleoperated: Drive
) -> None:
    chain = ErrorChain(compliance=Compliance(0.25))
    report, truths = hands_on.tally(chain)
    force = np.array([one.force for one in hands_on.snapshots])
    assert np.linalg.norm(force, axis=1).max() > 4.0
    moved = np.array([one.true - one.believed for one in truths])
    np.testing.assert_allclose(moved, 0.25 * force, atol=1e-12)
    assert report["truth"]["largest_difference_mm"] == pytest.approx(0.25 * np.linalg.norm(force, axis=1).max())
    remote, _ = teleoperated.tally(chain)
    assert np.linalg.norm([one.force for one in teleoperated.snapshots], axis=1).max() > 0.5, "the spring has a force"
    assert teleoperated.snapshots[-1].progress_mm > 5.0
    assert remote["truth"]["largest_difference_mm"] == 0.0
    assert remote["true_error_mm"]["mean"] < 0.1 * report["true_error_mm"]["mean"]
    for each, mode in ((hands_on, "hands-on"), (teleoperated, "teleoperated")):
        score = score_run(each.run, errors=chain)
        assert score.mode == mode
        assert score.truth == pytest.approx(each.tally(chain)[0]["truth"])
    # The weight of the pushing hand, which no zeroed sensor shows.
    weighed = hands_on.tally(ErrorChain(compliance=Compliance(0.25, hand_weight_n=1.2)))[1]
    more = np.array([one.true for one in weighed]) - [one.true for one in truths]
    np.testing.assert_allclose(more, force.any(axis=1)[:, None] * [0.0, 0.3, 0.0], atol=1e-12)


def test_the_true_clearance_is_that_of_another_library_and_what_is_below_the_margin_is_counted(
    hands_on: Drive,
) -> None:
    chain = ErrorChain(RegistrationError((1.5, 0.0, 0.0), (0.0, 0.01, 0.0), tuple(POINTS[0])), seed=1)
    report, truths = hands_on.tally(chain)
    judge = CoalJudge(MESH)
    found = np.array([min(judge.clearance(one.segments), SETTINGS.reach_mm) for one in truths])
    assert report["truth"]["min_true_clearance_mm"] == pytest.approx(found.min(), abs=1e-6)
    assert found.min() < min(one.clearance_mm for one in hands_on.snapshots)
    deep = ErrorChain(RegistrationError((4.4, 0.0, 0.0)))
    report, truths = hands_on.tally(deep)
    found = np.array([min(judge.clearance(one.segments), SETTINGS.reach_mm) for one in truths])
    counted = report["truth"]["steps_below_margin"], report["truth"]["steps_in_bone"]
    assert counted == ((found < SETTINGS.margin_mm).sum(), (found <= 0.0).sum())
    assert counted[0] > counted[1] > 0


def test_a_compensated_deflection_leaves_the_true_tip_on_the_path_and_the_true_tool_outside_the_margin(
    hands_on: Drive, tmp_path: Path
) -> None:
    chain = ErrorChain(compliance=Compliance(0.15))
    bent, _ = hands_on.tally(chain)
    driven = drive(tmp_path, "hands-on", compensated=0.15)
    straight, truths = driven.tally(chain)
    assert driven.snapshots[-1].progress_mm > 5.0
    np.testing.assert_allclose([one.true for one in truths], [one.believed for one in truths], atol=1e-12)
    assert straight["true_error_mm"]["mean"] < 0.2 * bent["true_error_mm"]["mean"]
    assert straight["truth"]["steps_below_margin"] == 0
    assert min(one.clearance_mm for one in driven.snapshots) >= SETTINGS.margin_mm + 0.15 * SETTINGS.force_cap_n
    errors = np.array([one.tip_error_mm for one in driven.snapshots])[driven.on_path]
    assert straight["true_error_mm"]["mean"] == pytest.approx(errors.mean()), "what the robot believes is true"
    score = score_run(driven.run, errors=chain)
    assert score.path_error_mm.robot_frame == score.path_error_mm.true_frame
    assert score.path_error_mm.true_frame.mean == pytest.approx(errors.mean(), rel=0.05)
    # One that compensates twice what is there leaves half of it, on the other side.
    wrong, _ = driven.tally(EMPTY)
    assert wrong["truth"]["largest_difference_mm"] == pytest.approx(bent["truth"]["largest_difference_mm"], rel=0.2)


def test_a_master_is_not_compensated_for(tmp_path: Path, teleoperated: Drive) -> None:
    driven = drive(tmp_path, "teleoperated", compensated=0.15)
    assert not np.any([one.deflection for one in driven.snapshots])
    np.testing.assert_allclose(driven.tip, teleoperated.tip, atol=0.05)  # the margin alone is another


def test_a_rate_device_bends_nothing_and_is_not_compensated_for(tmp_path: Path, hands_on: Drive) -> None:
    system = RigidSystem(hands_on.scene, replace(SETTINGS, compliance_mm_per_n=0.15))
    state = system.start()
    push = Command(3.0 * state.nearest.tangent)
    assert np.linalg.norm(system.step(state, push).deflection) == pytest.approx(0.45)
    device = system.step(state, replace(push, rate=True))
    assert not device.deflection.any()
    bent = TrueTool(ErrorChain(compliance=Compliance(0.15)), system.scene.tool, system.scene.placed_robot())
    truth = bent.at(sample_of(system.snapshot(device), system.scene.tool))
    assert truth.difference_mm == 0.0


def test_a_hand_that_pushes_into_bone_with_all_its_force_finds_the_margin_kept_where_it_is_compensated() -> None:
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange
    spec = SceneSpec(MESH.vertices, MESH.faces, "steady_hand", "bent_30", base, np.zeros(7), POINTS)
    chain, below = ErrorChain(compliance=Compliance(0.15)), {}
    for compensated in (0.0, 0.15):
        settings = replace(SETTINGS, compliance_mm_per_n=compensated)
        system = RigidSystem(spec.build(), settings)
        tally = TruthTally(chain, system.scene, settings.margin_mm)
        operator, driver = PushingOperator(2), Driver(system)
        driver.apply(SetTask("free"))
        for _ in range(400):
            tally.add(system.snapshot(driver.act(operator(system, driver.state))))
        below[compensated] = tally.report()["truth"]
    assert below[0.0]["steps_below_margin"] > 10
    assert below[0.15]["steps_below_margin"] == 0
    assert below[0.15]["min_true_clearance_mm"] >= SETTINGS.margin_mm


def samples(scene: Scene, q: np.ndarray, dt_s: float) -> list[Sample]:
    """Samples of a motion of the joints (n, dof) from t = 0 on."""
    robot, found = scene.placed_robot(), []
    for i, joints in enumerate(q):
        rotation, position = robot.tip_pose(joints)
        found.append(Sample(i * dt_s, i, joints, position, rotation, None, np.zeros(3)))
    return found


def true_tips(chain: ErrorChain, scene: Scene, given: list[Sample]) -> np.ndarray:
    follower = TrueTool(chain, scene.tool, scene.placed_robot())
    return np.array([follower.at(one).true for one in given])


def test_a_servo_lags_behind_a_steady_motion_by_its_time_however_often_it_is_looked_at(hands_on: Drive) -> None:
    scene, chain = hands_on.scene, ErrorChain(servo=ServoLag(0.05))
    q = np.zeros((400, 7))
    q[:, 0] = 8.0 * 0.002 * np.arange(400)  # a prismatic joint along x, 8 mm/s
    fine = samples(scene, q, 0.002)
    behind = np.array([one.position for one in fine]) - true_tips(chain, scene, fine)
    assert np.linalg.norm(behind[-1]) == pytest.approx(8.0 * 0.05, rel=1e-6)
    expected = 8.0 * 0.05 * (1.0 - np.exp(-0.002 * np.arange(400) / 0.05))
    np.testing.assert_allclose(np.linalg.norm(behind, axis=1), expected, atol=1e-9)
    np.testing.assert_allclose(true_tips(chain, scene, fine[::20]), true_tips(chain, scene, fine)[::20], atol=1e-9)


def test_backlash_is_lost_at_a_reversal_only(hands_on: Drive) -> None:
    scene, chain = hands_on.scene, ErrorChain(encoders=EncoderError(backlash_mm=0.2))
    q = np.zeros((300, 7))
    q[:, 0] = np.concatenate([np.linspace(0, 2, 100), np.linspace(2, 1, 100), np.full(100, 1.0)])
    given = samples(scene, q, 0.01)
    off = (true_tips(chain, scene, given) - [one.position for one in given])[:, 0]
    assert off[0] == 0.0
    assert off[99] == pytest.approx(-0.1)  # half the play behind
    assert off[199] == pytest.approx(0.1)  # on its other side
    assert off[299] == pytest.approx(0.1)  # a joint at rest stays there
    assert np.abs(off).max() == pytest.approx(0.1)
    turning = ErrorChain(encoders=EncoderError(backlash_rad=0.01))
    np.testing.assert_array_equal(true_tips(turning, scene, given), [one.position for one in given])


def test_the_encoders_noise_has_its_size_and_belongs_to_its_step(hands_on: Drive) -> None:
    scene, chain = hands_on.scene, ErrorChain(encoders=EncoderError(noise_mm=0.01), seed=3)
    given = samples(scene, np.zeros((2000, 7)), 0.001)
    off = true_tips(chain, scene, given) - given[0].position
    # Of the four prismatic joints three are along x, y, z and one along the shaft.
    assert np.sqrt((off**2).sum(axis=1).mean()) == pytest.approx(0.02, rel=0.05)
    np.testing.assert_array_equal(true_tips(chain, scene, given[5::7]), (off + given[0].position)[5::7])
    assert (true_tips(replace(chain, seed=4), scene, given[:5]) != true_tips(chain, scene, given[:5])).any()


def test_a_return_to_the_start_begins_anew(hands_on: Drive) -> None:
    q = np.zeros((50, 7))
    q[:, 0] = np.linspace(0, 2, 50)
    given = samples(hands_on.scene, q, 0.01)
    chain = ErrorChain(None, EncoderError(0.01, 1e-4, 0.2, 1e-3), ServoLag(0.03))
    follower = TrueTool(chain, hands_on.scene.tool, hands_on.scene.placed_robot())
    first = [follower.at(one).true for one in given]
    np.testing.assert_array_equal(follower.at(given[-1]).true, first[-1])
    np.testing.assert_array_equal([follower.at(one).true for one in given], first)


def test_a_moving_head_leaves_its_motion_and_a_followed_one_what_the_reference_is_late_by(hands_on: Drive) -> None:
    head = HeadMotion(0.5, period_s=4.0, direction=(0.0, 0.0, 2.0))
    t = np.array([one.t for one in hands_on.snapshots])
    swing = 0.5 * np.sin(2.0 * np.pi * t / 4.0)
    for stage, expected in (
        (head, swing),
        (replace(head, followed=True, delay_s=0.1), swing - 0.5 * np.sin(2.0 * np.pi * np.maximum(t - 0.1, 0.0) / 4.0)),
    ):
        moved = [one.true - one.believed for one in hands_on.tally(ErrorChain(head=stage))[1]]
        np.testing.assert_allclose(moved, -expected[:, None] * [0.0, 0.0, 1.0], atol=1e-12)
    assert np.abs(expected).max() < 0.2 * np.abs(swing).max()


def test_a_drawn_registration_is_as_wrong_as_its_fiducials_say() -> None:
    beads = np.array([bead.centroid for bead in load_landmarks().beads])
    place = np.array(load_landmarks().corridor[3].position)
    residuals, errors = [], []
    for seed in range(400):
        drawn = RegistrationError.drawn(beads, FLE_MM, seed)
        motion = drawn.transform
        errors.append(motion[:3, :3] @ place + motion[:3, 3] - place)
        off = np.random.default_rng(seed).normal(0.0, FLE_MM / np.sqrt(3.0), beads.shape)
        residuals.append(register_points(beads + off, beads).mean_residual_mm)
    assert np.mean(residuals) == pytest.approx(0.473, abs=0.02)  # Li 2007, section V.B
    predicted = register_points(beads, beads).tre_mm(place, FLE_MM)
    assert np.sqrt(np.mean(np.square(errors).sum(axis=1))) == pytest.approx(float(np.squeeze(predicted)), rel=0.1)
    turn = Rotation.from_rotvec(drawn.turn_rad).as_matrix()
    np.testing.assert_allclose(turn, motion[:3, :3], atol=1e-12)
    about = np.array(drawn.about_mm)
    np.testing.assert_allclose(motion[:3, :3] @ about + motion[:3, 3] - about, drawn.shift_mm, atol=1e-9)


def test_a_run_is_followed_as_it_was_live(hands_on: Drive) -> None:
    beads = [bead.centroid for bead in load_landmarks().beads]
    chain = replace(ErrorChain.papers(beads, 5, POINTS[0]), head=HeadMotion(0.3))
    report, _ = hands_on.tally(chain)
    score = score_run(hands_on.run, errors=chain)
    assert score.truth == pytest.approx(report["truth"], abs=1e-9)
    assert 0.05 < report["true_error_mm"]["mean"] < 2.0
    one = hands_on.snapshots[30]
    pose = sample_of(one, hands_on.scene.tool)
    rotation, _ = hands_on.scene.placed_robot().tip_pose(one.q)
    np.testing.assert_allclose(pose.rotation, rotation, atol=1e-12)


def test_a_free_hand_has_no_stage_of_a_robot(hands_on: Drive) -> None:
    chain = ErrorChain(
        RegistrationError((0.5, 0.0, 0.0)), EncoderError(backlash_mm=1.0), ServoLag(0.1), Compliance(0.3, 2.0)
    )
    tool = TrueTool(chain, hands_on.scene.tool, None)
    truth = tool.at(sample_of(hands_on.snapshots[40], hands_on.scene.tool)._replace(q=None, force=None))
    np.testing.assert_allclose(truth.true - truth.believed, [0.5, 0.0, 0.0], atol=1e-12)


def test_a_chain_is_read_as_it_was_written_and_what_is_not_one_is_refused(tmp_path: Path) -> None:
    chain = replace(
        ErrorChain.papers([[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]]), head=HeadMotion(1.0, followed=True)
    )
    file = tmp_path / "errors.json"
    file.write_text(json.dumps({"schema": "vfix-errors/1"} | chain.to_dict()))
    assert ErrorChain.read(file) == chain
    printed = {name for name in PAPERS if "." in name}
    sizes = {f"{stage}.{key}" for stage in ("encoders", "servo", "compliance") for key in chain.to_dict()[stage]}
    assert printed == sizes, "each size of the papers' chain says where it is from"
    for content in (
        {},
        {"schema": "vfix-errors/1", "servo": {"time_s": -1.0}},
        {"schema": "vfix-errors/1", "servo": {}},
        {"schema": "vfix-errors/1", "servos": None},
        {"schema": "vfix-errors/1", "compliance": {"mm_per_n": "soft"}},
        {"schema": "vfix-errors/1", "head": {"amplitude_mm": 1.0, "followed": 1}},
        {"schema": "vfix-errors/1", "head": {"amplitude_mm": 1.0, "direction": [0, 0, 0]}},
        {"schema": "vfix-errors/1", "registration": {"shift_mm": [1, 2]}},
        {"schema": "vfix-errors/1", "seed": -1},
        [],
    ):
        file.write_text(json.dumps(content))
        with pytest.raises(InputError):
            ErrorChain.read(file)
    with pytest.raises(InputError):
        ErrorChain.read(tmp_path / "nowhere.json")
    with pytest.raises(InputError):
        ErrorChain(servo=Compliance(0.1))  # type: ignore[arg-type]
