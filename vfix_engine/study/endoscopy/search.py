"""Where a simulated person of study I looks again: what he remembers of his own acts and looks.

Nothing here reads a snapshot. A place is as far along the way as his hand has inserted, which is more than the tip has
come where the robot was held.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ..polyps.printed import POLYPS
from .endoscopist import Endoscopist
from .picture import SeenPolyp

# How a person goes about it: all assumed.
_STANDS_MM = ((22.0, 34.0, 12.0, 46.0), (28.0, 10.0, 40.0, 0.0))  # before a polyp, from which he looks for it
_BEYOND_MM = 40.0  # so far behind a polyp that he has left he goes back to it once more
_PASSED_MM = -5.0  # the same, of one that he has only noticed
_GAP_STEP_MM = 30.0  # between the places of a gap from which he looks round


def rules(who: Endoscopist) -> dict[str, str]:
    """Each rule in words, by name."""
    first, again = (", ".join(f"{mm:g}" for mm in stands) for stands in _STANDS_MM)
    return {
        "polyp lost": f"he looks for it with a straight tip from {first} mm before the place where it was seen, to its "
        f"side first, then all round; a second time from {again} mm; then it is left for good",
        "polyp passed": f"one that he noticed and did not clear he goes back to, at the latest {_BEYOND_MM:g} mm later",
        "flexure": f"where the picture is all wall, or it goes on at its edge, he looks round, once in "
        f"{who.flexure_mm:g} mm",
        "gap": f"after {who.gap_mm:g} mm without a polyp he goes back over them, and looks round every "
        f"{_GAP_STEP_MM:g} mm",
        "content": f"he looks again until the {POLYPS} that the instruction tells of are cleared, or for "
        f"{who.whole_s:g} s in all",
        "force": f"while nothing is looked at he gives way to a force above {who.free_n:g} N before he goes on",
    }  # fmt: skip


@dataclass
class LookAgain:
    """Places along the way from which he looks for a polyp, or, number None, for any that he has not noticed.

    stands: mm that his hand has inserted, in turn; those that were visited are taken away. side: (2,) unit, where in
    the picture it was seen.
    """

    number: int | None
    stands: list[float]
    side: Array | None = None


class _Place(NamedTuple):
    at_mm: float
    side: Array


class Memory:
    """What a person of study I remembers of the way; depths are mm that his hand has inserted."""

    def __init__(self, who: Endoscopist) -> None:
        self._who = who
        self._places: dict[int, _Place] = {}
        self._left: set[int] = set()
        self._tries: Counter[int] = Counter()
        self._looked: list[float] = []
        self._fresh_mm = 0.0  # where a polyp was noticed or cleared last, or a gap looked over

    def noticed(self, polyp: SeenPolyp, depth_mm: float) -> None:
        """A polyp in the picture that he minds."""
        off = math.hypot(*polyp.off_deg)
        side = polyp.off_deg / off if off > 0.0 else np.array([1.0, 0.0])
        if polyp.number not in self._places:
            self._fresh_mm = max(self._fresh_mm, depth_mm)
        self._places[polyp.number] = _Place(depth_mm + polyp.distance_mm * math.cos(math.radians(off)), side)

    def gone(self, number: int | None, depth_mm: float) -> None:
        """A polyp was cleared."""
        self._fresh_mm = max(self._fresh_mm, depth_mm)
        if number is not None:
            self._places.pop(number, None)
            self._left.discard(number)

    def leaves(self, number: int) -> bool:
        """He leaves a polyp; whether for good."""
        self._tries[number] += 1
        self._left.add(number)
        if self._tries[number] < len(_STANDS_MM):
            return False
        self._places.pop(number, None)
        return True

    def left(self, number: int) -> bool:
        """Whether he has left a polyp for now."""
        return number in self._left

    def looked(self, depth_mm: float) -> None:
        """He looked round at a place."""
        self._looked.append(depth_mm)

    def visit(self, number: int) -> LookAgain:
        """To a polyp that he noticed."""
        at, side = self._places[number]
        return LookAgain(number, [max(at - mm, 0.0) for mm in _STANDS_MM[self._tries[number]]], side)

    def next(self, depth_mm: float, cleared: int, time_s: float, flexure: bool) -> LookAgain | None:
        """Where he looks before he goes on; None: nowhere. flexure: as the picture has it."""
        if cleared >= POLYPS or time_s > self._who.whole_s:
            return None
        for number, place in self._places.items():
            if depth_mm > place.at_mm + (_BEYOND_MM if number in self._left else _PASSED_MM):
                self._left.discard(number)
                return self.visit(number)
        if flexure and not self._near(depth_mm, self._who.flexure_mm):
            return LookAgain(None, [depth_mm])
        if depth_mm - self._fresh_mm > self._who.gap_mm:
            begin, self._fresh_mm = self._fresh_mm, depth_mm
            stands = np.arange(depth_mm, begin, -_GAP_STEP_MM).tolist()
            stands = [mm for mm in stands if not self._near(mm, 0.5 * _GAP_STEP_MM)]
            return LookAgain(None, stands) if stands else None
        return None

    def _near(self, depth_mm: float, apart_mm: float) -> bool:
        return any(abs(depth_mm - one) < apart_mm for one in self._looked)
