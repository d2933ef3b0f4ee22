"""Background work that grows old: of each kind one piece is worked at, and only the newest waits behind it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from concurrent.futures import Executor

from app.workspace.background import Failed, Work, guarded


class LatestQueue:
    """Thread-safe. Work of different lanes runs side by side; in one lane newer work replaces what waits."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._lock = threading.Lock()
        self._waiting: dict[Hashable, Work | None] = {}  # by lane that is busy

    def submit(self, lane: Hashable, what: str, work: Callable[[], None], failed: Failed) -> None:
        """Do the work now, or after what the lane is busy with; what, failed: as of `background.in_background`."""

        def told() -> None:
            guarded(what, work, failed)

        with self._lock:
            busy = lane in self._waiting
            self._waiting[lane] = told if busy else None
        if not busy:
            self._executor.submit(self._run, lane, told)

    def _run(self, lane: Hashable, work: Work | None) -> None:
        while work is not None:
            work()  # which does not raise: what waits is done all the same, and the lane is free after it
            with self._lock:
                work, self._waiting[lane] = self._waiting[lane], None
                if work is None:
                    del self._waiting[lane]
