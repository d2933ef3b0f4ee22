"""`vfix rehearse --operator recorded`: the hand of a run drives another setting, and both are scored."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from app.cli import main
from vfix_engine.worlds.rigid.row import PHASES

SAMPLE = ["rehearse", "--case", "head-phantom", "--plan", "head-phantom-sample"]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))


def told(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict]:
    status = main([*SAMPLE, *arguments, "--json"])
    return status, json.loads(capsys.readouterr().out)


def test_the_hand_of_a_run_drives_with_another_margin(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, first = told([], capsys)
    assert status == 0
    file = tmp_path / "again.parquet"
    again = ["--operator", "recorded", "--hand", first["run"], "--margin", "0.9", "--record", str(file)]
    status, second = told(again, capsys)
    assert (second["operator"], second["hand"], second["margin_mm"]) == ("recorded", first["run"], 0.9)
    assert second["steps"] == first["steps"], "the hand has its own time"
    assert status == (0 if second["completed"] else 1)
    assert second["reached_mm"] == pytest.approx(first["reached_mm"], abs=0.5)
    assert second["min_bone_clearance_mm"] >= 0.9
    assert main(["score", first["run"], second["run"], "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)["runs"]
    for key in ("time_s", "path_length_mm", "least_clearance_mm", "contacts"):
        assert [second["scores"][name][key] for name in ("hand", "run")] == [score[key] for score in scores], key
    table = pq.read_table(file)
    assert table.num_rows == second["steps"]
    assert table["tip_x [mm]"].to_pylist()[-1] != 0.0
    assert PHASES[int(table["phase"].to_pylist()[-1])] == ("done" if second["completed"] else "follow")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--operator", "recorded"], "go together"),
        (["--hand", "run-x"], "go together"),
        (["--operator", "recorded", "--hand", "run-x", "--task", "inspect"], "--task path"),
        (["--operator", "recorded", "--hand", "run-x"], "run-x"),
        (["--operator", "recorded", "--hand", "run-x", "--mode", "freehand"], "--operator recorded"),
    ],
)
def test_what_does_not_go_together_is_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status, error = told(arguments, capsys)
    assert status == 2
    assert words in error["error"]["message"]
