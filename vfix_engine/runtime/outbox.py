"""Messages over a pipe, sent without waiting for the process at its other end."""

from __future__ import annotations

import threading
from collections import deque
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

MOST = 256  # messages that wait


class Outbox:
    """A bounded queue before a pipe, emptied by a thread of its own; every method returns at once but ``flush``."""

    def __init__(self, pipe: Connection):
        self._pipe = pipe
        self._waiting: deque[memoryview] = deque()
        self._change = threading.Condition()
        self._sending = self._ended = False
        self._thread = threading.Thread(target=self._run, name="vfix-outbox", daemon=True)
        self._thread.start()

    @property
    def free_slots(self) -> int:
        """How many messages can be put in; 0 when the other end has not read for long."""
        return MOST - len(self._waiting)

    @property
    def ended(self) -> bool:
        """Nobody is at the other end any more, or ``end`` was called."""
        return self._ended

    def put(self, message: Any) -> bool:
        """Send when the other end reads, as ``Connection.send``; False, and nothing is sent, without a free slot."""
        packed = ForkingPickler.dumps(message)  # here, so that whoever sends what cannot be sent hears of it
        with self._change:
            if self._ended or len(self._waiting) >= MOST:
                return False
            self._waiting.append(packed)
            self._change.notify_all()
            return True

    def flush(self, seconds: float) -> bool:
        """Wait until all is sent, so many seconds at most."""
        with self._change:
            return self._change.wait_for(lambda: self._ended or not (self._waiting or self._sending), seconds)

    def end(self) -> None:
        """Send no more; the thread ends when the pipe lets it, at the latest when its other end is gone."""
        with self._change:
            self._ended = True
            self._waiting.clear()
            self._change.notify_all()

    def join(self) -> None:
        """Wait for the thread after ``end``, before the pipe is closed."""
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._change:
                self._sending = False
                self._change.notify_all()
                self._change.wait_for(lambda: self._ended or bool(self._waiting))
                if self._ended:
                    return
                self._sending = True
                message = self._waiting.popleft()
            try:
                self._pipe.send_bytes(message)
            except OSError:  # nobody is at the other end any more
                self.end()
