"""`vfix rehearse` with the options of the page: a drive through the remote centre, and places that cannot be."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli import main

SAMPLE = ["--case", "head-phantom", "--plan", "head-phantom-sample"]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))


@pytest.mark.parametrize(
    ("arguments", "standing"),
    [
        (["--remote-centre"], "the remote centre at 7.0 mm"),
        (["--remote-centre", "nostril", "--tool", "straight_pointer"], "the remote centre at 10.7 mm"),
    ],
)
def test_the_tool_is_driven_through_the_remote_centre_to_the_end(
    arguments: list[str], standing: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """At the rate of a drive, whose steps are a tenth as long as the dry run's."""
    status = main(["rehearse", *SAMPLE, *arguments, "--json"])
    said = json.loads(capsys.readouterr().out)
    assert (status, said["completed"], said["standing"]) == (0, True, standing)
    assert said["reached_mm"] == pytest.approx(said["path_length_mm"], abs=0.05)
    assert said["min_bone_clearance_mm"] >= said["margin_mm"]


@pytest.mark.parametrize(
    ("place", "words"),
    [("ear", "neither a number of mm nor a path point"), ("-3", "from 0 on"), ("90.08", "at the end of the path")],
)
def test_a_place_that_cannot_be_is_refused(place: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rehearse", *SAMPLE, f"--remote-centre={place}", "--json"]) == 2
    assert words in capsys.readouterr().err
