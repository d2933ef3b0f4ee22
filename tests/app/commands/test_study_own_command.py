"""`vfix study new`, `run`, `order`, `attach` and `power`, as their user runs them."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from app.cli import main
from app.commands import study_own
from vfix_engine.study.own.simulated import SimulatedTrials

STUDY = """
name = "Two <modes>"
seed = 3
trials = 1
modes = ["freehand", "hands-on"]
arms = ["li2007"]
metrics = ["time_s", "path_error_mm", "completed"]
plans = [{case = "head-phantom", plan = "head-phantom-sample"}]
subjects = {simulated = 2, codes = ["P01", "P02"]}
"""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    return tmp_path


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def test_a_whole_study_is_cancelled_resumed_attached_to_and_reported(
    home: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file, results = home / "two.toml", home / "two.results"
    file.write_text(STUDY, encoding="utf-8")
    run = ["study", "run", str(file), "--workers", "1"]

    own, made = SimulatedTrials.__call__, list[str]()

    def cancelled(self: SimulatedTrials, name: Any) -> Any:
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(name.subject)
        return own(self, name)

    with monkeypatch.context() as patch:
        patch.setattr(SimulatedTrials, "__call__", cancelled)
        assert main(run) == 130
    assert "2 of 4 trials are done and stay" in capsys.readouterr().err
    first = {one.name: one.read_bytes() for one in (results / "trials").iterdir()}
    assert len(first) == 2  # what was done stays

    found = told(capsys, *run)
    after = {one.name: one.read_bytes() for one in (results / "trials").iterdir()}
    assert len(after) == 4
    assert first.items() <= after.items()
    simulated, people = found["groups"]["simulated people"], found["groups"]["people"]
    assert (simulated["done"], len(simulated["missing"]), len(people["missing"])) == (4, 0, 4)
    pair = simulated["metrics"]["path_error_mm"]["pairs"]["freehand - hands-on"]
    assert pair["n"] == 2
    assert pair["mean"] > 0.3  # a free hand is farther off

    monkeypatch.setattr(study_own, "run_all", _not_again)
    assert told(capsys, *run) == found
    _attach(home, file, capsys)
    _check_files(results, told(capsys, *run))


def _not_again(trials: Any, wanted: list[Any], *others: Any) -> dict[Any, Any]:
    assert not wanted
    return {}


def _attach(home: Path, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A recorded run of a free hand becomes the trial of P01, and of nothing else."""
    head = ["--case", "head-phantom", "--plan", "head-phantom-sample"]
    recorded = told(capsys, "rehearse", *head, "--mode", "freehand", "--steady")["run"]
    order = told(capsys, "study", "order", str(file))
    turns = {row["condition"]: row["position"] for row in order["order"] if row["subject"] == "P01"}
    assert sorted(turns.values()) == [1, 2]
    attach = ["study", "attach", str(file), recorded, "--subject", "P01"]
    assert main([*attach, "--position", str(turns["hands-on"])]) == 2
    assert "was driven freehand, not hands-on" in capsys.readouterr().err
    assert main([*attach[:-1], "P1"]) == 2
    assert "did you mean 'P01'" in capsys.readouterr().err
    found = told(capsys, *attach, "--position", str(turns["freehand"]))
    assert (found["run"], found["metrics"]["completed"]) == (recorded, 1.0)
    table = home / "order.csv"
    after = told(capsys, "study", "order", str(file), "--csv", str(table))
    assert after["next"]["P01"]["condition"] == "hands-on"
    with table.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["done"] for row in rows if row["subject"] == "P01" and row["condition"] == "freehand"] == ["True"]
    assert main([*attach, "--position", str(turns["freehand"])]) == 0  # again: it replaces itself
    assert main([*attach]) == 2
    assert "already" in capsys.readouterr().err
    assert main([*attach[:-1], "P02"]) == 2
    assert "of P01 already" in capsys.readouterr().err


def _check_files(results: Path, found: dict[str, Any]) -> None:
    """Table, statistics and page say the same."""
    assert found["groups"]["people"]["done"] == 1
    with (results / "trials.csv").open(encoding="utf-8") as stream:
        assert stream.readline() == "# Not for clinical use.\n"
        rows = list(csv.DictReader(stream))
    assert [row["subject"] for row in rows].count("P01") == 1
    table = pq.read_table(results / "trials.parquet").to_pylist()
    assert [row["time_s"] for row in table] == [float(row["time_s"]) for row in rows]
    assert json.loads((results / "statistics.json").read_text(encoding="utf-8")) == {
        name: value for name, value in found.items() if name != "files"
    }
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "Two &lt;modes&gt;" in page
    assert "3 trials missing" in page
    assert {file.name for file in results.iterdir()} == {*found["files"], "trials"}
    svg = (results / "simulated_people_time_s.svg").read_text(encoding="utf-8")
    assert svg.startswith('<svg xmlns="http://www.w3.org/2000/svg"')
    assert svg.count("<circle") == 2


def test_the_template_is_a_study_and_replaces_no_file(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = home / "mine.toml"
    told(capsys, "study", "new", str(file))
    study = study_own.read_study(file)
    assert (study.subjects.simulated, study.trials) == (10, 5)
    assert main(["study", "new", str(file)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["study", "order", str(file)]) == 2
    assert "no codes of people" in capsys.readouterr().err


def test_power_of_the_first_of_three_comparisons(capsys: pytest.CaptureFixture[str]) -> None:
    """The figures of a study of ten with Holm's first step."""
    found = told(capsys, "study", "power", "--subjects", "10", "--effect", "1.5", "--comparisons", "3")
    assert found["power"] == pytest.approx(0.94, abs=0.01)
    assert found["needed"]["80%"] <= 10 <= found["needed"]["90%"] + 1
    assert main(["study", "power", "--subjects", "1", "--effect", "1"]) == 2
    assert "two subjects" in capsys.readouterr().err


def test_what_cannot_be_run_is_refused_before_anything_is_computed(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = home / "two.toml"
    for change, words in (
        ('operator = "persn"\n', "did you mean 'person'"),
        ('arms = ["li2008"]\n', "did you mean 'li2007'"),
        ('metrics = ["time"]\n', "did you mean 'time_s'"),
        ('case = "x"\n', "unknown key 'case'"),
    ):
        lines = [line for line in STUDY.splitlines() if line.split(" = ")[0] != change.split(" = ")[0]]
        file.write_text("\n".join([*lines, change]), encoding="utf-8")
        assert main(["study", "run", str(file)]) == 2
        assert words in capsys.readouterr().err
