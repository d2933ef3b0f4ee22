"""The row of a free tool: the recorded numbers of every step; what a rigid tool on a robot has too has its name."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...runtime.system import Column
from ..rigid.row import OUTCOMES, PHASES
from .state import FreehandState

_XYZ = ("x", "y", "z")


def row_layout(parts: int, structures: int) -> tuple[Column, ...]:
    """Names and units for a tool of some parts among some structures.

    push: sum of the contact forces; contacts, depth: so far, their number and the largest of their depths.
    """
    columns = [Column("t", "s"), *(Column(f"tip_{axis}", "mm") for axis in _XYZ)]
    columns += [Column(f"r{i}{j}", "") for i in range(3) for j in range(3)]
    columns += [Column(f"s{i}_{end}{axis}", "mm") for end in "ab" for i in range(parts) for axis in _XYZ]
    columns += [Column(f"d{body}_{i}", "mm") for body in range(structures) for i in range(parts)]
    columns += [Column(f"force_{axis}", "N") for axis in _XYZ] + [Column(f"torque_{axis}", "N·mm") for axis in _XYZ]
    columns += [Column(f"push_{axis}", "N") for axis in _XYZ]
    columns += [Column("contacts", ""), Column("depth", "mm")]
    columns += [Column("path_s", "mm"), Column("phase", ""), Column("target", ""), Column("outcome", "")]
    return tuple(columns)


def write_row(state: FreehandState, out: Array) -> None:
    """The numbers of a state into ``out``."""
    path_s = -1.0 if state.nearest is None else state.nearest.s
    time = np.array([state.t])
    places = PHASES.index(state.phase), state.target, OUTCOMES.index(state.outcome)
    last = np.array([float(state.count.sum()), float(state.deepest.max()), path_s, *places])
    numbers = (
        time, state.position, state.rotation.ravel(), state.segments.start.ravel(), state.segments.end.ravel(),
        state.distance.ravel(), state.force, state.torque, state.push, last,
    )  # fmt: skip
    np.concatenate(numbers, out=out)
