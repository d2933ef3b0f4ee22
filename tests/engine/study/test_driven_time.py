"""Driven time of runs whose control period was changed on the way: in rows, snapshots, truth, exports and hands."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.engine.study.test_series import ASIDE, CALM, recorded, scene
from vfix_engine.errors import InputError
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.requests import Reset, SetSettings
from vfix_engine.runtime.run import Run, RunEvent
from vfix_engine.study.error_chain import ErrorChain, ServoLag, TruthTally
from vfix_engine.study.metrics import score_run
from vfix_engine.study.series import series_of
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.operators import RecordedOperator
from vfix_engine.worlds.rigid.recorded_settings import driven_s, settings_of
from vfix_engine.worlds.rigid.spec import RigidSpec

PERIODS = ((0.005, 60), (0.001, 60), (0.02, 15))
TIMES = np.cumsum(np.concatenate([np.full(count, dt_s) for dt_s, count in PERIODS]))
LAG = ErrorChain(servo=ServoLag(0.05))


def changed(driver: Driver[Any], step: Any) -> None:
    step(ASIDE, count=7)
    driver.apply(Reset())
    for dt_s, count in PERIODS:
        driver.apply(SetSettings(replace(CALM, dt_s=dt_s)))
        step(ASIDE if dt_s == 0.001 else -ASIDE, count=count)


@pytest.fixture(scope="module", params=(RigidSpec, FreehandSpec), ids=lambda kind: kind.world)
def driven(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Any]]:
    folder, spec = tmp_path_factory.mktemp("driven"), request.param(scene(), CALM)
    _, seen = recorded(folder, spec, changed)
    return folder / str(spec.world), seen


def test_every_clock_tells_the_driven_time(driven: tuple[Path, list[Any]]) -> None:
    run, seen = Run.read(driven[0]), driven[1]
    np.testing.assert_allclose(run.column("t")[7:], TIMES, atol=1e-12)
    np.testing.assert_allclose([one.t for one in seen[7:]], TIMES, atol=1e-12)
    np.testing.assert_allclose(series_of(run).t, TIMES, atol=1e-12)
    assert score_run(run).time_s == pytest.approx(TIMES[-1])
    assert RecordedOperator(run).duration_s == pytest.approx(TIMES[-1])
    spec: Any = spec_of(run)
    whole = driven_s([one.dt_s for one in settings_of(run, spec.control)])
    np.testing.assert_allclose(whole[[6, 7, -1]], [0.035, 0.040, 0.035 + TIMES[-1]], atol=1e-12)


def test_the_true_tool_is_that_of_the_drive(driven: tuple[Path, list[Any]]) -> None:
    """A step of 1 ms after 5 ms was taken for a return to the start, and one of 20 ms for 3.8 s."""
    run, seen = Run.read(driven[0]), driven[1]
    spec: Any = spec_of(run)
    tally = TruthTally(LAG, spec.scene.build(), 0.3, on_robot=spec.world == "rigid")
    for snapshot in seen[7:]:
        tally.add(snapshot)
    truth, told = score_run(run, errors=LAG).truth, tally.report()["truth"]
    assert truth is not None
    assert truth["largest_difference_mm"] == pytest.approx(told["largest_difference_mm"], abs=1e-9)
    if spec.world == "rigid":
        assert truth["largest_difference_mm"] > 0.05


def test_a_run_of_before_is_replayed_bit_by_bit_and_scored_alike(driven: tuple[Path, list[Any]]) -> None:
    """Its first column was the steps times the present period, and its manifest named no clock."""
    run = Run.read(driven[0])
    spec: Any = spec_of(run)
    ticks, own = run.ticks.copy(), settings_of(run, spec.control)
    steps = np.array([*range(1, 8), *range(1, len(TIMES) + 1)])
    ticks[:, 14] = steps * [one.dt_s for one in own]
    assert not np.array_equal(ticks, run.ticks)
    old = {key: value for key, value in run.manifest.items() if key != "clock"}
    before = replace(run, ticks=ticks, manifest=json.loads(json.dumps(old)))
    assert replay(before, spec, keep_states=False).same
    assert replay(run, spec, keep_states=False).same
    assert not replay(replace(before, manifest=run.manifest), spec, keep_states=False).same
    assert score_run(before, errors=LAG) == score_run(run, errors=LAG)
    assert RecordedOperator(before).duration_s == RecordedOperator(run).duration_s


def test_settings_of_a_run_that_lost_steps_have_no_place(driven: tuple[Path, list[Any]]) -> None:
    run = replace(Run.read(driven[0]), lost=2)
    with pytest.raises(InputError, match="lost 2 steps"):
        settings_of(run, CALM)
    assert settings_of(replace(run, events=()), CALM) == [CALM] * len(run.ticks)
    early = RunEvent(0, "request", SetSettings(replace(CALM, dt_s=0.002)))
    assert settings_of(replace(run, events=(early,)), CALM)[0].dt_s == 0.002
