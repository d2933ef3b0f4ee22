"""Background work of which only the answer to the newest question counts."""

from __future__ import annotations

import queue
import random
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from session_doubles import Later, Now, fail

from app.workspace.latest import Act, BackgroundTask, Latest
from vfix_engine.errors import InputError


def never(words: str) -> None:
    raise AssertionError(words)


def test_slow_work_keeps_no_other_lane_waiting_and_its_own_lane_does_the_newest_next() -> None:
    begun: list[str] = []
    slow, other = threading.Event(), threading.Event()

    def first(run: BackgroundTask) -> None:
        slow.wait(20)
        begun.append("first")

    with ThreadPoolExecutor(4) as executor:
        latest = Latest(executor, lambda act: act())
        works: list[tuple[str, Callable[[BackgroundTask], object]]] = [
            ("slow", first),
            ("slow", lambda run: begun.append("older")),
            ("other", lambda run: other.set()),
            ("slow", lambda run: begun.append("newest")),
        ]
        for lane, work in works:
            latest.ask(
                "It failed", work, lambda answer: None, never, older=lambda answer: None, goes_on=True, lane=lane
            )
        assert other.wait(60)
        assert begun == []
        slow.set()
    assert begun == ["first", "newest"]


def test_work_that_fails_is_told_and_what_waits_behind_it_is_done(caplog: pytest.LogCaptureFixture) -> None:
    done, posted = list[object](), list[Act]()
    latest = Latest(Now(), posted.append)

    def ask(work: Callable[[BackgroundTask], object]) -> None:
        latest.ask("It failed", work, done.append, done.append)

    def spoil(run: BackgroundTask) -> None:
        raise ValueError("of Doe, John")

    for work in (spoil, lambda run: fail(InputError("the path is empty.")), lambda run: "found"):
        ask(work)
        posted.pop()()
    assert done == ["It failed; the planner's log says why.", "the path is empty.", "found"]
    assert "ValueError" in caplog.text
    assert " spoil\n" in f"{caplog.text}\n", "where it was"
    assert "John" not in caplog.text, "HAZ-33"


def test_nobody_is_told_of_what_is_not_wanted_any_more() -> None:
    """Neither the answer nor why there is none; work that has not begun is left out, and what asks ends."""
    done, posted, later = list[object](), list[Act](), Later()
    latest = Latest(later, posted.append)

    def unwanted(run: BackgroundTask) -> str:
        latest.drop()
        run.check("it goes on", 0.5)
        raise AssertionError

    latest.ask("It failed", unwanted, done.append, done.append)
    later.work.pop()()
    latest.ask("It failed", lambda run: fail(InputError("too late.")), done.append, done.append)
    later.work.pop()()
    latest.ask("It failed", lambda run: run.tell(lambda: done.append("half")) or "old", done.append, done.append)
    later.work.pop()()
    latest.ask("It failed", never, done.append, done.append)  # type: ignore[arg-type]
    latest.drop()
    later.work.pop()()
    for act in posted:
        act()
    assert done == []


def test_what_is_asked_once_the_planner_ends_is_left_out() -> None:
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    latest = Latest(executor, lambda act: act())
    for _ in range(2):
        latest.ask("It failed", lambda run: 1, never, never)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(3))
def test_of_many_questions_in_a_race_the_newest_is_answered_and_none_older_after_a_newer_one(seed: int) -> None:
    """One owner asks in three lanes, drops and goes on, while eight threads answer, fail and tell what they know."""
    chance, inbox, shown = random.Random(seed), queue.Queue[Act](), list[tuple[str, int]]()
    with ThreadPoolExecutor(8) as executor:
        latest = Latest(executor, inbox.put)
        asked = first = 0

        def find(run: BackgroundTask, number: int, kind: float) -> int:
            run.tell(lambda: shown.append(("half", number)))
            time.sleep(0.002 * kind)
            if kind < 0.2:
                raise InputError(str(number))
            run.check()
            return number

        for number in range(1, 301):
            goes_on, kind = chance.random() < 0.5, chance.random()
            asked, first = number, first if goes_on else number
            latest.ask(
                "It failed",
                lambda run, number=number, kind=kind: find(run, number, kind),  # type: ignore[misc]
                lambda found: shown.append(("newest", found)),
                lambda words: shown.append(("failed", int(words))),
                older=lambda found: shown.append(("older", found)),
                goes_on=goes_on,
                lane=chance.randrange(3),
            )
            while not inbox.empty():
                before = len(shown)
                inbox.get()()
                for kind_of, found in shown[before:]:
                    assert found == asked if kind_of != "older" else first <= found < asked
    while not inbox.empty():
        inbox.get()()
    assert shown[-1] in (("newest", 300), ("failed", 300))
    assert len(latest._waiting) == 0
