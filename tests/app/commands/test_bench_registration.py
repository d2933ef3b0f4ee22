"""`vfix bench registration`: errors as expected, the papers' residuals, and that a wrong expectation is noticed."""

from __future__ import annotations

import argparse
from collections.abc import Callable

import pytest

from benchmarks import registration, report


def run(trials: int = 5000, seed: int = 0) -> dict[str, object]:
    return registration.run(argparse.Namespace(trials=trials, seed=seed))


def test_the_noise_behind_the_papers_residuals() -> None:
    """σ per axis of 0.425 and 0.473 mm, by what was averaged: 0.317 and 0.353 mm for rms, 0.345 and 0.384 for means."""
    result = run()
    assert result["correct"] is True
    papers: list[dict[str, float]] = result["papers"]  # type: ignore[assignment]
    found = {(row["paper"], row["reading"]): row["sigma_mm"] for row in papers}
    assert found["li_2004", "rms_of_all_residuals"] == pytest.approx(0.425 / 1.8**0.5, rel=0.02)
    assert found["li_2007", "rms_of_all_residuals"] == pytest.approx(0.473 / 1.8**0.5, rel=0.02)
    assert found["li_2004", "mean_of_all_residuals"] == pytest.approx(0.345, rel=0.02)
    assert found["li_2007", "mean_of_all_residuals"] == pytest.approx(0.384, rel=0.02)
    assert all(0.2 < row["least_tre_mm"] < row["largest_tre_mm"] < 0.4 for row in papers)


def test_a_wrong_expectation_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    right: Callable[[int, float], float] = registration.expected_fre_mm
    monkeypatch.setattr(registration, "expected_fre_mm", lambda n, fle: 1.05 * right(n, fle))
    assert run()["correct"] is False


def test_too_few_trials_are_refused() -> None:
    with pytest.raises(report.BenchmarkRefused):
        run(trials=100)
    with pytest.raises(report.BenchmarkRefused):
        run(seed=-1)
