"""`vfix bench study`: every way of running trials gives the same ones, and a difference is noticed."""

from __future__ import annotations

import argparse
import itertools
from typing import Any

import pytest

from benchmarks import report, study


def run(trials: int = 12) -> dict[str, Any]:
    return study.run(argparse.Namespace(trials=trials, no_growth=True))


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials that cost nothing, in this process alone."""
    monkeypatch.setattr(study, "timed", lambda key: study.Timed(0.5, repr(key)))

    def here(function: Any, keys: Any, keep: Any, **where: Any) -> Any:
        found = {key: function(key) for key in keys}
        for key, value in found.items():
            keep(key, value)
        return found

    monkeypatch.setattr(study, "run_all", here)


def test_the_cost_of_many_trials_is_that_of_one(short: None) -> None:
    found = run()
    assert found["correct"] is True
    assert found["core_hours_of_100000_trials"] == pytest.approx(1e5 * 0.5 / 3600.0)
    assert set(found["ratios"]) == {"a pool of processes", "a local Dask cluster"}


def test_a_trial_that_differs_is_noticed(short: None, monkeypatch: pytest.MonkeyPatch) -> None:
    number = itertools.count()
    monkeypatch.setattr(study, "timed", lambda key: study.Timed(0.5, str(next(number))))
    assert run()["correct"] is False


def test_a_real_trial_is_the_same_again() -> None:
    key = study.TrialKey(0, 0, 0, "teleoperated")
    assert study.timed(key).digest == study.timed(key).digest != study.timed(key._replace(subject=1)).digest


def test_too_few_trials_are_refused() -> None:
    with pytest.raises(report.BenchmarkRefused):
        run(trials=11)
