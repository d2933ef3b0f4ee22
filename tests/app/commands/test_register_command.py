"""`vfix register`: beads, measured points in any order, the fit, the plan that uses it, transforms out and in."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edited_registrations import Edited
from registration_poses_cases import paired_poses, swung
from registration_poses_cases import table as pose_table
from scipy.spatial.transform import Rotation

from app.cases.model import HEAD_PHANTOM
from app.cli import main
from app.commands import register_calibration
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.operations import AddPair
from app.registration.reachable_surface import reachable_places
from app.services import Services
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.registration.transform_files import write_transform

TURN = Rotation.from_euler("xyz", [10.0, 20.0, 30.0], degrees=True).as_matrix()
SHIFT = np.array([100.0, 20.0, 5.0])


@pytest.fixture
def said(phantom_services: Services, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Any:
    """Runs a command on the home of the tests; gives the exit status and its JSON."""
    monkeypatch.setenv("VFIX_HOME", str(phantom_services.settings.home))

    def run(*words: str) -> tuple[int, dict[str, Any]]:
        status = main(["register", *words, "--json"])
        return status, json.loads(capsys.readouterr().out)

    return run


def table(path: Path, order: list[int], unit: str = "mm") -> Path:
    beads = np.array([bead.centroid for bead in load_landmarks().beads])[order] @ TURN.T + SHIFT
    rows = [f"{x},{y},{z}\n" for x, y, z in (beads / (1.0 if unit == "mm" else 1e3)).tolist()]
    path.write_text(f"# unit={unit}\n# frame=tracker\nx,y,z\n" + "".join(rows), encoding="utf-8")
    return path


def test_from_the_ct_to_a_plan(said: Any, phantom_services: Services, tmp_path: Path) -> None:
    """Points measured in another order than the beads are found in are fitted once the order is matched."""
    made = phantom_services.registrations.create(HEAD_PHANTOM, "From the command line")
    plan = phantom_services.plans.documents.duplicate(SAMPLE_PLAN, "To be registered")
    on = ("--registration", made.id)
    status, found = said("beads", HEAD_PHANTOM, *on, "--confirm")
    assert (status, len(found["beads"]), found["pairs"]) == (0, 5, 5)
    status, mixed = said("fit", HEAD_PHANTOM, *on, "--csv", str(table(tmp_path / "m.csv", [3, 1, 0, 4, 2], "m")))
    assert (status, mixed["state"], mixed["wrong"]) == (1, "misfit", None)
    assert mixed["fre_mm"] > 20.0
    status, undone = said("undo", HEAD_PHANTOM, *on)
    assert (status, undone["told"][:15], undone["made_from"]) == (0, "Undone: Point ‘", "none")
    assert said("redo", HEAD_PHANTOM, *on)[1]["made_from"] == "pairs"
    status, stated = said("fit", HEAD_PHANTOM, *on, "--fle", "0.1", "--plan", plan.id, "--use")
    assert (status, stated["state"], stated["used"]) == (1, "misfit", False)
    assert "No error is told" in stated["errors"]["words"]
    assert (stated["errors"]["targets"], stated["errors"]["path"]) == ([], None)
    assert phantom_services.plans.get(plan.id).content.registration is None
    for ending in ("tfm", "json"):
        refused = said("export", HEAD_PHANTOM, *on, str(tmp_path / f"wrong.{ending}"))
        assert refused[0] == 2
        assert "do not fit" in refused[1]["error"]["message"]
    status, fitted = said("fit", HEAD_PHANTOM, *on, "--match-order", "--fle", "0.4", "--plan", plan.id, "--use")
    assert (status, fitted["order_certain"], fitted["cautions"], fitted["fle_source"]) == (0, True, [], "stated")
    assert fitted["fre_mm"] < 0.1
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = TURN, SHIFT
    np.testing.assert_allclose(np.reshape(fitted["transform"], (4, 4)), expected, atol=0.1)
    assert fitted["errors"]["path"]["within_95_mm"] > 0.2
    assert phantom_services.plans.get(plan.id).content.registration == made.id
    file = tmp_path / "head.tfm"
    assert said("export", HEAD_PHANTOM, *on, str(file))[0] == 0
    status, came = said("import", HEAD_PHANTOM, str(file), "--name", "Came back")
    assert (status, came["made_from"], came["name"]) == (0, "given", "Came back")
    np.testing.assert_allclose(came["transform"], fitted["transform"], atol=1e-9)
    _, listed = said("list", HEAD_PHANTOM)
    assert {made.id, came["registration"]} <= {one["registration"] for one in listed["registrations"]}
    phantom_services.plans.documents.delete(plan.id)
    status, second = said("import", HEAD_PHANTOM, str(file), "--name", "Came back")
    assert (status, second["name"], second["to"], second["simulated"]) == (0, "Came back 2", "patient", False)
    assert said("import", HEAD_PHANTOM, str(file), "--to", "base")[0] == 2
    write_transform(tmp_path / "foreign.tfm", expected)
    status, foreign = said("import", HEAD_PHANTOM, str(tmp_path / "foreign.tfm"), "--to", "base")
    assert (status, foreign["name"], foreign["to"]) == (0, "foreign", "base")
    for registration in (made.id, *(one["registration"] for one in (came, second, foreign))):
        phantom_services.registrations.delete(registration)


def test_what_cannot_be_done_is_told(said: Any, phantom_services: Services, tmp_path: Path) -> None:
    made = phantom_services.registrations.create(HEAD_PHANTOM, "Empty")
    on = ("--registration", made.id)
    status, waiting = said("fit", HEAD_PHANTOM, *on)
    assert (status, waiting["state"], waiting["fre_mm"], waiting["transform"]) == (1, "waiting", None, None)
    assert said("export", HEAD_PHANTOM, *on, str(tmp_path / "head.tfm"))[0] == 2
    assert said("export", HEAD_PHANTOM, *on, str(tmp_path / "head.h5"))[0] == 2
    status, refused = said("fit", HEAD_PHANTOM, *on, "--use")
    assert status == 2
    assert "--plan" in refused["error"]["message"]
    assert said("fit", HEAD_PHANTOM, "--registration", "nosuch")[0] == 2
    status, none = said("beads", HEAD_PHANTOM, *on, "--diameter", "12")
    assert (status, none["beads"]) == (1, [])
    phantom_services.registrations.delete(made.id)


def test_it_is_refined_and_a_path_is_traced(said: Any, phantom_services: Services, tmp_path: Path) -> None:
    """Points on bone as somebody measured them: the fit of badly measured beads is refined on them."""
    services = phantom_services
    made = services.registrations.create(HEAD_PHANTOM, "To refine")
    plan = services.plans.documents.duplicate(SAMPLE_PLAN, "To be traced")
    editor, on = Edited(services, made.id), ("--registration", made.id)
    beads = np.array([bead.centroid for bead in load_landmarks().beads])
    off = np.random.default_rng(0).normal(0.0, 1.5, beads.shape)
    for bead, at in zip(beads, (beads + off) @ TURN.T + SHIFT, strict=True):
        editor.do(AddPair(in_image=bead.tolist(), measured=at.tolist()))
    assert said("refine", HEAD_PHANTOM, *on)[0] == 2  # nothing is touched
    tree = services.cases.tree(services.cases.get(HEAD_PHANTOM))
    places = reachable_places(tree, [(x, y, z) for x, y, z in beads.tolist()], 100, 1) @ TURN.T + SHIFT
    status, refined = said("refine", HEAD_PHANTOM, *on, "--csv", str(points(tmp_path / "bone.csv", places)))
    assert (status, refined["touched"], refined["refinement"]["kept"], refined["structure"]) == (0, 100, 75, "bone")
    transform = np.reshape(refined["transform"], (4, 4))
    np.testing.assert_allclose(transform[:3, :3], TURN, atol=1e-3)
    np.testing.assert_allclose(transform[:3, 3], SHIFT, atol=0.05)
    np.testing.assert_allclose(list(refined["residuals_mm"].values()), np.linalg.norm(off, axis=1), atol=0.1)
    assert "not the accuracy" in refined["words"]
    status, again = said("refine", HEAD_PHANTOM, *on, "--structure", "Bone", "--keep", "0.9")
    assert (status, again["refinement"]["kept"]) == (0, 90)

    line = np.linspace([0.0, -20.0, 0.0], [0.0, 40.0, 0.0], 100) @ TURN.T + SHIFT
    wire, into = ("--csv", str(points(tmp_path / "wire.csv", line))), ("--plan", plan.id)
    assert said("trace", HEAD_PHANTOM, *wire, *into)[0] == 2  # the plan has no registration
    status, traced = said("trace", HEAD_PHANTOM, *on, *wire, *into, "--name", "Wire")
    assert (status, traced["name"], traced["samples"], traced["registration"]) == (0, "Wire", 100, "To refine")
    path = services.plans.get(plan.id).content.path
    assert (path.id, path.name) == (traced["path"], "Wire")
    np.testing.assert_allclose(path.points[0].position, [0.0, -20.0, 0.0], atol=0.6)
    services.plans.documents.delete(plan.id)
    services.registrations.delete(made.id)


def points(path: Path, places: np.ndarray) -> Path:
    rows = "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in places.tolist())
    path.write_text(f"# unit=mm\n# frame=tracker\nx,y,z\n{rows}", encoding="utf-8")
    return path


def test_pointer_and_robot_are_calibrated_and_a_registration_goes_to_the_base(
    said: Any, phantom_services: Services, tmp_path: Path
) -> None:
    _, made = said("new", HEAD_PHANTOM, "--name", "Calibrated")
    on = ("--registration", made["registration"])
    (tmp_path / "p.csv").write_bytes(pose_table(swung(), "pointer_to_tracker"))
    status, pointer = said("pivot", HEAD_PHANTOM, *on, "--csv", str(tmp_path / "p.csv"))
    assert (status, pointer["pointer"]["measured_from"], pointer["pointer"]["cautions"]) == (0, "file", [])
    robot, tracker = paired_poses()
    (tmp_path / "r.csv").write_bytes(pose_table(robot, "flange_to_base"))
    (tmp_path / "t.csv").write_bytes(pose_table(tracker, "marker_to_tracker"))
    tables = ("--robot-csv", str(tmp_path / "r.csv"), "--tracker-csv", str(tmp_path / "t.csv"))
    assert said("robot", HEAD_PHANTOM, *on, *tables[:2])[0] == 2
    assert said("robot", HEAD_PHANTOM, *on, *tables, "--clear")[0] == 2
    status, calibrated = said("robot", HEAD_PHANTOM, *on, *tables)
    assert status == 0
    assert 0.0 < calibrated["robot"]["translation_residual_mm"] < 0.5
    assert said("base", HEAD_PHANTOM, *on)[0] == 2  # nothing was measured
    said("beads", HEAD_PHANTOM, *on, "--confirm")
    assert (
        said("fit", HEAD_PHANTOM, *on, "--csv", str(table(tmp_path / "m.csv", [0, 1, 2, 3, 4])), "--match-order")[0]
        == 0
    )
    status, based = said("base", HEAD_PHANTOM, *on, "--name", "Beside the robot")
    assert (status, based["to"], based["name"], based["made_from"]) == (0, "base", "Beside the robot", "pairs")
    there = np.reshape(calibrated["robot"]["transform"], (4, 4))
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = TURN, SHIFT
    np.testing.assert_allclose(np.reshape(based["transform"], (4, 4)), there @ expected, atol=0.2)
    _, simulated = said("pivot", HEAD_PHANTOM, *on, "--simulated", "0.2", "--seed", "4")
    assert simulated["pointer"]["measured_from"] == "simulated"
    assert said("pivot", HEAD_PHANTOM, *on, "--clear")[1]["pointer"] is None
    assert said("robot", HEAD_PHANTOM, *on, "--simulated", "0.2")[1]["robot"]["poses"] == 30
    for one in (made["registration"], based["registration"]):
        phantom_services.registrations.delete(one)


def test_a_tracking_server_calibrates_the_pointer(
    said: Any, phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client that the command makes listens to the server that it is told of; nobody there is told."""
    heard: list[Any] = []

    class Client:
        state, words = "fresh", "Stylus is tracked"

        def __init__(self, *address: Any) -> None:
            heard.append(address)

        def start(self) -> None: ...

        def close(self) -> None:
            heard.append("closed")

        def poses(self, seconds: float) -> np.ndarray:
            heard.append(seconds)
            return swung()

    monkeypatch.setattr(register_calibration, "TrackerClient", Client)
    _, made = said("new", HEAD_PHANTOM, "--to", "base")
    on = ("--registration", made["registration"])
    status, found = said("pivot", HEAD_PHANTOM, *on, "--tracker", "tracker.local:18944/Stylus", "--seconds", "4")
    assert (status, found["to"], found["pointer"]["measured_from"]) == (0, "base", "tracker")
    assert heard == [("tracker.local", 18944, "Stylus"), 4.0, "closed"]
    monkeypatch.setattr(Client, "state", "connecting")
    monkeypatch.setattr(register_calibration, "_CONNECT_S", 0.0)
    assert said("pivot", HEAD_PHANTOM, *on, "--tracker", "tracker.local:18944/Stylus")[0] == 2
    assert heard[-1] == "closed"
    assert said("pivot", HEAD_PHANTOM, *on, "--tracker", "nowhere")[0] == 2
    phantom_services.registrations.delete(made["registration"])
