"""Background work of which only the newest counts."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from session_doubles import Now

from app.steps.plan.lanes import Lanes


def test_slow_work_keeps_no_other_lane_waiting_and_its_own_lane_does_the_newest_next() -> None:
    done: list[str] = []
    slow, other = threading.Event(), threading.Event()

    def first() -> None:
        slow.wait(20)
        done.append("first")

    with ThreadPoolExecutor(4) as executor:
        lanes = Lanes(executor)
        lanes.submit("slow", first)
        lanes.submit("slow", lambda: done.append("older"))
        lanes.submit("slow", lambda: done.append("newest"))
        lanes.submit("other", other.set)
        assert other.wait(60)
        assert done == []
        slow.set()
    assert done == ["first", "newest"]


def test_work_that_fails_is_logged_and_what_waits_behind_it_is_done(caplog: pytest.LogCaptureFixture) -> None:
    done: list[str] = []

    def fail() -> None:
        lanes.submit("lane", lambda: done.append("waited"))
        raise ValueError("spoiled")

    lanes = Lanes(Now())
    lanes.submit("lane", fail)
    lanes.submit("lane", lambda: done.append("later"))
    assert done == ["waited", "later"]
    assert "spoiled" in caplog.text
