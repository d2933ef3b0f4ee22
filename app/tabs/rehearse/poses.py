"""A snapshot of the drive as one row of float64, for programs that read poses as fast as they are published."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vfix_engine.arrays import Array

if TYPE_CHECKING:  # slow to load, and the address needs none of it
    from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

MAX_READERS = 16  # at a time
_PLACES = ("tip", "grip", "virtual_point", "force")
_NUMBERS = ("tip_error_mm", "clearance_mm", "margin_mm", "progress_mm", "length_mm", "target_error_mm")


def fields(snapshot: RigidSnapshot) -> list[str]:
    """Names of the row's columns.

    Places in LPS mm, force in N, q in mm and rad, t_s on the control process's clock, running 0 or 1.
    """
    places = [f"{name}_{axis}" for name in _PLACES for axis in "xyz"]
    joints = [f"q_{number}" for number in range(len(snapshot.q))]
    return ["t_s", "steps", "running", *places, *_NUMBERS, *joints]


def row(snapshot: RigidSnapshot) -> Array:
    """The row (n,) of :func:`fields`; a number that does not exist is NaN."""
    state = [snapshot.t, float(snapshot.steps), float(snapshot.running)]
    places = [getattr(snapshot, name) for name in _PLACES]
    numbers = [float(getattr(snapshot, name)) for name in _NUMBERS]
    return np.concatenate([state, *places, numbers, snapshot.q]).astype("<f8")
