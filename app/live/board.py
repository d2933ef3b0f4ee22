"""What the pages currently show, for the live link."""

from __future__ import annotations

import threading

from vfix_engine.arrays import Array


class LiveBoard:
    """The last opened plan that is still open, and the pose of the rehearsed tool. Thread-safe.

    wanted: whether the live link runs; otherwise the tool's pose need not be computed.
    """

    def __init__(self) -> None:
        self.wanted = False
        self._lock = threading.Lock()
        self._plans: dict[str, str] = {}  # by the page that shows them, the last opened one at the end
        self._pose: Array | None = None
        self._driven = ""
        self._poses = 0

    def opened(self, page: str, plan_id: str | None) -> None:
        """Note that a page, by the id of its client, has opened a plan, or closed its plan if plan_id is None."""
        with self._lock:
            self._plans.pop(page, None)  # moves it to the end
            if plan_id is not None:
                self._plans[page] = plan_id

    @property
    def plan_id(self) -> str | None:
        """Id of the last opened plan that a page still shows; None if no page shows one."""
        with self._lock:
            return next(reversed(self._plans.values()), None)

    def show_tool(self, transform: Array, driven: str) -> None:
        """Set the pose of the tool, and how it is driven in words.

        transform (4, 4): from the tool's tip to the image, LPS mm.
        """
        with self._lock:
            self._pose, self._driven = transform, driven
            self._poses += 1

    @property
    def tool(self) -> tuple[int, Array | None, str]:
        """Number of poses set so far, the newest one, and how the tool is driven; '' before the first."""
        with self._lock:
            return self._poses, self._pose, self._driven
