"""Locks that tell a test that somebody waits for them, so that a race can be forced without a sleep."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Beside:
    """A thread that does something beside the test; ``met`` is set when it asks for the lock, or ends without that."""

    def __init__(self, work: Callable[[], object]) -> None:
        self.met = threading.Event()
        self._work, self._lock = work, threading.Lock()
        self.thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        try:
            self._work()
        finally:
            self.met.set()

    def __enter__(self) -> None:
        """The lock is asked for."""
        if threading.current_thread() is self.thread:
            self.met.set()
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def begin(self) -> None:
        """Start the thread, and wait until it gets no further, or has done what it was to do."""
        self.thread.start()
        assert self.met.wait(20)
