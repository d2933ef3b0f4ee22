"""`vfix lumen task kwok2`, as its user would: one label in the cavity, its figures, and the run that they are of."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.services import build_services
from app.settings import Settings
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import COMMAND_COLUMNS
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run
from vfix_engine.runtime.system import Column
from vfix_engine.study.diathermy.live import LiveLabels
from vfix_engine.study.diathermy.table import measured
from vfix_engine.study.diathermy.task import first_state
from vfix_engine.study.lumen import task_replay
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.snake.cavity import cavity_case


def test_a_line_is_traced_and_its_figures_are_those_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    status = main(["lumen", "task", "kwok2", "--labels", "1", "--seed", "2", "--arm", "certified", "--json"])
    printed = capsys.readouterr()
    report = json.loads(printed.out)
    assert status == 0
    assert (report["task"], report["operator"], report["arm"], report["seed"]) == ("kwok2", "oracle", "certified", 2)
    assert (report["completed"], report["labels_traced"], report["of"]) == (True, 1, 1)
    assert report["beyond_bound_mm"] == 0.0
    assert report["untraceable"] == report["placing"]["drawn"] - 1
    row = report["labels"][0]
    assert row["distance_mm"] is None
    assert row["line_error_mm"] < 0.5
    assert row["angle_error_deg"] < 1.7  # Kwok 2013, section IV.C.2
    assert "1 of 1 labels traced" in printed.err
    services = build_services(Settings(home=tmp_path / "home", port=0))
    try:
        with services.runs.laid_out(report["run"]) as folder:
            run = Run.read(folder)
    finally:
        services.close()
    sight = Wall(cavity_case().mesh).free
    seen = measured(run, sight)
    found = seen.to_dict()
    assert found["labels"] == [{name: row[name] for name in found["labels"][0]}]
    assert (found["labels_traced"], found["beyond_bound_mm"]) == (1, 0.0)
    live = LiveLabels(
        seen.labels,
        SnakeModel(**run.manifest["spec"]["snake"]),
        [*(Column(*one) for one in COMMAND_COLUMNS), *run.columns],
        sight,
    )
    for some in np.array_split(run.ticks, 7):  # as a page follows the drive: the same state, to the last bit
        live.read(some)
    assert live.state == seen.state
    shown = task_replay(run, 20.0, cavity_case().mesh)
    assert (shown.moments[0].state, shown.moments[-1].state) == (first_state(seen.labels), seen.state)  # type: ignore[union-attr]
    assert np.array_equal(shown.moments[-1].way.places, live.way.places)  # type: ignore[union-attr]
    assert live.completed
    assert live.way.red.any()
    assert np.linalg.norm(np.diff(live.way.places, axis=0), axis=1).max() < 3.0
    assert replay(run, spec_of(run), keep_states=False).same


def test_a_number_of_labels_that_the_study_has_not_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["lumen", "task", "kwok2", "--labels", "7"])
    assert "--labels" in capsys.readouterr().err
