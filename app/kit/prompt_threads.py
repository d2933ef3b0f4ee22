"""Threads that hear a held hand: they have a real-time priority while it drives, where the system allows it.

On a busy machine an ordinary thread waits up to half a second for a core, and a hand whose heartbeat is heard so late
is lost (HAZ-11). Whoever hears the hand also waits for the interpreter's lock: a thread that often works meanwhile has
the same priority, or it would keep the lock while it waits for a core itself. Threads that compute for long have none.
"""

from __future__ import annotations

import contextlib
import math
import os
import sys
import threading
import time
from collections.abc import Callable

from vfix_engine.runtime.priority import schedule_thread

LINGER_S = 1.0  # after the last sign of a hand; keys that are tapped do not change priorities each time


class PromptThreads:
    """Thread-safe. On one core no thread is prompt: it would delay the control process, which has that priority too."""

    def __init__(
        self,
        schedule: Callable[[bool, int], None] = schedule_thread,
        now: Callable[[], float] = time.monotonic,
        cores: int | None = None,
    ) -> None:
        """cores: of this machine, counted where it is None."""
        self._schedule, self._now = schedule, now
        self._allowed = (_cores() if cores is None else cores) > 1
        self._lock = threading.Lock()
        self._threads: set[threading.Thread] = set()
        self._until = -math.inf
        self._prompt = False

    @property
    def threads(self) -> frozenset[threading.Thread]:
        """Those that are prompt while a hand drives."""
        with self._lock:
            return frozenset(thread for thread in self._threads if thread.is_alive())

    def enrol(self, thread: threading.Thread | None = None) -> None:
        """A thread, the calling one by default, hears a hand or often works while others do."""
        thread = thread or threading.current_thread()
        self.rest()
        with self._lock:
            self._threads = {known for known in self._threads if known.is_alive()} | {thread}
            if self._prompt:
                self._put(thread, True)

    def hear(self) -> None:
        """A sign of a hand that drives."""
        self._until = self._now() + LINGER_S
        if self._allowed and not self._prompt:
            with self._lock:
                self._change(True)

    def rest(self) -> None:
        """Ordinary priorities again once no hand was heard of for a while; called by the planner's clock."""
        if self._prompt and self._now() >= self._until:
            with self._lock:
                self._change(False)

    def _change(self, prompt: bool) -> None:
        self._prompt = prompt
        for thread in self._threads:
            if self._allowed or not prompt:
                self._put(thread, prompt)

    def _put(self, thread: threading.Thread, prompt: bool) -> None:
        if not thread.is_alive() or thread.native_id is None:
            return
        with contextlib.suppress(ProcessLookupError):  # it has ended just now
            try:
                self._schedule(prompt, thread.native_id)
            except (PermissionError, NotImplementedError):  # the control process tells why: it asks for the same
                self._allowed = self._prompt = False


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


PROMPT_THREADS = PromptThreads()  # of this process, as its threads are
