"""Work in the background of which only the answer to the newest request counts."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from concurrent.futures import Executor
from typing import Any, TypeVar

from app.kit.errors import JobCancelled
from app.workspace.background import Work, guarded

Answer = TypeVar("Answer")
Act = Callable[[], None]


class BackgroundTask:
    """The work for one request, on its own thread."""

    def __init__(self, owner: Latest, number: int) -> None:
        self._owner, self._number = owner, number

    def check(self, stage: str = "", fraction: float = 0.0) -> None:
        """Raise JobCancelled once the answer is not needed any more, so that the work ends."""
        if self._number < self._owner.first:
            raise JobCancelled

    def tell(self, act: Act) -> None:
        """Do something on the owner's thread with an intermediate result, if this is still the newest request then."""

        def if_newest() -> None:
            if self.is_newest:
                act()

        self._owner.post(if_newest)

    @property
    def is_newest(self) -> bool:
        return self._number == self._owner.newest

    @property
    def is_wanted(self) -> bool:
        """Whether it is the newest one, or one that the newest one continues."""
        return self._number >= self._owner.first


class Latest:
    """Requests of one owner, whose thread alone calls these methods and gets the answers.

    In each lane one piece of work runs at a time, and only the newest waits behind it. newest: number of the newest
    request; first: of the first whose answer is still needed. Work reads both on its own thread.
    """

    def __init__(self, executor: Executor, post: Callable[[Act], Any]) -> None:
        """post: queues a call onto the owner's thread; may be called on any thread."""
        self._executor, self.post = executor, post
        self.newest = self.first = 0
        self._lock = threading.Lock()
        self._waiting: dict[Hashable, Work | None] = {}  # by busy lane

    def ask(
        self,
        what: str,
        find: Callable[[BackgroundTask], Answer],
        accept: Callable[[Answer], object],
        failed: Callable[[str], None],
        *,
        older: Callable[[Answer], object] | None = None,
        goes_on: bool = False,
        lane: Hashable = None,
    ) -> None:
        """Request the result of `find` on another thread, after the work that runs in the lane.

        accept: gets the answer, unless there is a newer request by then. failed: gets words for the user instead,
        if `find` raises; what: as in `background.in_background`. goes_on: the answers to earlier requests, back
        to the first that this one continues, are still needed: `older` gets them. Else their work ends.
        """
        self.newest += 1
        if not goes_on:
            self.first = self.newest
        run = BackgroundTask(self, self.newest)

        def hand_over(answer: Answer) -> None:
            if run.is_newest:
                self.first = self.newest  # an older answer would come too late
                accept(answer)
            elif older is not None and run.is_wanted:
                older(answer)

        def work() -> None:
            try:
                run.check()
                answer = find(run)
            except JobCancelled:
                if run.is_wanted:
                    raise
                return
            self.post(lambda: hand_over(answer))

        self._submit(lane, lambda: guarded(what, work, lambda words: run.tell(lambda: failed(words))))

    def drop(self) -> None:
        """No answer is needed any more; work that checks this ends."""
        self.newest += 1
        self.first = self.newest

    def _submit(self, lane: Hashable, work: Work) -> None:
        with self._lock:
            busy = lane in self._waiting
            self._waiting[lane] = work if busy else None
        if busy:
            return
        try:
            self._executor.submit(self._run, lane, work)
        except RuntimeError:  # the planner is ending
            with self._lock:
                self._waiting.pop(lane, None)

    def _run(self, lane: Hashable, work: Work | None) -> None:
        while work is not None:
            work()  # does not raise: waiting work is done in any case, and the lane is free after it
            with self._lock:
                work, self._waiting[lane] = self._waiting[lane], None
                if work is None:
                    del self._waiting[lane]
