"""`vfix rehearse --mode freehand`: the plan in a free hand, which says that nothing certified it (HAZ-41)."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from app.cli import main
from vfix_engine.control import ControlSettings
from vfix_engine.worlds.rigid.dry_run import DryRun, dry_run
from vfix_engine.worlds.rigid.scene import Scene

SAMPLE = ["--case", "head-phantom", "--plan", "head-phantom-sample", "--mode", "freehand"]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))


def rehearse(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict, str]:
    status = main(["rehearse", *SAMPLE, *arguments, "--json"])
    told = capsys.readouterr()
    return status, json.loads(told.out), told.err


def test_a_free_hand_with_errors_of_vision_contacts_bone_and_its_run_is_scored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, said, words = rehearse(["--seed", "1", "--record", str(tmp_path / "hand.csv")], capsys)
    about = json.loads((tmp_path / "hand.csv.about.json").read_text())
    assert (about["mode"], about["certificate"][:31]) == ("freehand", "driven without the certificate:")
    assert (status, said["completed"], said["mode"], said["certified"]) == (0, True, "freehand", False)
    assert "without the certificate" in words
    assert said["contacts"] == sum(one["count"] for one in said["contacts_by"]) > 0
    assert said["min_bone_clearance_mm"] == -said["max_depth_mm"] < 0.0
    assert {one["structure"] for one in said["contacts_by"]} == {"bone"}
    today = {"operator", "task", "steps", "held_steps", "approach_steps", "step_time_us", "qp_rows", "margin_mm",
             "path_length_mm", "soft_tissue", "warnings", "reached_mm", "reason", "pierced", "notice"}  # fmt: skip
    assert today <= said.keys()
    assert main(["score", said["run"], "--json"]) == 0
    (score,) = json.loads(capsys.readouterr().out)["runs"]
    assert (score["mode"], score["certified"], score["contacts"]) == ("freehand", False, said["contacts"])
    assert score["time_s"] == pytest.approx(said["time_s"])
    assert score["max_depth_mm"] == said["max_depth_mm"]
    assert score["path_error_mm"]["robot_frame"]["mean"] == pytest.approx(said["tip_error_mm"]["mean"], rel=1e-6)
    assert main(["replay", said["run"], "--verify", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["same_hash"], "recorded by this processor"
    assert main(["run", "list", "--mode", "freehand"]) == 0
    assert "freehand (without the certificate)" in capsys.readouterr().out
    assert main(["score", said["run"]]) == 0
    assert "without the certificate" in capsys.readouterr().out


def test_a_steady_one_touches_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    status, said, _ = rehearse(["--steady"], capsys)
    assert (status, said["completed"], said["contacts"], said["contacts_by"]) == (0, True, 0, [])
    assert said["min_bone_clearance_mm"] > 0.0


@pytest.mark.parametrize(
    "arguments",
    [
        ["--operator", "pushing"],
        ["--task", "inspect"],
        ["--soft-tissue"],
        ["--remote-centre"],
        ["--speed-limit"],
        ["--approach", "10"],
        ["--tube", "1"],
        ["--margin", "0.5"],
    ],
)
def test_what_is_of_a_robot_is_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rehearse", *SAMPLE, *arguments, "--json"]) == 2
    assert f"does not go with {arguments[0]}" in capsys.readouterr().err
    assert main(["rehearse", *SAMPLE[:4], "--steady"]) == 2


@pytest.mark.parametrize("kind", ["soft_zones", "envelopes"])
def test_zones_that_do_nothing_are_refused(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ball = {"name": "gland", "shape": {"kind": "sphere", "centre": [0, 8, 0.5], "radius": 60.0}}
    soft = {"thickness_mm": 0.0, "stiffness_n_per_mm": 0.2} if kind == "soft_zones" else {}
    file = tmp_path / "zones.json"
    file.write_text(json.dumps({"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm", kind: [ball | soft]}))
    assert main(["rehearse", *SAMPLE, "--zones", str(file), "--json"]) == 2
    assert "soft zones and envelopes do nothing" in capsys.readouterr().err


def test_a_plan_that_does_not_arrive_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def short(scene: Scene, settings: ControlSettings) -> DryRun:
        return replace(dry_run(scene, settings), completed=False, reason="bone is in the way")

    monkeypatch.setattr("app.commands.rehearse_freehand.dry_run", short)
    _, said, words = rehearse(["--steady"], capsys)
    note = said["notes"][-1]
    assert note.startswith("the plan shows the tool up to ")
    assert note.endswith(" mm of the path: bone is in the way")
    assert note in words
