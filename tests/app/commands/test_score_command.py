"""`vfix score`: stored runs and folders, in one answer; what cannot be scored is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from app.cli import main
from app.commands.score_words import facts_of
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
    assert "Nearest to" in (text := capsys.readouterr().out)
    assert "least_clearance_mm" not in text
    assert not re.search(r"\d\.\d{4}|None", text)
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
    text = capsys.readouterr().out
    assert re.search(rf"Depth  {snake['depth_mm']:.0f} mm\n", text)
    assert "Beyond bound  0 mm" in text
    assert not re.search(r"\d\.\d{4}|None", text)
    assert main(["run", "list", "--arm", "certified", "--json"]) == 0
    assert {one["arm"] for one in json.loads(capsys.readouterr().out)} == {"certified"}
    assert main(["run", "list", "--arm", "manual", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_a_run_of_a_task_is_said_as_on_the_card() -> None:
    """With the same names, in the same order, and what is not known."""
    mean_max = {"mean": 1.0, "max": 6.26}
    rows = [{"name": "Completed in", "value": 13.0, "unit": "s", "digits": 1}]
    rows.append({"name": "Angle error", "value": None, "unit": "°", "digits": 1})
    score = {
        "arm": "manual", "certified": False, "completed": True, "time_s": 61.0, "depth_mm": 412.4, "share": 0.5,
        "insertion_s": 40.0, "withdrawal_s": None, "deviation": {"episodes": 3, "time_s": 2.5, "depth_mm": mean_max},
        "nearest_mm": mean_max, "bound_mm": 8.0, "behind_wall": {"share": 0.3, "depth_mm": 3.46, "links_mm": None},
        "beyond_bound_mm": 1.26, "path_length_mm": 500.0, "force_n": mean_max, "held_s": 1.0,
        "task": {"title": "Polyps", "completed": True, "rows": rows, "lacking": "Views are not scored."},
    }  # fmt: skip
    facts = facts_of(score)
    assert dict(facts) == {
        "Time driven": "1:01 min", "Depth": "412 mm", "Share of the route": "50 %", "Time in": "40.0 s",
        "Withdrawal": "not drawn out", "Deviations": "3, 2.5 s", "Deviation, largest": "6.3 mm",
        "Nearest to a bound": "6.3 mm", "Bound, largest": "8.0 mm", "Beyond bound": "1.3 mm",
        "Behind wall, links": "not measured", "Behind wall, pathway": "30 %, 3.5 mm", "Path of the tip": "500 mm",
        "Hand force, mean": "1.00 N", "Hand force, largest": "6.3 N", "Held": "1.0 s", "Task completed": "yes",
        "Completed in": "13.0 s", "Angle error": "–", "Polyps": "Views are not scored.",
    }  # fmt: skip
    page = (Path(__file__).parents[3] / "app" / "web" / "js" / "lumen-score.js").read_text(encoding="utf-8")
    assert re.findall(r'name: "([^"]+)"', page) == [name for name, _ in facts][:16]


def test_what_cannot_be_scored_ends_the_command(old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["score", old_runs["rigid"], old_runs["snake"], "--errors", "papers", "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert "no error chain" in told["error"]["message"]
    assert main(["score", "run-nobody"]) == 2
    assert "run-nobody" in capsys.readouterr().err
