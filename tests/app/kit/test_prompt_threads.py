"""Threads that receive a hand's commands: real-time priority during and shortly after a drive, if allowed (HAZ-11)."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator

import pytest

from app.kit.prompt_threads import LINGER_S, PromptThreads
from vfix_engine.runtime.priority import why_not


class Clock:
    seconds = 100.0

    def __call__(self) -> float:
        return self.seconds


class Scheduler:
    """What is asked of the system."""

    def __init__(self, error: OSError | None = None) -> None:
        self.error = error
        self.asked: list[tuple[bool, int]] = []

    def __call__(self, prompt: bool, thread: int) -> None:
        self.asked.append((prompt, thread))
        if self.error is not None:
            raise self.error


class Worker:
    """A thread that waits to be ended."""

    def __init__(self) -> None:
        self._over = threading.Event()
        self.thread = threading.Thread(target=self._over.wait, args=(60,))
        self.thread.start()

    @property
    def number(self) -> int:
        assert self.thread.native_id is not None
        return self.thread.native_id

    def end(self) -> None:
        self._over.set()
        self.thread.join()


@pytest.fixture
def workers() -> Iterator[tuple[Worker, Worker]]:
    one, two = Worker(), Worker()
    yield one, two
    one.end()
    two.end()


def test_they_are_prompt_while_a_hand_is_heard_and_a_little_longer(workers: tuple[Worker, Worker]) -> None:
    system, clock, (one, two) = Scheduler(), Clock(), workers
    prompt = PromptThreads(system, clock, cores=2)
    prompt.enrol(one.thread)
    assert not system.asked
    prompt.hear()
    prompt.enrol(two.thread)  # while the hand drives
    clock.seconds += LINGER_S - 0.1
    prompt.hear()
    clock.seconds += LINGER_S - 0.1
    prompt.rest()
    assert system.asked == [(True, one.number), (True, two.number)]
    clock.seconds += 0.1
    prompt.rest()
    prompt.rest()
    assert system.asked[2:] in ([(False, one.number), (False, two.number)], [(False, two.number), (False, one.number)])
    one.end()
    prompt.hear()
    assert system.asked[4:] == [(True, two.number)]


def test_one_that_comes_when_no_hand_is_heard_any_more_is_ordinary(workers: tuple[Worker, Worker]) -> None:
    system, clock, (one, _) = Scheduler(), Clock(), workers
    prompt = PromptThreads(system, clock, cores=2)
    prompt.hear()
    clock.seconds += LINGER_S
    prompt.enrol(one.thread)
    assert not system.asked


@pytest.mark.parametrize("error", [PermissionError(), ProcessLookupError()])
def test_a_refusal_is_asked_for_once_and_a_thread_that_has_just_ended_harms_nothing(
    workers: tuple[Worker, Worker], error: OSError
) -> None:
    system, (one, two) = Scheduler(error), workers
    prompt = PromptThreads(system, Clock(), cores=2)
    prompt.enrol(one.thread)
    prompt.enrol(two.thread)
    for _ in range(3):
        prompt.hear()
    assert len(system.asked) == (1 if isinstance(error, PermissionError) else 2)


def test_on_one_core_none_is_prompt(workers: tuple[Worker, Worker]) -> None:
    system = Scheduler()
    prompt = PromptThreads(system, Clock(), cores=1)
    prompt.enrol(workers[0].thread)
    prompt.hear()
    assert not system.asked


@pytest.mark.skipif(sys.platform != "linux", reason="the call is Linux's")
def test_another_thread_is_really_scheduled_so(workers: tuple[Worker, Worker]) -> None:
    clock, (one, _) = Clock(), workers
    prompt = PromptThreads(now=clock, cores=2)
    prompt.enrol(one.thread)

    def policy() -> int:
        return os.sched_getscheduler(one.number) & ~os.SCHED_RESET_ON_FORK

    prompt.hear()
    assert policy() == (os.SCHED_OTHER if why_not() else os.SCHED_FIFO)
    clock.seconds += LINGER_S
    prompt.rest()
    assert policy() == os.SCHED_OTHER
