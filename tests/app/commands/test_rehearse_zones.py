"""`vfix rehearse --zones`: a file of zones beside a case and a plan, as its user would."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from app.cases import structures
from app.cli import main
from tests.engine.scenes import curved_tube
from tests.engine.urdf_texts import joint, links, urdf

NERVE = {
    "name": "optic nerve",
    "margin_mm": 0.8,
    "shape": {"kind": "capsule", "start": [-8, 30, 8], "end": [8, 30, 8], "radius": 1.5},
}
LINING = {"name": "mucosa", "thickness_mm": 1.5, "stiffness_n_per_mm": 0.5, "shape": {"kind": "anatomy"}}


@pytest.fixture
def tube(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The arguments that name a curved tube and a path along its middle, in a home of their own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    mesh, points = curved_tube()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / "tube.ply")
    rows = "".join(f"point,p{i},{x!r},{y!r},{z!r}\n" for i, (x, y, z) in enumerate(points[:4].tolist()))
    (tmp_path / "plan.csv").write_text(f"# frame=LPS\n# unit=mm\nkind,label,x,y,z\n{rows}")
    return ["--case", str(tmp_path / "tube.ply"), "--plan", str(tmp_path / "plan.csv")]


def with_zones(folder: Path, zones: list[dict[str, Any]], soft: list[dict[str, Any]] | None = None) -> list[str]:
    file = folder / "zones.json"
    body = {"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm", "zones": zones, "soft_zones": soft or []}
    file.write_text(json.dumps(body))
    return ["--zones", str(file)]


def rehearse(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any]]:
    status = main(["rehearse", *arguments, "--json"])
    return status, json.loads(capsys.readouterr().out)


def test_a_soft_zone_of_a_file_is_hard_from_its_greatest_depth_on(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The end of the path lies in a ball; what stops the tool names it and the depth."""
    ball = {"kind": "sphere", "centre": [0, 38, 6], "radius": 6.0}
    soft = {"name": "gland", "thickness_mm": 0.0, "stiffness_n_per_mm": 0.2, "shape": ball}
    status, report = rehearse([*tube, *with_zones(tmp_path, [], [soft])], capsys)
    assert (status, report["completed"]) == (0, True)
    status, report = rehearse([*tube, *with_zones(tmp_path, [], [soft | {"max_depth_mm": 2.5}])], capsys)
    assert not report["completed"]
    assert "'gland, 2.5 mm deep'" in report["reason"]
    for wrong, words in ((0.0, "must be positive"), (True, "must be a number"), (25.0, "20 at most")):
        arguments = [*tube, *with_zones(tmp_path, [], [soft | {"max_depth_mm": wrong}])]
        assert main(["rehearse", *arguments, "--json"]) == 2
        said = capsys.readouterr().err
        assert "soft zone 'gland'" in said
        assert words in said
    layer = {"name": "lining", "thickness_mm": 1.0, "stiffness_n_per_mm": 0.5, "max_depth_mm": 0.5}
    arguments = with_zones(tmp_path, [], [layer | {"shape": {"kind": "anatomy"}}])
    assert main(["rehearse", *tube, *arguments, "--json"]) == 2
    assert "leave the depth out" in capsys.readouterr().err


def test_a_path_is_driven_beside_a_zone_and_its_distance_reported(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-01: the zone keeps its own margin, and its least distance is among the figures."""
    status, report = rehearse([*tube, *with_zones(tmp_path, [NERVE], [LINING])], capsys)
    assert status == 0
    (zone,) = report["zones"]
    assert zone["name"] == "optic nerve"
    assert 0.8 <= zone["min_distance_mm"] < 3.0
    assert report["min_clearance_mm"] >= report["margin_mm"]


def test_a_zone_across_the_path_ends_the_rehearsal_with_its_name(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    across = {**NERVE, "shape": {"kind": "sphere", "centre": [0, 30, 3.8], "radius": 4}}
    assert main(["rehearse", *tube, *with_zones(tmp_path, [across]), "--json"]) == 1
    out, err = capsys.readouterr()
    report = json.loads(out)
    assert report["completed"] is False
    blocked, tip = np.array(report["blocked_at_lps_mm"]), np.array(report["stopped_at_lps_mm"])
    assert np.linalg.norm(blocked - [0, 30, 3.8]) == pytest.approx(4.0, abs=0.2)  # on the sphere
    assert 0.8 <= np.linalg.norm(blocked - tip) < 4.0
    assert f"its tip at ({tip[0]:.1f}, {tip[1]:.1f}, {tip[2]:.1f}) mm, LPS: protected structure" in err
    assert f"in the way at ({blocked[0]:.1f}, {blocked[1]:.1f}, {blocked[2]:.1f}) mm, LPS: lead the path" in err
    assert report["reason"] == "protected structure 'optic nerve' on the tip, 0.8 mm away"
    assert report["zones"][0]["min_distance_mm"] == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize(
    ("content", "word"),
    [
        ("{", "not sound JSON"),
        ("[]", "one JSON object"),
        ('{"schema": "vfix-zones/1", "unit": "mm"}', "must name LPS and mm"),
        ('{"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm", "zones": [{"name": "n"}]}', "does not say its"),
    ],
)
def test_a_file_that_is_no_file_of_zones_is_refused(
    tube: list[str], tmp_path: Path, content: str, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-14, HAZ-16."""
    (tmp_path / "zones.json").write_text(content)
    status, report = rehearse([*tube, "--zones", str(tmp_path / "zones.json")], capsys)
    assert status == 2
    assert word in report["error"]["message"]


def test_a_start_inside_a_zone_is_refused_by_its_name(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-04: no placing of the robot helps when the entry itself lies in a zone."""
    around = {**NERVE, "shape": {"kind": "sphere", "centre": [0, 2, 0], "radius": 5}}
    status, report = rehearse([*tube, *with_zones(tmp_path, [around])], capsys)
    assert status == 2
    assert "inside protected structure 'optic nerve'" in report["error"]["message"]


def test_a_robot_with_too_few_joints_is_told_and_soon(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It gives up where it gets nowhere, and says what the placing found; an inspection that fails has a reason too."""
    limit = '<axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1"/>'
    joints = joint("one", "a", "b", inside=limit), joint("two", "b", "c", inside=limit)
    (tmp_path / "two.urdf").write_text(urdf(links("a", "b", "c"), *joints))
    arguments = [*tube, "--robot", str(tmp_path / "two.urdf")]
    status, report = rehearse(arguments, capsys)
    assert (status, report["completed"]) == (1, False)
    assert "in 2 of 3 directions" in report["reason"]
    assert report["placing_reason"] == report["reason"]
    assert report["steps"] < 5_000
    status, report = rehearse([*arguments, "--task", "inspect"], capsys)
    assert (status, report["completed"]) == (1, False)
    assert report["targets"][0]["reason"]
    assert report["targets"][0]["reason"] in report["reason"]
    assert "in 2 of 3 directions" in report["placing_reason"]


def test_what_holds_the_tool_is_told_by_the_name_of_its_structure(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(structures._NAMES, "bone", "Skull base")
    plan = tmp_path / "plan.csv"
    plan.write_text(plan.read_text() + "point,outside,40,30,0\n")
    status, report = rehearse(tube, capsys)
    assert status == 1
    assert report["reason"].startswith("skull base on the ")


def test_a_zone_names_a_structure_of_the_case_by_its_id(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lining = LINING | {"shape": {"kind": "anatomy", "structure": "bone"}}
    status, _ = rehearse([*tube, *with_zones(tmp_path, [], [lining])], capsys)
    assert status == 0
    lining = LINING | {"shape": {"kind": "anatomy", "structure": "skull"}}
    status, report = rehearse([*tube, *with_zones(tmp_path, [], [lining])], capsys)
    assert status == 2
    assert "no structure 'skull'; the structures are bone" in report["error"]["message"]


def test_the_tip_stays_in_a_tube_and_an_envelope_of_the_command_line(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-01: the tube lets the path be followed, the envelope ends before it; both report their least room."""
    file, ball = tmp_path / "stay.json", {"kind": "sphere", "centre": [0, 8, 0.5], "radius": 20.0}
    body = {"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm", "envelopes": [{"name": "antrum", "shape": ball}]}
    file.write_text(json.dumps(body))
    status, report = rehearse([*tube, "--tube", "0.5"], capsys)
    assert (status, report["completed"]) == (0, True)
    (limit,) = report["tip_limits"]
    assert limit["name"] == "the tube of 0.5 mm about the path"
    assert 0.4 < limit["least_room_mm"] <= 0.5
    status, report = rehearse([*tube, "--tube", "0.5", "--zones", str(file)], capsys)
    assert status == 1
    assert report["reason"] == "the envelope 'antrum'"
    assert 0.0 < report["tip_limits"][1]["least_room_mm"] < 0.02
    for wrong in ("0.01", "nan"):
        assert main(["rehearse", *tube, "--tube", wrong, "--json"]) == 2
        assert "a tube's radius is" in capsys.readouterr().err
    body["envelopes"] = [{"name": "antrum", "shape": {"kind": "anatomy"}}]
    file.write_text(json.dumps(body))
    assert main(["rehearse", *tube, "--zones", str(file), "--json"]) == 2
    assert "envelope 'antrum': the kind of its shape is 'anatomy'" in capsys.readouterr().err
