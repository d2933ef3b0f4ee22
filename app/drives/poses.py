"""A snapshot of a drive as one row of float64, for programs that read poses as fast as they are published."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vfix_engine.arrays import Array

if TYPE_CHECKING:  # slow to load, and not needed for the address
    from vfix_engine.runtime.snapshot import Snapshot

MAX_READERS = 16  # at a time


class PoseColumns(NamedTuple):
    """Fields of a world's snapshots in a row: vectors (3,) in LPS mm or N, and numbers."""

    places: tuple[str, ...]
    numbers: tuple[str, ...]

    def names(self, snapshot: Snapshot) -> list[str]:
        """Names of the row's columns; q in mm and rad, t_s on the control process's clock, running 0 or 1."""
        places = [f"{name}_{axis}" for name in self.places for axis in "xyz"]
        joints = [f"q_{index}" for index in range(len(snapshot.q))]
        return ["t_s", "steps", "running", *places, *self.numbers, *joints]

    def row(self, snapshot: Snapshot) -> Array:
        """The row (n,) of :meth:`names`; a number that the world does not have is NaN, as a free hand's margin."""
        state = [snapshot.t, float(snapshot.steps), float(snapshot.running)]
        places = [getattr(snapshot, name) for name in self.places]
        numbers = [float(getattr(snapshot, name, np.nan)) for name in self.numbers]
        return np.concatenate([state, *places, numbers, snapshot.q]).astype("<f8")


ANY_WORLD = PoseColumns(("tip", "forces"), ("progress_mm", "length_mm"))
