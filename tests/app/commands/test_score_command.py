"""`vfix score`: stored runs and folders, in one answer; what cannot be scored is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli import main
from app.services import build_services
from app.settings import Settings


def test_runs_of_before_are_scored_by_id_and_by_folder(
    old_runs: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    services = build_services(Settings.from_environment())
    with services.runs.laid_out(old_runs["rigid"]) as place:
        folder = place.rename(tmp_path / "run")
    services.close()
    assert main(["score", old_runs["rigid"], str(folder), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    stored, own = answer["runs"]
    assert answer["notice"] == "Not for clinical use."
    assert stored["run"] == old_runs["rigid"]
    assert stored["case"]
    assert (own["run"], own["case"], own["recorded"]) == (str(folder), None, None)
    about = {"run", "case", "plan", "recorded"}
    assert {key: stored[key] for key in stored.keys() - about} == {key: own[key] for key in own.keys() - about}
    assert (own["world"], own["mode"], own["certified"], own["contacts"]) == ("rigid", "hands-on", True, 0)
    assert own["samples"] == 100, "of 750: the drive returned to its start"
    assert main(["score", old_runs["rigid"]]) == 0
    assert "least_clearance_mm" in (text := capsys.readouterr().out)
    assert "Interrupted" not in text
    (folder / "end.json").unlink()
    assert main(["score", str(folder)]) == 0
    assert "Interrupted: what came after the recording is in no figure." in capsys.readouterr().out
    assert main(["score", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"][0]["whole"] is False


def test_a_run_in_a_lumen_has_the_score_of_a_lumen(
    old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["score", old_runs["rigid"], old_runs["snake"], "--json"]) == 0
    rigid, snake = json.loads(capsys.readouterr().out)["runs"]
    assert (rigid["world"], snake["world"], snake["arm"], snake["certified"]) == ("rigid", "snake", "certified", True)
    assert 0.0 < snake["depth_mm"] <= snake["length_mm"]
    assert snake["beyond_bound_mm"] == 0.0
    assert main(["score", old_runs["snake"]]) == 0
    assert "withdrawal_s" in capsys.readouterr().out
    assert main(["run", "list", "--arm", "certified", "--json"]) == 0
    assert {one["arm"] for one in json.loads(capsys.readouterr().out)} == {"certified"}
    assert main(["run", "list", "--arm", "manual", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_what_cannot_be_scored_ends_the_command(old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["score", old_runs["rigid"], old_runs["snake"], "--errors", "papers", "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert "no error chain" in told["error"]["message"]
    assert main(["score", "run-nobody"]) == 2
    assert "run-nobody" in capsys.readouterr().err
