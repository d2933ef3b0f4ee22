"""What the pages show at this moment, for those who are told of it."""

from __future__ import annotations

import threading

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class LiveBoard:
    """The plan that was opened last, and the pose of the tool that is rehearsed. Thread-safe.

    wanted: whether anybody is told; else nobody need say where the tool is.
    """

    def __init__(self) -> None:
        self.wanted = False
        self._lock = threading.Lock()
        self._plan_id: str | None = None
        self._pose: Array | None = None
        self._poses = 0

    def opened(self, plan_id: str | None) -> None:
        """A page has opened a plan, or closed the one that it had."""
        with self._lock:
            self._plan_id = plan_id

    @property
    def plan_id(self) -> str | None:
        with self._lock:
            return self._plan_id

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
