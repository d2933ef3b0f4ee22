"""`vfix rehearse --robot`: other robots and tools on the real head, and what is said about a robot that is none."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli import main
from vfix_engine.resources import assets_dir

ROBOTS = assets_dir() / "robots"


def rehearse(
    trial_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *more: str
) -> tuple[int, dict]:
    """The real corridor in a home of its own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    folder = trial_data / "head_ct"
    case = ["--case", str(folder / "nose_sinus_bone_lps_mm.ply"), "--plan", str(folder / "corridor.mrk.json")]
    status = main(["rehearse", *case, "--json", *more])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("more", "robot", "tool"),
    [
        (["--robot", "dvrk_psm_rigid", "--tool", "endoscope_30"], "dvrk_psm_rigid", "endoscope_30"),
        (["--robot", str(ROBOTS / "dvrk_psm.urdf"), "--tool-frame", "tool_tip"], "dvrk_psm", "bent_30"),
    ],
)
def test_another_robot_drives_the_corridor(
    more: list[str],
    robot: str,
    tool: str,
    trial_data: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """HAZ-01: by name and by file, to the end of the path, with the margin kept."""
    status, report = rehearse(trial_data, tmp_path, monkeypatch, capsys, *more)
    assert (status, report["completed"]) == (0, True), report
    assert (report["robot"], report["tool"]) == (robot, tool)
    assert report["min_clearance_mm"] >= 0.3
    assert report["tip_error_mm"]["max"] <= 0.05
    notes = " ".join(report.get("robot_notes", []))
    assert ("acceleration" in notes) == more[1].endswith(".urdf")  # a URDF alone says nothing of it


@pytest.mark.parametrize(
    ("more", "word"),
    [
        (["--robot", "spoon"], "steady_hand"),
        (["--robot", "bad.urdf"], "bad.urdf: the XML is refused"),
        (["--robot", "steady_hand", "--tool-frame", "elbow"], "no link 'elbow'"),
        (["--robot", str(ROBOTS / "dvrk_psm.json"), "--tool-frame", "remote_centre"], "no joint"),
    ],
)
def test_a_robot_that_is_none_is_said(
    more: list[str],
    word: str,
    trial_data: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """HAZ-20, HAZ-23 at the command line."""
    monkeypatch.chdir(tmp_path)
    Path("bad.urdf").write_text("<!DOCTYPE robot><robot/>")
    status, report = rehearse(trial_data, tmp_path, monkeypatch, capsys, *more)
    assert status == 2
    assert word in report["error"]["message"]
