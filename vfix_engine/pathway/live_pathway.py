"""The pathway of now, where the tissue moves."""

from __future__ import annotations

from ..errors import PathwayError
from ..geometry.curve import Curve
from .packed import PackedPathway
from .pathway import Pathway


class LivePathway:
    """A pathway that is looked at every so often, and again at once while the tissue leaves none.

    lost: in words, why there is none now; what was seen last is then older than it may be, and nothing may move by it.
    """

    def __init__(self, pathway: Pathway, every_s: float) -> None:
        self.lost: str | None = None
        self._pathway, self._every_s, self._due = pathway, every_s, 0.0

    def share(self, t: float, dt: float) -> float:
        """Of what is to be done until the next look, how much is to be done in the ``dt`` s that end at the time t."""
        return min(dt / max(self._due - t + dt, dt), 1.0)

    def look(self, t: float) -> tuple[PackedPathway, Curve] | None:
        """The pathway and its curve at the time t in s, if it is time to look and there is one."""
        if t < self._due:
            return None
        try:
            found = self._pathway.packed(t), self._pathway.curve(t)
        except PathwayError as error:
            self.lost = self.lost or f"the tissue leaves no pathway: {error}"  # the first words, not new ones each step
            return None
        self.lost, self._due = None, t + self._every_s
        return found
