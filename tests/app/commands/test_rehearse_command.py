"""`vfix rehearse` on the real head, as its user would: figures, recording, refusals."""

from __future__ import annotations

import csv
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.cli import main
from app.commands.rehearse import DRIVES
from app.commands.rehearse_arguments import OPERATORS, RECORDED
from app.exchange import resolve
from tests.engine.scenes import CoalJudge
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.worlds.rigid import preparation


@pytest.fixture
def head(trial_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The arguments that name the real corridor, in a home of their own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    folder = trial_data / "head_ct"
    return ["--case", str(folder / "nose_sinus_bone_lps_mm.ply"), "--plan", str(folder / "corridor.mrk.json")]


def beginning(head: list[str], folder: Path) -> list[str]:
    """The same arguments with the first two points of the corridor only."""
    markups = json.loads(Path(head[3]).read_text(encoding="utf-8"))["markups"][0]
    assert markups["coordinateSystem"] == "LPS"
    rows = [",".join(map(str, point["position"])) for point in markups["controlPoints"][:2]]
    file = folder / "beginning.csv"
    file.write_text("\n".join(["# frame=LPS", "# unit=mm", "x,y,z", *rows, ""]), encoding="utf-8")
    return [*head[:3], str(file)]


def rehearse(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict]:
    status = main(["rehearse", *arguments, "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("failure", [None, subprocess.CalledProcessError(1, "half")])
def test_the_first_one_compiles_the_engine_and_says_so(
    failure: Exception | None,
    head: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before the first tree is made; where it fails, kernels are compiled as they are called."""
    head = beginning(head, tmp_path)
    events: list[str] = []

    def prepare() -> None:
        events.append("prepare")
        if failure is not None:
            raise failure

    def grow(mesh: TriangleMesh) -> ProximityTree:
        events.append("tree")
        return ProximityTree(mesh)

    monkeypatch.setattr(preparation, "prepare", prepare)
    monkeypatch.setattr(preparation, "is_prepared", lambda: False)
    monkeypatch.setattr(resolve, "ProximityTree", grow)
    assert main(["rehearse", *head, "--tool", "no such tool"]) != 0
    assert not events
    assert "on the first start" not in capsys.readouterr().err
    assert main(["rehearse", *head, "--operator", "pushing", "--steps", "5", "--json"]) in (0, 1)
    told = capsys.readouterr()
    assert events == ["prepare", "tree"]
    assert "on the first start only" in told.err
    json.loads(told.out)
    if failure is not None:
        return
    monkeypatch.setattr(preparation, "is_prepared", lambda: True)
    main(["rehearse", *head, "--operator", "pushing", "--steps", "5", "--json"])
    assert events == ["prepare", "tree", "tree"]
    assert "on the first start" not in capsys.readouterr().err


def test_the_corridor_is_driven_and_every_step_is_kept(
    head: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-01: the recording itself is judged by coal, so that the figures cannot flatter."""
    file = tmp_path / "run.csv"
    status, report = rehearse([*head, "--operator", "scripted", "--record", str(file)], capsys)
    assert status == 0
    assert report["completed"] is True
    assert report["tip_error_mm"]["mean"] <= 0.01
    assert report["tip_error_mm"]["max"] <= 0.05
    assert report["min_clearance_mm"] >= report["margin_mm"] == 0.3
    assert set(report["step_time_us"]) == {"median", "p99"}
    assert 0 < report["qp_rows"]["min"] <= report["qp_rows"]["max"]
    assert report["path_length_mm"] == pytest.approx(86.3, abs=0.1)
    assert report["min_bone_clearance_mm"] == report["min_clearance_mm"]
    nothing = {"length_mm": None, "at_mm": None, "complete": False}
    assert report["soft_tissue"] == nothing, "a surface tells of bone alone"
    (warning,) = report["warnings"]
    assert "is not known, since it came without a CT" in warning
    assert report["notice"] == "Not for clinical use."
    with file.open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == report["steps"]
    table = {name.split(" [")[0]: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    assert {"t [s]", "tip_x [mm]", "command_force_x [N]", "not_for_clinical_use"} <= rows[0].keys()
    assert [n for n in table if n.startswith("q")] == [f"q{i}" for i in range(7)]
    loaded = trimesh.load(head[1], process=False)
    judge = CoalJudge(TriangleMesh(np.asarray(loaded.vertices), np.asarray(loaded.faces)))
    for i in range(0, len(rows), 60):
        ends = {e: np.array([[table[f"s{s}_{e}{a}"][i] for a in "xyz"] for s in range(2)]) for e in "ab"}
        radius = np.array([table[f"s{s}_r"][i] for s in range(2)])
        assert judge.clearance(Segments(ends["a"], ends["b"], radius)) >= 0.3 - 1e-6
    tip = np.column_stack([table["tip_x"], table["tip_y"], table["tip_z"]])
    first = np.column_stack([table[f"s0_b{a}"] for a in "xyz"])
    np.testing.assert_allclose(tip, first, atol=1e-12)


def test_a_ct_tells_the_soft_tissue_and_what_the_margin_does_not_cover(
    head: list[str], trial_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bone clearance is kept while the shaft runs through the tip of the nose; slices are 2 mm apart."""
    ct = ["--case", str(trial_data / "head_ct" / "cthead_hu_lps.nrrd"), "--tool", "straight_pointer"]
    assert main(["rehearse", *head, *ct, "--json"]) == 0
    told = capsys.readouterr()
    report = json.loads(told.out)
    assert report["min_bone_clearance_mm"] >= 0.3
    assert 4.0 < report["soft_tissue"]["length_mm"] < 30.0
    assert report["soft_tissue"]["complete"]
    (warning,) = report["warnings"]
    assert "slices 2 mm apart), more than the 0.30 mm that are kept" in warning
    assert warning in told.err


@pytest.mark.parametrize("free", [[], ["--free"]])
def test_the_pushing_hand_reaches_the_margin_and_no_further(
    head: list[str], free: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-01: at least 2,000 steps of full force."""
    status, report = rehearse([*head, "--operator", "pushing", "--seed", "3", *free], capsys)
    assert status == 0
    assert report["steps"] >= 2000
    assert report["pushing"]["steps"] == 2000
    assert 0.3 <= report["min_clearance_mm"] <= report["pushing"]["min_clearance_mm"] <= 0.35


def test_targets_of_a_file_are_inspected(head: list[str], trial_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    targets = str(trial_data / "head_ct" / "targets.mrk.json")
    status, report = rehearse([*head, "--task", "inspect", "--targets", targets, "--steps", "800"], capsys)
    assert status == 0
    assert [t["target"] for t in report["targets"]] == ["sphenoid_sinus", "maxillary_sinus_image_left"]
    for target in report["targets"]:
        assert target["reached"]
        assert target["error_mm"]["max"] <= 0.02
        assert target["swing_deg"] > 1.0
    assert report["min_clearance_mm"] >= 0.3


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--free"], "--operator pushing"),
        (["--margin", "nan"], "margin"),
        (["--margin", "900"], "0.05"),
        (["--tool", "spoon"], "bent_30"),
        (["--record", "/no/such/folder/x.csv"], "cannot be written"),
        (["--record", "run.xlsx"], "ends in .csv, .parquet, .mcap"),
        (["--task", "inspect", "--targets", "/no/such.mrk.json"], "such.mrk.json cannot be read"),
    ],
)
def test_what_cannot_be_done_is_said(
    head: list[str], arguments: list[str], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main(["rehearse", *head, *arguments, "--json"])
    printed = capsys.readouterr()
    assert status == 2
    assert word in json.loads(printed.out)["error"]["message"]
    assert "Traceback" not in printed.err


def test_whoever_can_drive_can_be_chosen() -> None:
    assert {*DRIVES, RECORDED} == set(OPERATORS)
