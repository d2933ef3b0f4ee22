"""What the pages show at this moment, for those who are told of it."""

from __future__ import annotations

import threading

from vfix_engine.arrays import Array


class LiveBoard:
    """The plan that was opened last and is still open, and the pose of the tool that is rehearsed. Thread-safe.

    wanted: whether a client is connected; otherwise the tool's pose need not be computed.
    """

    def __init__(self) -> None:
        self.wanted = False
        self._lock = threading.Lock()
        self._plans: dict[str, str] = {}  # by the page that shows them, the one that was opened last at the end
        self._pose: Array | None = None
        self._poses = 0

    def opened(self, page: str, plan_id: str | None) -> None:
        """A page, by the id of its client, has opened a plan; None where it has closed the one that it had."""
        with self._lock:
            self._plans.pop(page, None)  # so that it comes last
            if plan_id is not None:
                self._plans[page] = plan_id

    @property
    def plan_id(self) -> str | None:
        """The plan that was opened last of those that a page still shows; None where no page shows any."""
        with self._lock:
            return next(reversed(self._plans.values()), None)

    def show_tool(self, transform: Array) -> None:
        """The tool is at a pose: (4, 4) from the tool's tip to the image, LPS mm."""
        with self._lock:
            self._pose = transform
            self._poses += 1

    @property
    def tool(self) -> tuple[int, Array | None]:
        """How many poses were told, and the newest."""
        with self._lock:
            return self._poses, self._pose
