"""`vfix bench`: what it prints, what it refuses, and its exit status."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from app import cli
from app.commands import bench
from benchmarks import BENCHMARKS, cases, cockpit, realtime, report, step
from tests.engine.scenes import curved_tube
from vfix_engine.errors import VfixError
from vfix_engine.geometry.path import SplinePath


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """A benchmark of its own, which answers what its test lets it answer."""
    made = types.ModuleType("benchmarks.sample")
    made.SUMMARY = "a sample"  # type: ignore[attr-defined]
    made.add_arguments = lambda parser: parser.add_argument("--size", type=int, default=3)  # type: ignore[attr-defined]
    made.run = lambda args: {"size": args.size, "correct": True}  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "benchmarks.sample", made)
    monkeypatch.setattr(bench, "BENCHMARKS", ("sample",))
    return made


def case_options(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    cases.add_arguments(parser)
    return parser.parse_args(words)


def test_json_is_one_object(module: types.ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["bench", "sample", "--size", "5", "--json"]) == 0
    out = capsys.readouterr().out
    assert json.loads(out) == {"benchmark": "sample", "size": 5, "correct": True}
    assert len(out.splitlines()) == 1


def test_a_wrong_answer_is_status_1(module: types.ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    module.run = lambda args: {"correct": False}  # type: ignore[attr-defined]
    assert cli.main(["bench", "sample"]) == 1
    assert "not correct" in capsys.readouterr().err


def test_without_a_peer_it_says_what_to_install(
    module: types.ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "coal", None)  # as if it were not installed
    module.run = lambda args: {"coal": str(report.need("coal"))}  # type: ignore[attr-defined]
    assert cli.main(["bench", "sample", "--json"]) == 2
    said = capsys.readouterr()
    assert "pip install 'vfix[test]'" in said.err
    assert json.loads(said.out)["error"]["code"] == "benchmark_refused"


def test_people_read_a_table() -> None:
    lines = list(
        bench.table(
            {
                "ratios": {"all_pairs": 31.25, "memory": None},
                "correct": True,
                "scaling": [{"triangles": 10_000, "us": 16.25}, {"triangles": 2_000_000, "us": 1219.5}],
                "missing": {},
            }
        )
    )
    assert lines[0] == "ratios"
    assert lines[1].split() == ["all", "pairs", "31.25"]
    assert lines[2].endswith("not measured")
    assert lines[3].split() == ["correct", "yes"]
    assert lines[5].split() == ["triangles", "us"]
    assert [line.split() for line in lines[6:8]] == [["10,000", "16.25"], ["2,000,000", "1,220"]]
    assert lines[5].index("us") + 2 == len(lines[6]) == len(lines[7])
    assert lines[8].split() == ["missing", "none"]


def test_every_benchmark_describes_itself() -> None:
    for name in BENCHMARKS:
        assert bench._module(name).SUMMARY
    assert len(set(BENCHMARKS)) == len(BENCHMARKS)


def test_the_machine_is_named() -> None:
    here = report.machine().to_dict()
    assert here["numpy"]
    assert here["numba"]
    assert here["coal"]
    assert here["cpu"]
    assert here["cores"] >= 1
    json.dumps(here, allow_nan=False)


def test_candidates_take_turns() -> None:
    called: list[str] = []
    seconds = report.interleaved({"a": lambda: called.append("a"), "b": lambda: called.append("b")}, 3)
    assert called == ["a", "b"] * 4  # one round is not counted
    assert {name: len(times) for name, times in seconds.items()} == {"a": 3, "b": 3}
    assert report.spread_us([1e-6, 3e-6, 2e-6])["median_us"] == pytest.approx(2.0)


def test_a_head_that_is_not_there_is_said_to_be_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VFIX_TRIAL_DATA", str(tmp_path))
    found = cases.find_cases(case_options())
    assert [case.name for case in found.found] == ["phantom"]
    measured = found.measure(lambda case: {"triangles": len(case.mesh.faces)})
    assert measured["cases"]["phantom"]["triangles"] > 100_000
    assert measured["cases"]["head"] is None
    assert str(tmp_path) in measured["missing"]["head"]
    with pytest.raises(VfixError, match="VFIX_TRIAL_DATA"):
        cases.find_cases(case_options("--case", "head"))


@pytest.fixture(scope="module")
def tube() -> cases.BenchCase:
    mesh, points = curved_tube()
    return cases.BenchCase("tube", mesh, SplinePath(points))


def test_a_driven_process_is_judged(
    tube: cases.BenchCase, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-10: correct where every tick was a step and the margin was kept; a tick too many is status 1."""
    monkeypatch.setattr(cases, "find_cases", lambda args: cases.Cases((tube,), {}))
    assert cli.main(["bench", "realtime", "--seconds", "0.5", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    one = told["cases"]["tube"]
    assert told["correct"]
    assert one["correct"]
    assert one["steps"] == one["ticks"] > 0
    assert one["moved_mm"] > 0.0
    assert one["min_clearance_mm"] >= 0.3
    monkeypatch.setattr(realtime, "_measure", lambda *_: one | {"correct": False})
    assert cli.main(["bench", "realtime", "--seconds", "0.5"]) == 1


@pytest.mark.parametrize(
    "words", [("step", "--steps", "100"), ("proximity", "--no-scaling", "--poses", "24", "--rounds", "3")]
)
def test_a_short_run_against_the_peers_is_correct(
    tube: cases.BenchCase, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both answer the same as the libraries they are compared with; how fast is not judged here."""
    monkeypatch.setattr(cases, "find_cases", lambda args: cases.Cases((tube,), {}))
    assert cli.main(["bench", *words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["correct"]
    assert told["cases"]["tube"] is not None


def test_steps_without_a_like_are_counted_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that is cut short or held is not compared with the stack's, which says so."""
    outcomes = ["moved", "shrunk", "moved", "held"]
    state = types.SimpleNamespace(q=np.zeros(2), clearance=1.0)
    done = iter(types.SimpleNamespace(outcome=outcome, state=state) for outcome in outcomes)
    answer = types.SimpleNamespace(seconds=(1e-3,), pairs=3, step=np.zeros(2), clearance=1.0)
    stack: Any = types.SimpleNamespace(step=lambda *_: answer)
    controller: Any = types.SimpleNamespace(step=lambda *_: next(done))
    scene = types.SimpleNamespace(placed_robot=lambda: None, tool=None)
    monkeypatch.setattr(cases, "drive", lambda *_: types.SimpleNamespace(scene=scene))
    monkeypatch.setattr(step, "Stack", lambda *_, **__: stack)
    case: Any = types.SimpleNamespace(mesh=None)
    moment: Any = (state, types.SimpleNamespace(scale=0.01))
    drive = step._Drive(None, case, 20)
    drive._compare([moment] * step.BLOCK, controller)
    assert drive._outcomes == {"moved": 2, "shrunk": 1, "held": 1}
    assert len(drive._steps_apart) == 2


def test_uncompiled_the_engine_says_what_to_do() -> None:
    command = [sys.executable, "-m", "app.cli", "rehearse", "--case", "one", "--plan", "two"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("vfix: NUMBA_DISABLE_JIT is set; ")
    assert done.stderr.count("\n") == 1


def test_the_real_head_and_files_of_ones_own(trial_data: Path) -> None:
    folder = trial_data / "head_ct"
    surface, corridor = folder / "nose_sinus_bone_lps_mm.ply", folder / "corridor.mrk.json"
    (head,) = cases.find_cases(case_options("--case", "head")).found
    (own,) = cases.find_cases(case_options("--surface", str(surface), "--path", str(corridor))).found
    assert own.name == surface.name
    assert own.mesh.content_hash == head.mesh.content_hash
    assert own.path.length == head.path.length
    with pytest.raises(VfixError, match="go together"):
        cases.find_cases(case_options("--surface", str(surface)))


@pytest.mark.parametrize(
    ("value", "words"),
    [(None, "not measured"), (True, "yes"), (False, "no"), (0.000123456, "0.0001235"), (12345.6, "12,346"), (7, "7")],
)
def test_figures_are_calm(value: Any, words: str) -> None:
    assert bench.figure(value) == words


def test_the_interval_of_a_ratio_is_that_of_student() -> None:
    logs = np.log([1.1, 0.9, 1.3, 1.0, 1.25, 0.95])
    half = stats.t.interval(0.95, len(logs) - 1, loc=logs.mean(), scale=stats.sem(logs))
    assert cockpit.interval(logs.tolist()) == pytest.approx(np.exp([logs.mean(), *half]), rel=1e-3)
