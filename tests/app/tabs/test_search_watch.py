"""What the hint line knows of the search for a path: whether it runs, and whether it has found no way."""

from __future__ import annotations

from types import SimpleNamespace

from app.kit.jobs import Job
from app.tabs.plan.search_watch import SearchWatch


class Known:
    """The jobs and what they have found, as the planner has them."""

    def __init__(self) -> None:
        self.jobs, self.version, self.ways = list[Job](), 0, 0

    def be(self, *jobs: Job) -> None:
        self.jobs, self.version = list(jobs), self.version + 1

    def going_on(self) -> tuple[int, tuple[Job, ...]]:
        return self.version, tuple(job for job in self.jobs if job.state == "running")

    def list(self) -> tuple[Job, ...]:
        return tuple(self.jobs)

    def paths(self, found: str) -> SimpleNamespace:
        return SimpleNamespace(found=SimpleNamespace(alternatives=("way",) * self.ways))


def test_a_search_runs_and_says_that_it_found_no_way_until_the_plan_changes() -> None:
    known, plan = Known(), SimpleNamespace(id="plan", revision=4)
    watch = SearchWatch(SimpleNamespace(jobs=known, suggestions=known))  # type: ignore[arg-type]

    def after(*jobs: Job) -> tuple[bool, str]:
        known.be(*jobs)
        return watch.changed(plan), watch.state(plan)  # type: ignore[arg-type]

    runs = Job("1", "suggestion", document_id="plan", state="running")
    done = Job("1", "suggestion", document_id="plan", state="done", result="found")
    assert after() == (False, "")
    assert after(Job("0", "suggestion", document_id="other", state="running")) == (False, "")
    assert after(runs) == (True, "runs")
    assert watch.changed(plan) is False  # type: ignore[arg-type]
    assert after(done) == (True, "none")
    plan.revision = 5
    assert watch.state(plan) == ""  # type: ignore[arg-type]
    known.ways = 2
    assert (after(runs), after(done)) == ((True, "runs"), (True, ""))
    known.ways = 0
    cancelled = Job("1", "suggestion", document_id="plan", state="cancelled")
    assert (after(runs), after(cancelled)) == ((True, "runs"), (True, ""))
