"""Background work of which only the newest counts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from session_doubles import Now, fail

from app.tabs.plan.latest import LatestQueue
from vfix_engine.errors import InputError


def test_slow_work_keeps_no_other_lane_waiting_and_its_own_lane_does_the_newest_next() -> None:
    done: list[str] = []
    slow, other = threading.Event(), threading.Event()

    def first() -> None:
        slow.wait(20)
        done.append("first")

    with ThreadPoolExecutor(4) as executor:
        lanes = LatestQueue(executor)
        for lane, work in (
            ("slow", first),
            ("slow", lambda: done.append("older")),
            ("slow", lambda: done.append("newest")),
            ("other", other.set),
        ):
            lanes.submit(lane, "It failed", work, done.append)
        assert other.wait(60)
        assert done == []
        slow.set()
    assert done == ["first", "newest"]


def test_work_that_fails_is_told_and_what_waits_behind_it_is_done(caplog: pytest.LogCaptureFixture) -> None:
    done: list[str] = []

    def submit(work: Callable[[], None]) -> None:
        lanes.submit("lane", "It failed", work, done.append)

    def spoil() -> None:
        submit(lambda: done.append("waited"))
        raise ValueError("of Doe, John")

    lanes = LatestQueue(Now())
    submit(spoil)
    submit(lambda: fail(InputError("the path is empty.")))
    submit(lambda: done.append("later"))
    assert done == ["It failed; the planner's log says why.", "waited", "the path is empty.", "later"]
    assert "ValueError" in caplog.text
    assert " spoil\n" in f"{caplog.text}\n", "where it was"
    assert "John" not in caplog.text, "HAZ-33"
