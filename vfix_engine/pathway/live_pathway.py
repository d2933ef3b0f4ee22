"""The present pathway in moving tissue."""

from __future__ import annotations

from ..errors import PathwayError
from ..geometry.curve import Curve
from .packed import PackedPathway
from .pathway import Pathway


class LivePathway:
    """A pathway that is sampled periodically, and at every step while the tissue's motion gives no valid one.

    lost: reason in words why there is none now; the last one is then out of date, and motion must stop.
    """

    def __init__(self, pathway: Pathway, every_s: float) -> None:
        self.lost: str | None = None
        self._pathway, self._every_s, self._due = pathway, every_s, 0.0

    def share(self, t: float, dt: float) -> float:
        """Fraction of the work until the next sample that is due in the ``dt`` s ending at the time t."""
        return min(dt / max(self._due - t + dt, dt), 1.0)

    def look(self, t: float) -> tuple[PackedPathway, Curve] | None:
        """Return the pathway and its curve at the time t in s, if a sample is due and there is one."""
        if t < self._due:
            return None
        try:
            found = self._pathway.packed(t), self._pathway.curve(t)
        except PathwayError as error:
            self.lost = self.lost or f"the tissue leaves no pathway: {error}"  # keep the first message
            return None
        self.lost, self._due = None, t + self._every_s
        return found
