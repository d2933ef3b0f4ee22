"""Jobs as the pages are told of them: whoever began one, how far it is, and that it has ended."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from session_doubles import other_case

from app.kit.jobs import Jobs, Progress
from app.services import Services
from app.session.client_session import ClientSession
from app.session.client_sessions import JOBS_S, ClientSessions


class Work:
    """Work that reports a share when it is told to, and ends at the end of the test or when it is cancelled."""

    def __init__(self) -> None:
        self.share, self.go_on, self.reported, self.end = 0.0, threading.Event(), threading.Event(), threading.Event()

    def __call__(self, progress: Progress) -> str:
        progress.on_cancel(self.go_on.set)
        while not self.end.is_set():
            assert self.go_on.wait(60)
            self.go_on.clear()
            progress("Counting", self.share)
            self.reported.set()
        return "made"

    def report(self, share: float) -> None:
        self.share = share
        self.reported.clear()
        self.go_on.set()
        assert self.reported.wait(60)

    def finish(self) -> None:
        self.end.set()
        self.go_on.set()


def start_here(session: ClientSession, wanted: dict[str, str]) -> None:
    """Answer requests at once, as the session's thread does, so that nothing is shown that a test did not ask for."""

    def post(request: Callable[[], Any], slot: str | None = None) -> None:
        request()
        if request != session._tick:
            session._display.publish()

    session._inbox.put = post  # type: ignore[method-assign]
    post(lambda: session._open_first(wanted))


@pytest.fixture
def jobs(phantom_services: Services, monkeypatch: pytest.MonkeyPatch) -> Iterator[Jobs]:
    """Those of one test; a tick shows nothing else that has changed."""
    made = Jobs()
    monkeypatch.setattr(phantom_services, "jobs", made)
    monkeypatch.setattr(ClientSession, "start", start_here)
    monkeypatch.setattr(ClientSession, "is_behind", False)
    monkeypatch.setattr(ClientSession, "lively", False)
    yield made
    for job in made.list():
        made.cancel(job.id)
    made.close()


class Pages:
    """Two pages, and a clock that goes on as a test says, by less than what lies between two looks at the store."""

    def __init__(self, sessions: ClientSessions, services: Services) -> None:
        case = other_case(services).id
        self.sessions, self.now = sessions, time.monotonic()
        self.open = [sessions.connect(f"tab-number-{number}", {"case": case}) for number in range(2)]
        self.pass_by(0.0)

    def pass_by(self, seconds: float) -> list[Any]:
        """The section of each page after that time."""
        self.now += seconds
        self.sessions.beat(self.now)
        return [session.view_model.read("jobs") for session in self.open]


@pytest.fixture
def pages(jobs: Jobs, sessions: ClientSessions, phantom_services: Services) -> Pages:
    return Pages(sessions, phantom_services)


def test_every_page_is_told_how_far_a_job_is(pages: Pages, jobs: Jobs) -> None:
    work = Work()
    job = jobs.submit(work, kind="import", lane="import", case_id="case-1", subject="Block")
    work.report(0.25)
    told = pages.pass_by(JOBS_S)
    (item,) = told[0]["items"]
    shown = ("import", "case-1", "Block", "running", "Counting", 0.25)
    assert tuple(item[name] for name in ("kind", "case_id", "subject", "state", "stage", "fraction")) == shown
    assert (item["id"], told[1]) == (job.id, told[0])
    work.report(0.5)
    assert pages.pass_by(0.5 * JOBS_S) == told, "work may report at every step"
    told = pages.pass_by(0.6 * JOBS_S)
    assert [section["items"][0]["fraction"] for section in told] == [0.5, 0.5]
    work.finish()
    jobs.wait(job.id, 60)
    assert [section["items"] for section in pages.pass_by(JOBS_S)] == [[], []]


def test_a_job_that_begins_and_ends_between_two_messages_is_told(pages: Pages, jobs: Jobs) -> None:
    before = [session.view_model.changed_since(0)[0] for session in pages.open]
    jobs.wait(jobs.submit(lambda progress: "made", kind="islands", lane="islands").id, 60)
    assert pages.pass_by(JOBS_S) == 2 * [{"version": jobs.version, "items": []}]
    for session, revision in zip(pages.open, before, strict=True):
        assert "jobs" in session.view_model.changed_since(revision)[1]


def test_a_cancelled_job_and_one_that_waits_for_it_are_told(pages: Pages, jobs: Jobs) -> None:
    runs, waits = (jobs.submit(Work(), kind="segmentation", lane="case-1") for _ in range(2))
    told = pages.pass_by(JOBS_S)[0]["items"]
    assert [(item["id"], item["state"]) for item in told][1:] == [(waits.id, "queued")]
    jobs.cancel(waits.id)
    assert [item["id"] for item in pages.pass_by(JOBS_S)[1]["items"]] == [runs.id]
    jobs.cancel(runs.id)
    assert jobs.wait(runs.id, 60).state == "cancelled"
    assert pages.pass_by(JOBS_S)[1]["items"] == []


def test_a_page_that_was_away_finds_the_jobs_as_they_are(pages: Pages, jobs: Jobs) -> None:
    work, session = Work(), pages.open[0]
    job = jobs.submit(work, kind="import", lane="import")
    pages.pass_by(JOBS_S)
    pages.sessions.disconnect(session.client)
    work.finish()
    jobs.wait(job.id, 60)
    away, there = pages.pass_by(JOBS_S)
    assert ([item["id"] for item in away["items"]], there["items"]) == ([job.id], [])
    assert pages.sessions.connect(session.client, {}) is session
    assert session.view_model.read("jobs") == there


@pytest.mark.parametrize("when", ["after a request", "with a tick"])
def test_the_end_of_a_job_is_not_told_before_what_it_has_stored(
    when: str, pages: Pages, jobs: Jobs, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends while the store is read: the page still has it, and reads the store again before it has it no more."""
    work, session = Work(), pages.open[0]
    job = jobs.submit(work, kind="beads", lane="case-1")

    def end_meanwhile(*of: object) -> bool:
        work.finish()
        return jobs.wait(job.id, 60).state != "done"

    if when == "with a tick":
        monkeypatch.setattr(ClientSession, "is_behind", property(end_meanwhile))
        session.tick()
    else:
        monkeypatch.setattr(session.workspace.case, "refresh", end_meanwhile)
        session.post(lambda: None)
    assert [item["id"] for item in session.view_model.read("jobs")["items"]] == [job.id]
    assert pages.pass_by(JOBS_S)[0]["items"] == []
