"""Non-blocking sending of messages over a pipe."""

from __future__ import annotations

import threading
from collections import deque
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

MOST = 256  # capacity of the queue


class Outbox:
    """A bounded queue in front of a pipe, emptied by a thread of its own; only ``flush`` and ``join`` block."""

    def __init__(self, pipe: Connection):
        self._pipe = pipe
        self._waiting: deque[memoryview] = deque()
        self._change = threading.Condition()
        self._sending = self._ended = False
        self._thread = threading.Thread(target=self._run, name="vfix-outbox", daemon=True)
        self._thread.start()

    @property
    def free_slots(self) -> int:
        """Number of messages that can be queued; 0 if the receiver has not read for long."""
        return MOST - len(self._waiting)

    @property
    def ended(self) -> bool:
        """Whether the receiver is gone, or ``end`` was called."""
        return self._ended

    def put(self, message: Any) -> bool:
        """Queue a message for ``Connection.send``; returns False, and discards it, if the queue is full."""
        packed = ForkingPickler.dumps(message)  # here, so that an unpicklable message raises in the caller
        with self._change:
            if self._ended or len(self._waiting) >= MOST:
                return False
            self._waiting.append(packed)
            self._change.notify_all()
            return True

    def flush(self, seconds: float) -> bool:
        """Wait until everything is sent, for at most that many seconds."""
        with self._change:
            return self._change.wait_for(lambda: self._ended or not (self._waiting or self._sending), seconds)

    def end(self) -> None:
        """Stop sending; the thread ends when the pipe permits, at the latest when the receiver is gone."""
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
            except OSError:  # the receiver is gone
                self.end()
