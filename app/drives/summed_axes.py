"""Axes of a drive that several things of one hand push at once: keys and a device."""

from __future__ import annotations

import threading
from collections.abc import Sequence

Axes = tuple[float, float, float]


class SummedAxes:
    """The sum of what every source pushes, each axis from -1 to +1; a source that rests adds nothing. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._by_source: dict[str, Axes] = {}

    def push(self, source: str, axes: Axes) -> Axes:
        """The sum with what a source pushes now instead of before."""
        with self._lock:
            self._by_source[source] = axes
            right, down, along = map(_sum, zip(*self._by_source.values(), strict=True))
            return right, down, along

    def clear(self) -> None:
        """Nothing pushes any more."""
        with self._lock:
            self._by_source.clear()


def _sum(values: Sequence[float]) -> float:
    return max(-1.0, min(1.0, sum(values)))
