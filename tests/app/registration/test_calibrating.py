"""Calibrations: the pointer's tip and the robot's tracker from tables and simulated, and registrations to the base."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from edited_registrations import Edited
from registration_poses_cases import TRACKER_TO_BASE, paired_poses, swung, table
from rest_client import CASE, Client
from scipy.spatial.transform import Rotation

from app.cases.model import HEAD_PHANTOM
from app.kit.errors import DocumentConflict, DocumentLocked
from app.operations.standard import SetLocked, Undo
from app.plans.operations.instruments import UseRegistration
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.calibrating import Calibrating
from app.registration.calibration import (
    motion_covariance,
    robot_of,
    simulated_robot,
    tracked_through,
)
from app.registration.calibration_operations import ClearPointer, ClearRobot, SimulatePointer, SimulateRobot
from app.registration.calibration_records import PointerTip, pointer_cautions, robot_cautions
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.driven import driven_registration
from app.registration.files import read_measured
from app.registration.fit_report import refitted, report_of
from app.registration.operations import AddPair, ClearMeasured, RegisterTo, TouchPair
from app.registration.pose_tables import paired, read_poses
from app.registration.service import PlanRegistration
from app.registration.simulated_touch import simulated_pose, simulated_tracker_to_base
from app.registration.target_errors import error_table, expected_errors
from app.services import Services
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.errors import InputError
from vfix_engine.registration import calibrate_pivot, register_points, register_robot_to_tracker, target_errors_mm

BEADS = [tuple(bead.centroid.tolist()) for bead in load_landmarks().beads]
HEAD_TURN = Rotation.from_euler("xyz", [10.0, 20.0, 30.0], degrees=True).as_matrix()


@pytest.fixture
def calibrating(phantom_services: Services) -> Calibrating:
    return phantom_services.registering.calibrating


@pytest.fixture
def made(phantom_services: Services) -> Iterator[str]:
    """The id of an empty registration; what else is made meanwhile is deleted too."""
    before = {one.id for one in phantom_services.registrations.titles(HEAD_PHANTOM)}
    yield phantom_services.registrations.create(HEAD_PHANTOM, "Calibrated").id
    for one in phantom_services.registrations.titles(HEAD_PHANTOM):
        if one.id not in before:
            phantom_services.registrations.editor(one.id).set_locked(False)
            phantom_services.registrations.delete(one.id)


def measured_content(**fields: Any) -> RegistrationContent:
    """Five beads that a tracker measured exactly."""
    pairs = tuple(
        FiducialPair(f"B{n}", place, tuple((HEAD_TURN @ place + [50.0, 60.0, 70.0]).tolist()), f"b{n}")
        for n, place in enumerate(BEADS)
    )
    return refitted(replace(RegistrationContent(pairs=pairs, fle_mm=0.5), **fields))


# -- tables


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_a_table_of_poses_comes_as_it_was_written(unit: str) -> None:
    poses = swung()
    read = read_poses(table(poses, "pointer_to_tracker", unit=unit), "pointer_to_tracker")
    assert read.numbers is None
    np.testing.assert_allclose(read.poses, poses, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "unit"),
        ("# unit=mm\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "# pose=pointer_to_tracker"),
        ("# unit=mm\n# pose=flange_to_base\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "poses of the robot's flange"),
        ("# unit=mm\n# pose=stylus\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "not known"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z\n1,2,3\n", "names its columns"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n", "no poses"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,2\n", "line 4 .*unit quaternion"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,nan\n", "unit quaternion"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0\n", "6 cells for 7 columns"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1,9\n", "8 cells for 7 columns"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1", "may be incomplete"),
        ("# unit=mm\n# pose=pointer_to_tracker\nnumber,x,y,z,qx,qy,qz,qw\n-1,1,2,3,0,0,0,1\n", "whole numbers"),
        (
            "# unit=mm\n# pose=pointer_to_tracker\nnumber,x,y,z,qx,qy,qz,qw\n1,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1\n",
            "different in each row",
        ),
        (
            "# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n0,0,0,0,0,0,1\n0,0,0,0,0,0,-1\n",
            "2 rows have the identity as pose, first line 5; .* out of sight",
        ),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0\n", "line 4 .* unseen tool"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1,5,2,5,3,5,0,0,0,1\n", "decimal commas"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,x,y,z,qx,qy,qz,qw\n1,1,2,3,0,0,0,1\n", "two columns"),
        ("# unit=mm\n# pose=pointer_to_tracker\nx,y,z,qx,qy,qz,qw\n1_0,2,3,0,0,0,1\n", "must be numbers"),
    ],
)
def test_a_table_of_poses_that_leaves_something_open_is_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_poses(text.encode(), "pointer_to_tracker")


def test_poses_are_paired_by_their_numbers_or_their_rows() -> None:
    robot, tracker = paired_poses()
    of_robot = read_poses(table(robot, "flange_to_base", numbers=list(range(20))), "flange_to_base")
    order = [7, 3, *range(8, 20), 40]
    mixed = table(tracker[[*order[:-1], 0]], "marker_to_tracker", numbers=order)  # 40 is in one table alone
    of_tracker = read_poses(mixed, "marker_to_tracker")
    a, b = paired(of_robot, of_tracker)
    np.testing.assert_allclose(a, robot[sorted(order[:-1])], atol=1e-9)
    np.testing.assert_allclose(b, tracker[sorted(order[:-1])], atol=1e-9)
    plain = read_poses(table(tracker, "marker_to_tracker"), "marker_to_tracker")
    with pytest.raises(InputError, match="number both"):
        paired(of_robot, plain)
    fewer = read_poses(table(robot[:8], "flange_to_base"), "flange_to_base")
    with pytest.raises(InputError, match="8 robot poses and 20 tracker poses"):
        paired(fewer, plain)
    other = read_poses(table(tracker, "marker_to_tracker", numbers=list(range(50, 70))), "marker_to_tracker")
    with pytest.raises(InputError, match="no number stands in both"):
        paired(of_robot, other)


# -- kept with a registration


def test_the_tip_and_the_robot_are_those_of_the_engine_and_can_be_taken_back(
    phantom_services: Services, calibrating: Calibrating, made: str
) -> None:
    poses, (robot, tracker) = swung(), paired_poses()
    kept = calibrating.read_pointer(made, table(poses, "pointer_to_tracker")).content.pointer
    found = calibrate_pivot(poses)
    assert kept is not None
    np.testing.assert_allclose(kept.tip, found.tip_mm, atol=1e-6)
    assert (kept.poses, kept.measured_from) == (40, "file")
    assert (kept.residual_mm, kept.tip_error_mm, kept.swing_deg) == pytest.approx(
        (found.residual_mm, found.tip_error_mm, found.swing_deg), abs=1e-6
    )
    tables = table(robot, "flange_to_base"), table(tracker, "marker_to_tracker")
    stored = calibrating.read_robot(made, *tables).content.robot
    expected = register_robot_to_tracker(robot, tracker)
    assert stored is not None
    np.testing.assert_allclose(np.reshape(stored.transform, (4, 4)), expected.transform_tracker_to_base, atol=1e-6)
    np.testing.assert_allclose(np.reshape(stored.covariance, (6, 6)), expected.covariance, rtol=1e-3, atol=1e-9)
    assert np.linalg.norm(np.reshape(stored.transform, (4, 4))[:3, 3] - TRACKER_TO_BASE[:3, 3]) < 2.0
    editor = Edited(phantom_services, made)
    assert editor.do(ClearPointer()).content.pointer is None
    assert editor.do(Undo()).content.pointer == kept
    assert editor.do(Undo()).content.robot is None
    with pytest.raises(InputError, match="was swung by"):
        calibrating.read_pointer(made, table(np.repeat(poses[:1], 8, axis=0), "pointer_to_tracker"))


def test_what_is_doubtful_is_said() -> None:
    assert pointer_cautions(PointerTip((0.0, 0.0, 0.0), 0.2, 0.1, 35.0, 60, "file")) == ()
    slipped = pointer_cautions(PointerTip((0.0, 0.0, 0.0), 1.4, 0.1, 12.0, 60, "file"))
    assert "1.4 mm off" in slipped[0]
    assert "12°" in slipped[1]
    robot, tracker = paired_poses(8)
    assert "8 poses" in robot_cautions(robot_of(robot, tracker, "file"))[0]
    robot, tracker = paired_poses()
    assert robot_cautions(robot_of(robot, tracker, "file")) == ()
    with pytest.raises(InputError, match="different moments"):
        robot_of(robot, np.roll(tracker, 1, axis=0), "file")
    loose = replace(robot_of(robot, tracker, "file"), translation_residual_mm=1.5)
    assert "different moments" in robot_cautions(loose)[0]


def test_a_simulated_calibration_is_as_exact_as_it_says(phantom_services: Services, made: str) -> None:
    exact = Edited(phantom_services, made).do(SimulateRobot(noise_mm=0.0)).content.robot
    assert exact is not None
    truth = simulated_tracker_to_base(HEAD_PHANTOM)
    np.testing.assert_allclose(np.reshape(exact.transform, (4, 4)), truth, atol=1e-6)
    place = simulated_pose(HEAD_PHANTOM) @ [*BEADS[0], 1.0]
    errors, told = [], []
    for seed in range(40):
        robot = simulated_robot(HEAD_PHANTOM, 0.3, seed)
        matrix, covariance = np.reshape(robot.transform, (4, 4)), np.reshape(robot.covariance, (6, 6))
        errors.append(np.linalg.norm((matrix - truth) @ place))
        x, y, z = (truth @ place)[:3]
        rows = np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
        told.append(np.trace(rows @ covariance @ rows.T))
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.sqrt(np.mean(told)), rel=0.25)
    tip = Edited(phantom_services, made).do(SimulatePointer(noise_mm=0.3, seed=5)).content.pointer
    assert tip is not None
    assert (tip.measured_from, tip.poses) == ("simulated", 60)
    np.testing.assert_allclose(tip.tip, [18.0, -120.0, 0.0], atol=5.0 * tip.tip_error_mm)
    with pytest.raises(InputError, match="cannot be simulated"):
        Edited(phantom_services, made).do(SimulatePointer(noise_mm=30.0))


# -- to the robot's base


def test_a_registration_to_the_base_is_made_from_one_to_the_patient(
    phantom_services: Services, calibrating: Calibrating, made: str
) -> None:
    """All simulated: touched before the tracker, taken to the base; the sample plan is driven from there."""
    editor = Edited(phantom_services, made)
    for place in BEADS:
        editor.do(AddPair(in_image=place))
    with pytest.raises(InputError, match="robot and tracker are not calibrated"):
        calibrating.to_base(made)
    editor.do(SimulateRobot(noise_mm=0.2, seed=3))
    with pytest.raises(InputError, match="nothing was measured"):
        calibrating.to_base(made)
    ids = [pair.id for pair in editor.document.content.pairs]
    before = editor.do(TouchPair(noise_mm=0.3, seed=7))
    with pytest.raises(DocumentConflict):
        calibrating.to_base(made, expected_revision=before.revision - 1)
    based = calibrating.to_base(made, expected_revision=before.revision)
    assert based.name == "Calibrated (robot's base)"
    second = calibrating.to_base(made)
    assert second.name == "Calibrated (robot's base) 2"
    phantom_services.registrations.delete(second.id)
    content = based.content
    assert (content.to, content.made_from, content.robot) == ("base", "pairs", before.content.robot)
    assert content.fre_mm == pytest.approx(before.content.fre_mm)
    assert editor.document.content == before.content
    assert report_of(content).simulated
    np.testing.assert_allclose(content.registration.transform, simulated_pose(HEAD_PHANTOM, "base"), atol=2.0)
    with pytest.raises(InputError, match="already"):
        calibrating.to_base(based.id)
    # A point that is touched again fits the others: head, tracker and robot stand where they stood.
    again = Edited(phantom_services, based.id).do(TouchPair(pair_id=ids[0], noise_mm=0.0)).content
    assert again.pairs[0].measured_from == "simulated"
    assert again.fre_mm is not None
    assert again.fre_mm < 1.0
    plan = phantom_services.plans.documents.duplicate(SAMPLE_PLAN)
    plan = phantom_services.plans.do(plan.id, UseRegistration(registration=based.id))
    evaluation = phantom_services.planning.evaluate(plan)
    assert evaluation.completed
    np.testing.assert_allclose(evaluation.base, np.linalg.inv(again.registration.transform), atol=1e-9)
    phantom_services.plans.documents.delete(plan.id)


def test_the_error_of_the_calibration_is_in_that_of_the_registration() -> None:
    """In the table, and in what a drive may be off by; both as the engine adds them."""
    robot = robot_of(*paired_poses(sigma_mm=0.3), "file")
    alone, content = measured_content(to="base"), measured_content(to="base", robot=robot)
    fit = register_points([p.measured for p in content.pairs], BEADS)
    covariance = np.reshape(robot.covariance, (6, 6))
    expected = target_errors_mm(fit, BEADS, 0.5, motion_covariance=covariance)
    both = expected_errors(content, BEADS)
    without = expected_errors(alone, BEADS)
    assert both is not None
    assert without is not None
    np.testing.assert_allclose(both, expected)
    assert (both[0] > 1.05 * without[0]).all()
    assert (both[1] > 1.05 * without[1]).all()
    np.testing.assert_allclose(without[0], fit.tre_mm(BEADS, 0.5))
    patient = expected_errors(replace(content, to="patient"), BEADS)  # it lies before the tracker: nothing is added
    assert patient is not None
    np.testing.assert_allclose(patient, without)
    tip = PointerTip((0.0, 1.0, 2.0), 0.2, 0.4, 35.0, 60, "tracker")
    tracked = tuple(replace(pair, measured_from="tracker") for pair in content.pairs)
    held = motion_covariance(replace(content, pairs=tracked, pointer=tip))
    assert held is not None
    np.testing.assert_allclose(held - covariance, np.diag([0.16 / 3.0] * 3 + [0.0] * 3))


def test_a_drive_knows_the_error_of_the_calibration(phantom_services: Services, made: str) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    robot = robot_of(*paired_poses(), "file")
    keys, radii = [], []
    for content in (measured_content(to="base"), measured_content(to="base", robot=robot)):
        document = Edited(phantom_services, made).become(content)
        driven = driven_registration(PlanRegistration("ready", "", made, document))
        assert driven is not None
        expected = expected_errors(content, BEADS)
        assert expected is not None
        radii.append(driven.off_mm(BEADS))
        np.testing.assert_allclose(radii[-1], expected[1])  # type: ignore[arg-type]
        keys.append(repr(driven.key))
    assert keys[0] != keys[1]
    words = error_table(measured_content(to="base", robot=robot), plan).words
    assert "The error of the robot's calibration is in it." in words


def test_real_and_simulated_are_not_mixed() -> None:
    real, simulated = robot_of(*paired_poses(), "file"), simulated_robot(HEAD_PHANTOM, 0.2, 1)
    tip = PointerTip((0.0, 1.0, 2.0), 0.2, 0.1, 35.0, 60, "simulated")
    with pytest.raises(InputError, match="simulated pointer"):
        tracked_through(RegistrationContent(pointer=tip))
    with pytest.raises(InputError, match="robot and tracker are not calibrated"):
        tracked_through(RegistrationContent(to="base"))
    with pytest.raises(InputError, match="calibration is simulated"):
        tracked_through(RegistrationContent(to="base", robot=simulated))
    point, matrix = tracked_through(
        RegistrationContent(to="base", robot=real, pointer=replace(tip, measured_from="file"))
    )
    np.testing.assert_array_equal(point, tip.tip)
    np.testing.assert_array_equal(matrix.ravel(), real.transform)
    assert report_of(measured_content(to="base", robot=simulated)).simulated
    table = b"# unit=mm\n# frame=tracker\nx,y,z\n1,2,3\n"
    with pytest.raises(InputError, match="the robot's calibration is simulated"):
        read_measured(table, measured_content(to="base", robot=simulated))
    cautions = report_of(measured_content(to="base", robot=simulated)).cautions
    assert any("robot's calibration is simulated" in text for text in cautions)


@pytest.mark.parametrize(
    ("source", "robot", "words"), [("tracker", "simulated", "real poses"), ("simulated", "file", "both")]
)
def test_points_and_robot_are_both_simulated_or_neither(
    phantom_services: Services, calibrating: Calibrating, made: str, source: Any, robot: Any, words: str
) -> None:
    content = measured_content(robot=robot_of(*paired_poses(), robot))
    pairs = tuple(replace(pair, measured_from=source) for pair in content.pairs)
    Edited(phantom_services, made).become(replace(content, pairs=pairs))
    with pytest.raises(InputError, match=words):
        calibrating.to_base(made)


def test_a_calibration_that_was_used_stays(phantom_services: Services, calibrating: Calibrating, made: str) -> None:
    editor = Edited(phantom_services, made)
    robot = robot_of(*paired_poses(), "file")
    editor.become(measured_content(to="base", robot=robot))
    with pytest.raises(InputError, match="forget what was measured first"):
        editor.do(ClearRobot())
    with pytest.raises(InputError, match="before anything is measured"):
        editor.do(RegisterTo(to="patient"))
    content = editor.document.content
    editor.become(replace(content, pairs=tuple(replace(p, measured_from="tracker") for p in content.pairs)))
    with pytest.raises(InputError, match="with the pointer as it was"):
        editor.do(SimulatePointer(noise_mm=0.2))
    editor.do(ClearMeasured())
    assert editor.do(ClearRobot()).content.robot is None
    assert editor.do(RegisterTo(to="patient")).content.to == "patient"
    editor.do(SetLocked(locked=True))
    with pytest.raises(DocumentLocked):
        editor.do(ClearRobot())


# -- over REST


def test_over_rest(client: Client, made: str) -> None:
    path = f"/api/v1/registrations/{made}"
    robot, tracker = paired_poses()
    answer = client.post(f"{path}/pointer", files={"file": ("p.csv", table(swung(), "pointer_to_tracker"))})
    assert answer.status_code == 200
    assert answer.json()["pointer"]["measured_from"] == "file"
    assert answer.json()["pointer"]["cautions"] == []
    tables = {
        "file": ("t.csv", table(tracker, "marker_to_tracker")),
        "robot": ("r.csv", table(robot, "flange_to_base")),
    }
    stored = client.post(f"{path}/robot", files=tables).json()
    np.testing.assert_allclose(np.reshape(stored["robot"]["transform"], (4, 4)), TRACKER_TO_BASE, atol=2.0)
    assert client.post(f"{path}/robot", files={"file": tables["file"]}).status_code == 422
    wrong = client.post(f"{path}/robot", files={"file": tables["robot"], "robot": tables["file"]})
    assert "poses of the robot's flange" in wrong.json()["error"]["message"]
    old = client.post(f"{path}/pointer/simulate", json={"revision": 1})
    assert old.status_code == 409
    assert client.delete(f"{path}/pointer").json()["pointer"] is None
    assert client.post(f"{path}/pointer/track", json={}).status_code == 422  # listens to no tracker
    points = "".join(f"{x},{y},{z}\n" for x, y, z in BEADS)
    for place in BEADS:
        client.post(f"{path}/pairs", json={"in_image": place})
    tracked = {"file": ("m.csv", f"# unit=mm\n# frame=tracker\nx,y,z\n{points}".encode())}
    assert client.post(f"{path}/measured", files=tracked).json()["fit"]["fre_mm"] == pytest.approx(0.0, abs=1e-9)
    assert client.patch(path, json={"to": "base"}).status_code == 422
    based = client.post(f"{path}/to-base", json={"name": "Beside the robot"})
    assert based.status_code == 201
    assert (based.json()["to"], based.json()["name"]) == ("base", "Beside the robot")
    np.testing.assert_allclose(based.json()["transform"], stored["robot"]["transform"], atol=1e-6)
    # A table of the tracker's is taken to the base in a registration to it, too.
    again = client.post(f"/api/v1/registrations/{based.json()['id']}/measured", files=tracked).json()
    np.testing.assert_allclose(again["transform"], based.json()["transform"], atol=1e-6)
    assert client.delete(f"/api/v1/registrations/{based.json()['id']}/robot").status_code == 422
    empty = client.post(f"{CASE}/registrations", json={"name": "Direct", "to": "base"}).json()
    assert empty["to"] == "base"
    one = client.post(f"/api/v1/registrations/{empty['id']}/pairs", json={"in_image": BEADS[0]}).json()["pair"]
    touched = client.post(f"/api/v1/registrations/{empty['id']}/pairs/{one}/touch", json={"noise_mm": 0.0}).json()
    place = (simulated_pose(HEAD_PHANTOM, "base") @ [*BEADS[0], 1.0])[:3]
    np.testing.assert_allclose(touched["pairs"][0]["measured"], place, atol=1e-9)
    refused = client.post(f"/api/v1/registrations/{empty['id']}/measured", files=tracked)
    assert refused.status_code == 422
    assert client.patch(f"/api/v1/registrations/{empty['id']}", json={"to": "patient"}).status_code == 422
    assert client.post(f"{CASE}/registrations", json={"name": "C", "copy_of": made, "to": "base"}).status_code == 422
    simulated = client.post(f"{path}/robot/simulate", json={"noise_mm": 0.2, "seed": 1}).json()["robot"]
    assert (simulated["measured_from"], simulated["poses"]) == ("simulated", 30)
