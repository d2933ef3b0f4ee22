"""A plan in the robot's frame, compared with matrix arithmetic, and the metadata in the file."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rest_client import Client
from scipy.spatial.transform import Rotation

from app.cli import main
from app.exchange.plan_files import read_plan
from app.kit.errors import NotFound
from app.planning.placement import placed_robot, standing_base
from app.plans.model import Plan, without_placement
from app.plans.operations.document import LockPlan, UndoPlan
from app.plans.operations.instruments import KeepPlacement
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.document import FiducialPair, RegistrationContent
from app.services import Services
from vfix_engine.errors import FrameError, PlanError
from vfix_engine.frames import ImageRegistration

# Neither symmetric nor its own inverse.
TURN = np.array([[0.0, -1.0, 0.0, 5.5], [0.0, 0.0, -1.0, -7.25], [1.0, 0.0, 0.0, 1 / 3], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def plan(phantom_services: Services) -> Plan:
    """The sample with a target and the placing that its dry run finds."""
    services = phantom_services
    made = services.plans.documents.duplicate(SAMPLE_PLAN, "Placed")
    evaluation = services.planning.evaluate(made)
    robot = {
        "name": made.content.robot["name"],
        "base": evaluation.base.ravel().tolist(),
        "q_start": evaluation.q_start.tolist(),
    }
    return services.plans.do(made.id, KeepPlacement(robot=robot))


@pytest.fixture(scope="module")
def registration(phantom_services: Services, plan: Plan) -> str:
    content = RegistrationContent(
        "patient",
        tuple(TURN.ravel().tolist()),
        (FiducialPair("A", (0.0, 0.0, 0.0), (5.5, -7.25, 1 / 3 + 0.5)),),
        made_from="given",
    )
    return phantom_services.registrations.create(plan.case_id, "On the table", content).id


def to_base(plan: Plan, places: Any, registration: np.ndarray[Any, Any] | None = None) -> Any:
    """Places of the image in the base, by numpy's own inverse."""
    base = np.reshape(plan.content.robot["base"], (4, 4))
    whole = np.linalg.inv(base) @ (np.eye(4) if registration is None else registration)
    return np.asarray(places) @ whole[:3, :3].T + whole[:3, 3]


def test_points_and_targets_are_where_the_placing_puts_them(phantom_services: Services, plan: Plan) -> None:
    data = json.loads(phantom_services.base_export.text(plan, "json"))
    assert (data["frame"], data["unit"], data["registration"]) == ("base", "mm", None)
    assert "as in a simulation" in data["remark"]
    for name, points in (("points", plan.content.points), ("targets", plan.content.targets)):
        assert [row["label"] for row in data[name]] == [point.label for point in points]
        told = [row["position"] for row in data[name]]
        np.testing.assert_allclose(told, to_base(plan, [point.position for point in points]), rtol=0, atol=1e-9)
    inverse = np.linalg.inv(np.reshape(plan.content.robot["base"], (4, 4)))
    np.testing.assert_allclose(np.reshape(data["transform_image_to_base"], (4, 4)), inverse, atol=1e-9)


def test_the_path_is_as_it_is_driven_with_the_shafts_directions(phantom_services: Services, plan: Plan) -> None:
    data = json.loads(phantom_services.base_export.text(plan, "json"))
    run = phantom_services.planning.evaluate(plan).run
    rows = [int(np.abs(run.s - row["s_mm"]).argmin()) for row in data["path_as_driven"]]
    assert len(rows) > 50
    told = [row["position"] for row in data["path_as_driven"]]
    np.testing.assert_allclose(told, to_base(plan, run.tip[rows]), rtol=0, atol=1e-6)
    # The shaft leaves the tip: its far end is further along the direction than its near one.
    far = to_base(plan, run.segments_start[rows, -1]) - to_base(plan, run.segments_end[rows, -1])
    directions = np.array([row["direction"] for row in data["path_as_driven"]])
    np.testing.assert_allclose(np.cross(directions, far), 0.0, atol=1e-6)
    assert ((directions * far).sum(axis=1) > 1.0).all()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    away = np.linalg.norm(run.segments_start[rows, -1] - run.tip[rows], axis=1)
    assert (away > np.linalg.norm(run.segments_end[rows, -1] - run.tip[rows], axis=1)).all()


def test_the_bend_of_the_tool_is_told_in_the_bases_frame(phantom_services: Services, plan: Plan) -> None:
    """The tool of the sample is bent: direction and roll of each driven pose say where its tip goes."""
    data = json.loads(phantom_services.base_export.text(plan, "json"))
    run = phantom_services.planning.evaluate(plan).run
    whole = np.reshape(data["transform_image_to_base"], (4, 4))[:3, :3]
    for row in data["path_as_driven"][::20]:
        at = int(np.abs(run.s - row["s_mm"]).argmin())
        bend = whole @ (run.segments_end[at, 0] - run.segments_start[at, 0])  # towards the tip
        bend -= (bend @ row["direction"]) * np.array(row["direction"])
        np.testing.assert_allclose(bend_of(row), bend / np.linalg.norm(bend), atol=1e-6)


def test_a_planned_roll_is_told_before_a_base_that_is_turned(phantom_services: Services, plan: Plan) -> None:
    base = np.reshape(plan.content.robot["base"], (4, 4)) @ TURN
    turned = replace(plan, content=replace(plan.content, robot=plan.content.robot | {"base": base.ravel().tolist()}))
    for placed in (plan, turned):
        data = json.loads(phantom_services.base_export.text(placed, "json"))
        whole = np.reshape(data["transform_image_to_base"], (4, 4))[:3, :3]
        assert all(point.roll_deg is not None for point in plan.content.points)
        for row, point in zip(data["points"], plan.content.points, strict=True):
            own = bend_of({"direction": point.direction, "roll_deg": point.roll_deg})
            np.testing.assert_allclose(bend_of(row), whole @ own, atol=1e-9)


def bend_of(row: dict[str, Any]) -> Any:
    """Where a tool bends to, of length 1, by the words of the docs: 'up' turned about the direction, right-handed."""
    along = np.array(row["direction"])
    up = np.array([0.0, 0.0, 1.0] if abs(along[2]) < 0.95 else [0.0, 1.0, 0.0])
    up = up - (up @ along) * along
    turn = Rotation.from_rotvec(np.radians(row["roll_deg"]) * along)
    return turn.apply(up / np.linalg.norm(up))


def test_a_registration_is_composed_and_named(phantom_services: Services, plan: Plan, registration: str) -> None:
    data = json.loads(phantom_services.base_export.text(plan, "json", "On the table"))
    told = [row["position"] for row in data["points"]]
    expected = to_base(plan, [point.position for point in plan.content.points], TURN)
    np.testing.assert_allclose(told, expected, rtol=0, atol=1e-9)
    named = data["registration"]
    assert (named["id"], named["name"], named["to"]) == (registration, "On the table", "patient")
    assert named["fre_mm"] == pytest.approx(0.5)


def test_the_plans_own_registration_is_used_unless_another_is_named(
    phantom_services: Services, plan: Plan, registration: str
) -> None:
    own = replace(plan, content=replace(plan.content, registration=registration))
    text = phantom_services.base_export.text(own, "json")
    assert text == phantom_services.base_export.text(plan, "json", registration)
    unmade = phantom_services.registrations.create(plan.case_id, "Not made yet", RegistrationContent())
    for refused in (
        replace(plan, content=replace(plan.content, registration=unmade.id)),
        replace(plan, content=replace(plan.content, registration="none")),
    ):
        with pytest.raises(PlanError):
            phantom_services.base_export.text(refused, "json")


def test_a_placing_beside_a_registered_patient_is_kept_in_the_patients_frame(plan: Plan) -> None:
    base = np.reshape(plan.content.robot["base"], (4, 4))
    q_start = np.array(plan.content.robot["q_start"])
    kept = placed_robot(plan.content.robot, base, q_start, ImageRegistration(TURN))
    np.testing.assert_allclose(np.reshape(kept["base"], (4, 4)), TURN @ base, atol=1e-12)
    np.testing.assert_allclose(standing_base(kept, ImageRegistration(TURN)), base, atol=1e-9)
    assert placed_robot(plan.content.robot, base, q_start, None) == plan.content.robot
    with pytest.raises(PlanError, match="says where it stands"):
        placed_robot(plan.content.robot, base, q_start, ImageRegistration(TURN, "base"))


def test_the_table_says_the_same(phantom_services: Services, plan: Plan, registration: str) -> None:
    data = json.loads(phantom_services.base_export.text(plan, "json", registration))
    text = phantom_services.base_export.text(plan, "csv", registration)
    lines = text.splitlines()
    head = dict(line[2:].split("=", 1) for line in lines if line.startswith("# ") and "=" in line)
    assert (head["frame"], head["unit"]) == ("base", "mm")
    assert json.loads(head["registration"]) == data["registration"]
    assert json.loads(head["transform_image_to_base"]) == data["transform_image_to_base"]
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    for kind, name in (("point", "points"), ("target", "targets"), ("driven", "path_as_driven")):
        told = [[float(row[axis]) for axis in "xyz"] for row in rows if row["kind"] == kind]
        assert told == [row["position"] for row in data[name]]


@pytest.mark.parametrize("form", ["json", "csv"])
def test_no_file_in_the_robots_frame_is_taken_for_a_plan(phantom_services: Services, plan: Plan, form: str) -> None:
    text = phantom_services.base_export.text(plan, form)
    with pytest.raises((PlanError, FrameError)):
        read_plan(f"plan.{form}", text.encode())


def test_a_robot_that_is_not_placed_is_refused(phantom_services: Services, plan: Plan, registration: str) -> None:
    unplaced = replace(plan, content=replace(plan.content, robot=without_placement(plan.content.robot)))
    for name in (None, registration):
        with pytest.raises(PlanError, match="not placed"):
            phantom_services.base_export.text(unplaced, "json", name)


def test_a_registration_to_the_base_needs_no_placing(phantom_services: Services, plan: Plan) -> None:
    content = RegistrationContent("base", tuple(TURN.ravel().tolist()), made_from="given")
    phantom_services.registrations.create(plan.case_id, "Hand-eye", content)
    unplaced = replace(plan, content=replace(plan.content, robot=without_placement(plan.content.robot)))
    data = json.loads(phantom_services.base_export.text(unplaced, "json", "Hand-eye"))
    expected = np.array([p.position for p in plan.content.points]) @ TURN[:3, :3].T + TURN[:3, 3]
    np.testing.assert_allclose([row["position"] for row in data["points"]], expected, rtol=0, atol=1e-9)


def test_other_forms_and_unknown_registrations_are_refused(phantom_services: Services, plan: Plan) -> None:
    with pytest.raises(PlanError, match="json or csv"):
        phantom_services.base_export.text(plan, "mrk.json")
    with pytest.raises(NotFound, match="there is no registration 'none'"):
        phantom_services.base_export.text(plan, "json", "none")


def test_rest_and_the_command_line_say_the_same(
    client: Client, phantom_services: Services, plan: Plan, registration: str, monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    query = {"frame": "base", "format": "json", "registration": registration}
    answer = client.get(f"/api/v1/plans/{plan.id}/export", params=query)
    assert answer.status_code == 200
    assert answer.text == phantom_services.base_export.text(plan, "json", registration)
    assert client.get(f"/api/v1/plans/{SAMPLE_PLAN}/export", params={"frame": "base"}).status_code == 422
    monkeypatch.setenv("VFIX_HOME", str(phantom_services.settings.home))
    out = tmp_path / "plan.json"
    arguments = ["plan", "export", plan.id, str(out), "--frame", "base", "--registration", registration]
    assert main(arguments) == 0
    assert out.read_text(encoding="utf-8") == answer.text
    assert main(["plan", "export", SAMPLE_PLAN, str(tmp_path / "no.json"), "--frame", "base"]) == 2
    assert "not placed" in capsys.readouterr().err
    assert not (tmp_path / "no.json").exists()


def test_the_placing_of_the_dry_run_is_kept_with_the_plan(
    client: Client, phantom_services: Services, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plans = phantom_services.plans
    made = plans.documents.duplicate(SAMPLE_PLAN, "To be placed")
    assert made.content.robot["base"] is None
    answer = client.post(f"/api/v1/plans/{made.id}/placing")
    assert answer.status_code == 200
    placed = plans.get(made.id)
    np.testing.assert_array_equal(placed.content.robot["base"], phantom_services.planning.evaluate(made).base.ravel())
    assert plans.do(made.id, UndoPlan()).content.robot["base"] is None
    monkeypatch.setenv("VFIX_HOME", str(phantom_services.settings.home))
    assert main(["plan", "place", made.id]) == 0
    assert plans.get(made.id).content.robot == placed.content.robot
    plans.do(made.id, LockPlan(locked=True))
    assert main(["plan", "place", made.id]) == 2
    assert "locked" in capsys.readouterr().err
