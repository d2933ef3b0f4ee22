"""`vfix lumen task kwok1` in a short tube, as its user would: figures, the run, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.commands.lumen_options import lumen_surface
from app.services import build_services
from app.settings import Settings
from vfix_engine.anatomy.lumen.synthetic import write_stl
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run
from vfix_engine.study.lumen import score_lumen_run
from vfix_engine.study.polyps.series import polyp_series, task_of
from vfix_engine.study.polyps.sight import LumenSight
from vfix_engine.study.polyps.table import PRINTED, table_iii
from vfix_engine.worlds.registry import spec_of

_LENGTH, _RADIUS, _RINGS, _SECTORS = 240.0, 16.0, 49, 24


def tube() -> TriangleMesh:
    """A closed tube along z."""
    z, angle = np.meshgrid(
        np.linspace(0.0, _LENGTH, _RINGS), 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS, indexing="ij"
    )
    rings = np.column_stack([_RADIUS * np.cos(angle).ravel(), _RADIUS * np.sin(angle).ravel(), z.ravel()])
    i, j = (one.ravel() for one in np.meshgrid(np.arange(_RINGS - 1), np.arange(_SECTORS), indexing="ij"))
    a, b, k = i * _SECTORS + j, i * _SECTORS + (j + 1) % _SECTORS, np.arange(_SECTORS)
    last, count = (_RINGS - 1) * _SECTORS, len(rings)
    floor = np.column_stack([np.full(_SECTORS, count), (k + 1) % _SECTORS, k])
    lid = np.column_stack([np.full(_SECTORS, count + 1), last + k, last + (k + 1) % _SECTORS])
    sides = [np.column_stack([a, b, a + _SECTORS]), np.column_stack([b, b + _SECTORS, a + _SECTORS])]
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, _LENGTH]])
    return TriangleMesh(np.concatenate([rings, ends]), np.concatenate([*sides, floor, lid]).astype(np.int32))


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Runs are stored in a data folder of this test's own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


@pytest.fixture
def told(tmp_path: Path) -> list[str]:
    """The arguments of a task with two polyps in the tube."""
    write_stl(tmp_path / "tube.stl", tube())
    marks = {"rectosigmoid": [0.0, 0.0, 100.0], "ascending": [0.0, 0.0, 200.0]}
    (tmp_path / "marks.json").write_text(json.dumps({"landmarks": marks}), encoding="utf-8")
    ends = ["--surface", str(tmp_path / "tube.stl"), "--start", "0,0,8", "--end", "0,0,232"]
    return [
        "lumen",
        "task",
        "kwok1",
        *ends,
        "--landmarks",
        str(tmp_path / "marks.json"),
        "--links",
        "8",
        "--every",
        "20",
    ]


def test_two_polyps_are_cleared_and_the_figures_are_those_of_the_run(
    told: list[str], home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main([*told, "--polyps", "2", "--seed", "2", "--arm", "certified", "--json"])
    printed = capsys.readouterr()
    report = json.loads(printed.out)
    assert status == 0
    assert (report["task"], report["operator"], report["arm"], report["seed"]) == ("kwok1", "oracle", "certified", 2)
    assert (report["completed"], report["polyps_cleared"], report["of"]) == (True, 2, 2)
    assert report["ends_at"] == "the landmark 'ascending'"
    assert list(report["table_iii"]) == list(PRINTED)
    assert report["table_iii"]["polyps_missed"] == 0
    assert report["table_iii"]["completion_time_s"] > 2 * 7.0 + 180.0 / 20.0
    assert 0.0 < report["table_iii"]["distance_error_mm"] < 7.0
    assert 0.0 < report["table_iii"]["angle_error_deg"] < 20.0
    assert report["beyond_bound_mm"] == 0.0
    assert 0.0 < report["viewable_share"] <= 1.0
    assert 0.0 < report["seen_share"] <= 1.0
    assert "polyp 2 of 2 cleared" in printed.err
    services = build_services(Settings(home=home, port=0))
    try:
        with services.runs.laid_out(report["run"]) as folder:
            run = Run.read(folder)
    finally:
        services.close()
    task, first = task_of(run)
    assert (len(task.polyps), first) == (2, 0)
    series = polyp_series(run, LumenSight(tube(), task))
    assert table_iii(series).to_dict() == report["table_iii"]
    assert replay(run, spec_of(run), keep_states=False).same  # the task changes nothing of the drive
    assert main(["score", report["run"], "--json"]) == 0
    (score,) = json.loads(capsys.readouterr().out)["runs"]
    assert (score["completed"], score["task"]["completed"]) == (True, True)
    assert "surface is missing" in score["task"]["lacking"]  # of a file that is not kept
    wall, _ = lumen_surface(Path(told[told.index("--surface") + 1]), None, None)
    scored = score_lumen_run(run, wall=wall).task
    assert scored is not None
    assert {row.name: row.value for row in scored.rows}["Angle error"] == report["table_iii"]["angle_error_deg"]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (["--polyps", "0"], "1 is the least"),
        (["--seed", "-1"], "-1 is negative"),
        (["--arm", "free"], "invalid choice"),
        (["--every", "0"], "between two depths"),
        (["--breathing", "-3"], "amplitude"),
        (["--links", "2"], "and the first polyp is to be at"),
        (["--links", "30"], "more never come in"),
        (["--operator", "nobody"], "there is no operator 'nobody'"),
    ],
)
def test_bad_input_is_refused_in_words(
    changed: list[str], words: str, told: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status = main([*told, *changed])
    except SystemExit as ended:
        status = int(str(ended.code))
    assert status == 2
    told_of = capsys.readouterr().err
    assert words in told_of
    assert "what of the wall this robot can view" not in told_of or "--every" in changed  # before the long part


HAND = """
import numpy as np
from vfix_engine.study.endoscopy.own_hand import LumenMotion

def straight_on(at):
    return lambda seen: LumenMotion(insert_mm_per_s=20.0)
"""


def test_a_hand_of_an_installed_package_does_the_task(
    told: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "hand_of_a_test.py").write_text(HAND, encoding="utf-8")
    (info := tmp_path / "hand_of_a_test-1.0.dist-info").mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: hand-of-a-test\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(
        "[vfix.lumen_operators]\nahead = hand_of_a_test:straight_on\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main([*told, "--polyps", "2", "--seed", "2", "--operator", "ahead", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["operator"], report["operator_knows"]) == ("ahead", "the picture and the force on its hand")
    assert (report["completed"], report["attempts"]) == (True, [])
    assert report["polyps_cleared"] == 0  # it passed them
    assert report["table_iii"]["completion_time_s"] < 15.0
    assert report["run"] is not None


def test_ends_without_a_surface_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lumen", "task", "kwok1", "--start", "0,0,8"]) == 2
    assert "are of a --surface" in capsys.readouterr().err
    assert main(["lumen", "task", "kwok1", "--surface", "tube.stl", "--start", "0,0,8"]) == 2
    assert "needs its two ends" in capsys.readouterr().err
