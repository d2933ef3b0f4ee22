"""`vfix run`: stored runs are listed newest first, filtered, shown and deleted."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli import main


def listed(capsys: pytest.CaptureFixture[str], *options: str) -> list[dict]:
    assert main(["run", "list", *options, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert isinstance(found, list)
    return found


def test_runs_are_listed_newest_first_and_filtered(
    old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    every = listed(capsys)
    assert [one["id"] for one in every] == [old_runs[world] for world in ("snake drive", "snake", "rigid")]
    assert [one["recorded"] for one in every] == sorted((one["recorded"] for one in every), reverse=True)
    rigid = every[2]
    said = ("case_name", "plan_name", "mode", "world", "certified", "whole", "ticks", "lost", "origin")
    assert [rigid[key] for key in said] == [
        "Made-up head", "Through the tube", "hands-on", "rigid", True, True, 750, 0, "page",
    ]  # fmt: skip
    for options in (["--case", "Made-up head"], ["--plan", "Through the tube"], ["--plan", rigid["plan"]],
                    ["--mode", "hands-on"], ["--case", rigid["case"], "--limit", "3"]):  # fmt: skip
        assert listed(capsys, *options) == [rigid], options
    assert listed(capsys, "--limit", "2") == every[:2]
    assert listed(capsys, "--mode", "freehand") == []
    assert main(["run", "list", "--plan", "None of these"]) == 2
    capsys.readouterr()
    assert main(["run", "list"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[2].split()[0] == rigid["id"]
    assert "Through the tube, Made-up head" in out[2]


def test_a_run_is_marked_as_the_teachers_and_not(old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "teacher", old_runs["rigid"], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["teacher"] is True
    assert {one["id"] for one in listed(capsys) if one["teacher"]} == {old_runs["rigid"]}
    assert main(["run", "list"]) == 0
    assert "(teacher)" in capsys.readouterr().out
    assert main(["run", "teacher", old_runs["rigid"], "--off"]) == 0
    assert "no longer the teacher's" in capsys.readouterr().out
    assert not any(one["teacher"] for one in listed(capsys))
    assert main(["run", "teacher", old_runs["snake"]]) == 2
    assert "rigid tool" in capsys.readouterr().err


def test_a_run_is_commented_on(old_runs: dict[str, str], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for run in old_runs.values():  # of every world
        assert main(["run", "comment", run, "--at", "0.02", "Slower here", "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        assert (said["text"], said["t_s"]) == ("Slower here", 0.02)
        assert main(["run", "comment", run, "--edit", said["id"], "Slower"]) == 0
        assert capsys.readouterr().out == f"{said['id']} at 0.0 s: Slower\n"
    rigid = old_runs["rigid"]
    assert main(["run", "show", rigid, "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["comments"]
    assert one["text"] == "Slower"
    assert main(["run", "export", rigid, str(tmp_path / "run.csv")]) == 0
    assert json.loads((tmp_path / "run.csv.about.json").read_text())["comments"] == [one]
    assert main(["report", rigid, "-o", str(tmp_path / "run.html")]) == 0
    assert "<td>0.0 s</td><td>Slower</td>" in (tmp_path / "run.html").read_text()
    capsys.readouterr()
    assert main(["run", "show", rigid]) == 0
    assert "0.0 s  Slower" in capsys.readouterr().out
    for wrong in (["x"], ["--edit", "c-0", "x"], ["--at", "99", "x"], ["--at", "nan", "x"], ["--at", "0", "a\tb"]):
        assert main(["run", "comment", rigid, *wrong]) == 2, wrong
    assert main(["run", "comment", rigid, "--delete", one["id"]]) == 0
    assert main(["run", "comment", rigid, "--delete", one["id"]]) == 2


def test_a_run_is_shown_with_its_manifest_and_deleted(
    old_runs: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "show", old_runs["rigid"], "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert ["tip_x", "mm"] in shown["manifest"]["columns"]
    assert (shown["id"], shown["notice"]) == (old_runs["rigid"], "Not for clinical use.")
    assert main(["run", "delete", old_runs["rigid"], "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"deleted": old_runs["rigid"]}
    assert old_runs["rigid"] not in [one["id"] for one in listed(capsys)]
    for action in ("show", "delete"):
        assert main(["run", action, old_runs["rigid"]]) == 2
        assert old_runs["rigid"] in capsys.readouterr().err
