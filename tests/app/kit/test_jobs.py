"""Jobs: one at a time in a lane, cancelled with their resources, listed for a reloaded page."""

import threading
import time
from collections.abc import Callable, Iterator

import pytest

from app.kit.errors import JobCancelled, NotFound, PlannerEnds
from app.kit.jobs import ENDED, Job, JobKind, Jobs, Progress, Work
from app.plans.operations.document import SetPlanSettings
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from vfix_engine.errors import InputError


@pytest.fixture
def jobs() -> Iterator[Jobs]:
    made = Jobs()
    yield made
    made.close()


class Blocked:
    """Work that reports until it is let go."""

    def __init__(self) -> None:
        self.go, self.begun = threading.Event(), threading.Event()

    def __call__(self, progress: Progress) -> str:
        self.begun.set()
        while not self.go.wait(0.005):
            progress("Working", 0.5)
        return "made"


def start(jobs: Jobs, work: Work, lane: str = "import", clean_up: Callable[[], None] = lambda: None) -> Job:
    return jobs.submit(work, clean_up, kind="import", lane=lane)


def test_a_job_tells_its_stage_and_ends_with_its_result(jobs: Jobs) -> None:
    work = Blocked()
    job = start(jobs, work)
    assert work.begun.wait(60)
    while (now := jobs.get(job.id)).stage != "Working":
        time.sleep(0.001)
    assert (now.state, now.fraction) == ("running", 0.5)
    work.go.set()
    done = jobs.wait(job.id, 60)
    assert (done.state, done.stage, done.fraction, done.result, done.error) == ("done", "done", 1.0, "made", None)
    assert jobs.cancel(job.id) == done


def test_one_lane_is_one_at_a_time_and_in_order_and_another_does_not_wait(jobs: Jobs) -> None:
    works = [Blocked(), Blocked(), Blocked()]
    started = [start(jobs, work) for work in works]
    other = Blocked()
    other.go.set()
    assert jobs.wait(start(jobs, other, lane="dry_run case-1").id, 60).state == "done"
    assert [jobs.get(job.id).state for job in started[1:]] == ["queued", "queued"]
    for index, work in enumerate(works):
        assert work.begun.wait(60)
        assert not any(later.begun.is_set() for later in works[index + 1 :])
        work.go.set()
        assert jobs.wait(started[index].id, 60).state == "done"


def test_no_import_and_no_suggestion_keeps_a_dry_run_waiting(jobs: Jobs) -> None:
    works = [Blocked() for _ in range(5)]
    kinds: tuple[JobKind, ...] = ("import", "suggestion", "tools", "segmentation", "beads")
    for number, (kind, work) in enumerate(zip(kinds, works, strict=True)):
        jobs.submit(work, kind=kind, lane=f"lane {number}")
    for work in works[:2]:
        assert work.begun.wait(60)
    prompt = Blocked()
    prompt.go.set()
    for kind in ("dry_run", "run"):
        assert jobs.wait(jobs.submit(prompt, kind=kind, lane=f"{kind} of a case").id, 60).state == "done"
    assert [work.begun.is_set() for work in works] == [True, True, False, False, False], "two of all others at a time"
    for work in works:
        work.go.set()


def test_who_asks_for_what_goes_on_already_gets_that_job(jobs: Jobs) -> None:
    works, cleaned = [Blocked() for _ in range(4)], list[int]()

    def ask(number: int, same: str) -> Job:
        return jobs.submit(works[number], lambda: cleaned.append(number), kind="tools", lane="one", same=same)

    first = ask(0, "tools of a plan")
    assert works[0].begun.wait(60)
    assert ask(1, "tools of a plan").id == first.id
    assert cleaned == [1]
    other = ask(2, "tools of another plan")
    assert other.id != first.id
    assert ask(3, "tools of another plan").id == other.id, "also while it waits"
    for work in works:
        work.go.set()
    assert jobs.wait(first.id, 60).state == jobs.wait(other.id, 60).state == "done"
    assert ask(1, "tools of a plan").id != first.id, "what has ended is made anew"


def test_a_job_that_runs_is_cancelled_at_its_next_report(jobs: Jobs) -> None:
    work, ended, cleaned = Blocked(), [], threading.Event()

    def act(progress: Progress) -> str:
        progress.on_cancel(lambda: ended.append("its worker"))
        return work(progress)

    job = start(jobs, act, clean_up=cleaned.set)
    assert work.begun.wait(60)
    jobs.cancel(job.id)
    now = jobs.wait(job.id, 60)
    assert (now.state, now.stage, type(now.error)) == ("cancelled", "cancelled", JobCancelled)
    assert (ended, cleaned.is_set()) == (["its worker"], True)
    late: list[str] = []
    progress = Progress(lambda *_: None)
    progress.cancel()
    progress.on_cancel(lambda: late.append("at once"))
    assert late == ["at once"]


def test_a_job_that_waits_is_cancelled_without_being_begun(jobs: Jobs) -> None:
    first, second, third, cleaned = Blocked(), Blocked(), Blocked(), threading.Event()
    start(jobs, first)
    waits = start(jobs, second, clean_up=cleaned.set)
    last = start(jobs, third)
    assert jobs.cancel(waits.id).state == "cancelled"
    assert cleaned.is_set()
    first.go.set()
    third.go.set()
    assert jobs.wait(last.id, 60).state == "done"
    assert not second.begun.is_set()


def test_the_list_has_what_runs_and_what_ended_until_it_is_forgotten(jobs: Jobs) -> None:
    work = Blocked()
    runs = jobs.submit(work, kind="dry_run", lane="a", case_id="case-1", subject="Plan 1")
    failed = jobs.wait(start(jobs, _fails, lane="b").id, 60)
    assert (failed.state, str(failed.error)) == ("failed", "no such file")
    assert [(job.id, job.case_id, job.subject) for job in jobs.list()] == [
        (runs.id, "case-1", "Plan 1"),
        (failed.id, None, ""),
    ]
    assert [job.id for job in jobs.list("case-1")] == [runs.id]
    for job in (runs, failed):
        jobs.forget(job.id)
    assert [job.id for job in jobs.list()] == [runs.id]
    with pytest.raises(NotFound):
        jobs.get(failed.id)
    work.go.set()


def _fails(progress: Progress) -> str:
    raise InputError("no such file")


def test_an_unexpected_error_quotes_nothing(jobs: Jobs, caplog: pytest.LogCaptureFixture) -> None:
    """HAZ-33."""

    def work(progress: Progress) -> str:
        raise RuntimeError("Canary^Patient")

    job = jobs.wait(start(jobs, work).id, 60)
    assert job.state == "failed"
    assert "Canary" not in f"{job.error} {caplog.text}"
    assert jobs.wait(start(jobs, lambda progress: "made").id, 60).state == "done"  # the lane goes on


def test_only_the_newest_that_ended_are_remembered(jobs: Jobs) -> None:
    work = Blocked()
    runs = start(jobs, work, lane="slow")
    ended = [jobs.wait(start(jobs, lambda progress: "made").id, 60).id for _ in range(110)]
    kept = [job.id for job in jobs.list()]
    assert (kept[0], kept[1:], len(kept)) == (runs.id, ended[-99:], 100)
    work.go.set()


def test_the_planner_ends_with_what_waits_and_takes_no_more() -> None:
    jobs, work, cleaned = Jobs(), Blocked(), []
    runs = start(jobs, work, clean_up=lambda: cleaned.append("runs"))
    waits = start(jobs, Blocked(), clean_up=lambda: cleaned.append("waits"))
    assert work.begun.wait(60)
    threading.Timer(0.1, work.go.set).start()
    jobs.close()
    assert (jobs.get(runs.id).state, jobs.get(waits.id).state) == ("done", "cancelled")
    assert sorted(cleaned) == ["runs", "waits"]
    with pytest.raises(PlannerEnds):
        start(jobs, Blocked(), clean_up=lambda: cleaned.append("late"))
    assert cleaned[-1] == "late"


def test_a_dry_run_is_a_job_that_all_who_ask_share(phantom_services: Services) -> None:
    services = phantom_services
    plan = services.plans.documents.duplicate(SAMPLE_PLAN, "Dry")
    services.plans.do(plan.id, SetPlanSettings(settings={"margin_mm": 0.41}))
    plan = services.plans.get(plan.id)
    first, second = services.dry_runs.start(plan), services.dry_runs.start(plan)
    assert first.id == second.id
    assert (first.kind, first.case_id, first.subject) == ("dry_run", plan.case_id, "Dry")
    answers = services.dry_runs.evaluate(plan)
    assert services.jobs.get(first.id).state == "done"
    assert services.planning.evaluate(plan).run is answers.run
    services.plans.documents.delete(plan.id)


def test_a_dry_run_that_is_cancelled_ends_soon_and_can_be_asked_for_again(phantom_services: Services) -> None:
    services = phantom_services
    plan = services.plans.documents.duplicate(SAMPLE_PLAN, "Cancelled")
    services.plans.do(plan.id, SetPlanSettings(settings={"margin_mm": 0.43}))
    plan = services.plans.get(plan.id)
    job = services.dry_runs.start(plan)
    while services.jobs.get(job.id).stage != "Placing the robot and driving the path":
        assert services.jobs.get(job.id).state not in ENDED
        time.sleep(0.001)
    services.jobs.cancel(job.id)
    with pytest.raises(JobCancelled):
        raise services.jobs.wait(job.id, 30).error or AssertionError
    assert not services.planning.is_evaluated(plan)
    again = services.dry_runs.start(plan)
    assert again.id != job.id
    services.jobs.cancel(again.id)
    services.jobs.wait(again.id, 30)
    services.plans.documents.delete(plan.id)
