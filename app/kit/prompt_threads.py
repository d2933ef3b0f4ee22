"""Real-time priority, where the system allows it, for the threads that receive the hand's commands during a drive.

On a busy machine an ordinary thread waits up to 0.5 s for a core, and a hand whose heartbeat arrives so late counts as
lost (HAZ-11). A receiving thread also waits for the interpreter lock (GIL): a thread that often runs meanwhile needs
the same priority, or it would hold the lock while it waits for a core itself. Threads with long computations get none.
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

LINGER_S = 1.0  # after the last command of a hand, so that tapped keys do not change the priorities each time


class PromptThreads:
    """The threads of this process with real-time priority during a drive. Thread-safe.

    On a machine with one core no thread gets it, since it would delay the control process, which has that priority too.
    """

    def __init__(
        self,
        schedule: Callable[[bool, int], None] = schedule_thread,
        now: Callable[[], float] = time.monotonic,
        cores: int | None = None,
    ) -> None:
        """Create an empty set. cores: number of cores of this machine, counted if None."""
        self._schedule, self._now = schedule, now
        self._allowed = (_cores() if cores is None else cores) > 1
        self._lock = threading.Lock()
        self._threads: set[threading.Thread] = set()
        self._until = -math.inf
        self._prompt = False

    @property
    def threads(self) -> frozenset[threading.Thread]:
        """The threads that get real-time priority while a hand drives."""
        with self._lock:
            return frozenset(thread for thread in self._threads if thread.is_alive())

    def enrol(self, thread: threading.Thread | None = None) -> None:
        """Add a thread, by default the calling one, that receives a hand's commands or often runs meanwhile."""
        thread = thread or threading.current_thread()
        self.rest()
        with self._lock:
            self._threads = {known for known in self._threads if known.is_alive()} | {thread}
            if self._prompt:
                self._put(thread, True)

    def hear(self) -> None:
        """Note a command of a hand that drives, and raise the priorities."""
        self._until = self._now() + LINGER_S
        if self._allowed and not self._prompt:
            with self._lock:
                self._change(True)

    def rest(self) -> None:
        """Restore ordinary priorities if no hand has sent a command for a while; called periodically."""
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
        with contextlib.suppress(ProcessLookupError):  # the thread has just ended
            try:
                self._schedule(prompt, thread.native_id)
            except (
                PermissionError,
                NotImplementedError,
            ):  # the control process reports the reason
                self._allowed = self._prompt = False


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


PROMPT_THREADS = PromptThreads()  # of this process
