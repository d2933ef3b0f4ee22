"""Times in one piece in which something is true of the samples of a run."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, BoolArray

GAP_S = 0.3  # a hold that goes on after a shorter interruption is one: a hand that presses on and slides is told once


def spans(active: BoolArray, t: Array) -> list[tuple[int, int]]:
    """First and last sample of every time in which ``active`` (n,) is True, interruptions up to ``GAP_S`` included.

    t: (n,) s.
    """
    places = np.flatnonzero(active)
    if not len(places):
        return []
    breaks = np.flatnonzero(np.diff(t[places]) > GAP_S)
    return list(zip(places[[0, *breaks + 1]].tolist(), places[[*breaks, -1]].tolist(), strict=True))
