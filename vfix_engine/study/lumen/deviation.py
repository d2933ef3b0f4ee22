"""How the distal links of a snake deviate from the pathway (Kwok 2013, Table III); docs/lumen_tasks.md defines it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, BoolArray
from ..metrics.score import MeanMax


@dataclass(frozen=True)
class Deviation:
    """Times in which any of the distal links was outside the pathway (Kwok 2013, Table III, a_i = 0).

    episodes: their number, each in one piece; time_s: of all of them, longest_s: of the longest. length_mm: the tip's
    way while the last link is outside. depth_mm: of the deepest link, the mean over the time of the episodes; None
    without any.
    """

    episodes: int
    time_s: float
    longest_s: float
    length_mm: float
    depth_mm: MeanMax | None


def deviation_of(outside: Array, dt: Array, way: Array) -> Deviation:
    """The deviation in n steps.

    Args:
        outside: (n, L') mm after each step, depth of each distal link outside the pathway, the last one last; 0 inside
            (eq. 9). dt: (n,) s, duration of each step. way: (n,) mm, of the tip in each step.
    """
    depth = outside.max(axis=1, initial=0.0)
    lasted = episodes(depth > 0.0, dt)
    spent = float(dt[depth > 0.0].sum())
    return Deviation(
        episodes=len(lasted),
        time_s=spent,
        longest_s=float(lasted.max(initial=0.0)),
        length_mm=float(way[outside[:, -1] > 0.0].sum()),
        depth_mm=MeanMax(float(depth @ dt) / spent, float(depth.max())) if spent > 0.0 else None,
    )


def episodes(true: BoolArray, dt: Array) -> Array:
    """(k,) s, durations of the pieces in which something is true after each step of ``dt`` (n,) s."""
    edge = np.diff(true.astype(np.int8), prepend=0, append=0)
    first, beyond = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
    until = np.append(0.0, np.cumsum(dt))
    lasted: Array = until[beyond] - until[first]
    return lasted
