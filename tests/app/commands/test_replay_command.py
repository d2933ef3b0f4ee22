"""`vfix replay`: runs of every world are the recorded ones again; what is not is told, and ends with status 1."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.commands.replay import compare
from tests.engine.tiny import TinySpec
from vfix_engine.runtime import Command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import Replay, replay
from vfix_engine.runtime.run import Run, RunWriter

SPEC = TinySpec(0.7)


@pytest.mark.parametrize("world", ["rigid", "snake", "snake drive"])
def test_a_run_of_before_is_verified(old_runs: dict[str, str], world: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", old_runs[world], "--verify", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["run"], told["world"], told["verified"]) == (old_runs[world], world, True)
    assert told["same_hash"] or told["other_arithmetic"], "on the kind of processor that recorded it"
    assert told["same_hash"] == (told["sha256"]["recorded"] == told["sha256"]["replayed"])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run of a tiny world."""
    system = SPEC.build()
    writer = RunWriter(tmp_path / "one.run", SPEC, system.row_layout)
    driver = Driver(system, log=writer)
    for push in np.random.default_rng(1).normal(size=(40, 3)):
        driver.step(Command(push))
    writer.close()
    return tmp_path / "one.run"


def changed(run: Run, away: float, **versions: str) -> tuple[Run, Replay]:
    """The run with another value in its step 12, as if another machine had recorded it, and its replay."""
    ticks = run.ticks.copy()
    ticks[12, -1] += away
    made = replace(run, ticks=ticks, manifest=run.manifest | {"versions": run.manifest["versions"] | versions})
    return made, replay(made, SPEC)


@pytest.mark.parametrize(
    ("away", "versions", "verified", "words"),
    [
        (0.0, {}, True, "bit by bit"),
        (0.0, {"blas_core": "Nehalem"}, True, "bit by bit"),
        (1e-11, {}, False, "with the same arithmetic"),
        (1e-11, {"vfix": "0.0"}, False, "with the same arithmetic"),
        (1e-11, {"blas_core": "Nehalem"}, True, "within 1e-09"),
        (1e-11, {"blas_core": ""}, True, "for unknown"),
        (1e-7, {"blas_core": "Nehalem"}, False, "more than other arithmetic"),
        (np.inf, {"blas_core": "Nehalem"}, False, "more than other arithmetic"),
        (np.nan, {"blas_core": "Nehalem"}, False, "more than other arithmetic"),
    ],
)
def test_the_last_bits_may_differ_on_another_processor_only(
    folder: Path, away: float, versions: dict[str, str], verified: bool, words: str
) -> None:
    run, again = changed(Run.read(folder), away, **versions)
    told = compare(run, again)
    assert (told["verified"], told["same_hash"], told["same_cpu"]) == (verified, not away, "blas_core" not in versions)
    assert told["first_difference"] == (12 if away else None)
    assert words in told["words"]
    json.dumps(told, allow_nan=False)
    if not away:
        assert told["sha256"]["recorded"] == json.loads((folder / "end.json").read_text())["sha256"]


def test_a_run_that_differs_ends_with_status_1_only_where_it_is_verified(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    report = compare(*changed(Run.read(folder), 1e-3))
    monkeypatch.setattr("app.commands.replay.replayed", lambda name: report)
    assert main(["replay", str(folder), "--verify"]) == 1
    assert "is not the recorded run: it differs from step 12 on" in capsys.readouterr().out
    assert main(["replay", str(folder)]) == 0
