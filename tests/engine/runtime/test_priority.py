"""The real-time priority: taken where it may be, and the words where it may not (HAZ-10)."""

from __future__ import annotations

import errno
import os
import sys
import threading

import pytest

from vfix_engine.runtime import priority
from vfix_engine.runtime.priority import RealTimePriority


def refusing(real_time: bool) -> None:
    raise PermissionError(errno.EPERM, "not permitted")


def test_a_user_who_may_not_is_told_so() -> None:
    one = RealTimePriority(schedule=refusing)
    assert not one.take()
    assert not one.held
    assert one.words == "the system does not allow one to this user"
    one.give_back()  # there is nothing to give back


def test_another_system_is_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    one = RealTimePriority()
    assert not one.take()
    assert one.words == "vfix takes one on Linux only"


def test_it_is_taken_given_back_and_given_up() -> None:
    asked: list[bool] = []
    one = RealTimePriority(schedule=asked.append)
    assert one.take()
    assert (one.held, one.words) == (True, "")
    one.give_back()
    one.give_back()
    assert asked == [True, False]
    one.take()
    one.give_up()
    assert asked == [True, False, True, False]
    assert not one.held
    assert "starve" in one.words
    one.give_up()
    assert asked == [True, False, True, False]


def test_one_that_nobody_wants_is_not_asked_for() -> None:
    one = RealTimePriority(wanted=False, schedule=refusing)
    assert not one.take()
    assert one.words == "none was asked for"


@pytest.mark.skipif(sys.platform != "linux", reason="the call is Linux's")
def test_the_thread_is_really_scheduled_so() -> None:
    """In a thread of its own: the class belongs to a thread, and the test's must not keep it."""
    seen: list[tuple[int, str]] = []

    def look() -> None:
        one = RealTimePriority()
        one.take()
        seen.append((os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, one.words))
        one.give_back()
        seen.append((os.sched_getscheduler(0), one.words))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    taken, after = seen
    assert taken in [(os.SCHED_FIFO, ""), (os.SCHED_OTHER, priority.NOT_ALLOWED)]
    left = os.SCHED_RESET_ON_FORK if taken == (os.SCHED_FIFO, "") else 0  # only root may take the flag off again
    assert after[0] == os.SCHED_OTHER | left
    assert priority.why_not() == taken[1]


def test_control_is_above_other_threads_where_that_is_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def schedule(real_time: bool, thread: int = 0, level: int = priority.LEVEL) -> None:
        asked.append(level)
        if level > allowed:
            raise PermissionError(errno.EPERM, "not permitted")

    monkeypatch.setattr(priority, "schedule_thread", schedule)
    allowed = 2
    assert RealTimePriority().take()
    allowed = 1
    assert RealTimePriority().take()
    assert asked == [2, 2, 1]
    allowed = 0
    assert not RealTimePriority().take()


def test_what_shares_the_interpreter_lock_is_moved_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A carrier of messages that holds the lock and waits for a core would hold up the control thread."""
    asked: list[tuple[bool, int, int]] = []

    def schedule(real_time: bool, thread: int = 0, level: int = priority.LEVEL) -> None:
        if thread == ended.native_id:
            raise ProcessLookupError
        asked.append((real_time, thread, level))

    monkeypatch.setattr(priority, "schedule_thread", schedule)
    go = threading.Event()
    carrier, ended, begun_never = threading.Thread(target=go.wait), threading.Thread(), threading.Thread()
    carrier.start()
    ended.start()
    ended.join()
    one = RealTimePriority(others=(carrier, ended, begun_never))
    assert one.take()
    one.give_back()
    go.set()
    carrier.join()
    number = carrier.native_id
    assert asked == [(True, 0, 2), (True, number, 1), (False, 0, 2), (False, number, 1)]
