"""Background work that grows old: of each kind one piece is worked at, and only the newest waits behind it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Hashable
from concurrent.futures import Executor

Work = Callable[[], None]
_LOG = logging.getLogger(__name__)


class Lanes:
    """Thread-safe. Work of different lanes runs side by side; in one lane newer work replaces what waits."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._lock = threading.Lock()
        self._waiting: dict[Hashable, Work | None] = {}  # by lane that is busy

    def submit(self, lane: Hashable, work: Work) -> None:
        """Do the work now, or after what the lane is busy with."""
        with self._lock:
            busy = lane in self._waiting
            self._waiting[lane] = work if busy else None
        if not busy:
            self._executor.submit(self._run, lane, work)

    def _run(self, lane: Hashable, work: Work | None) -> None:
        while work is not None:
            try:
                work()
            except Exception:  # what waits is done all the same, and the lane is free after it
                _LOG.exception("background work failed")
            with self._lock:
                work, self._waiting[lane] = self._waiting[lane], None
                if work is None:
                    del self._waiting[lane]
