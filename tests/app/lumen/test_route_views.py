"""What a robot can view, waited for by a drive that says how far the search is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from app.kit.jobs import Job
from app.lumen.views import RouteViews
from vfix_engine.errors import InputError


class _Jobs:
    """Jobs whose only one comes to a quarter more with each look, and ends as it is told to."""

    def __init__(self, error: InputError | None = None) -> None:
        self.job, self.error = Job(id="a", kind="viewable", state="running"), error

    def submit(self, work: Any, **about: Any) -> Job:
        return self.job

    def wait(self, job_id: str, seconds: float | None = None) -> Job:
        assert seconds is not None
        self.job = replace(self.job, fraction=self.job.fraction + 0.25)
        if self.job.fraction >= 1.0:
            self.job = replace(self.job, state="failed" if self.error else "done", error=self.error)
        return self.job


def _views(jobs: Any) -> RouteViews:
    paths: Any = SimpleNamespace(key=lambda route: "key", check_ends=lambda route: None)
    views = RouteViews(SimpleNamespace(), jobs, paths)  # type: ignore[arg-type]
    views._make = lambda route, progress: "found"  # type: ignore[assignment,method-assign,return-value]
    return views


def test_whoever_waits_hears_how_far_the_search_is() -> None:
    route: Any = SimpleNamespace(id="route", case_id="case", name="A route")
    heard: list[float] = []
    assert _views(_Jobs()).wait(route, heard.append) == "found"
    assert heard == [0.0, 0.25, 0.5, 0.75]
    with pytest.raises(InputError, match="no wall"):
        _views(_Jobs(InputError("no wall."))).wait(route)
