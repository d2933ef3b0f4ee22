"""Inputs and workspace of the compiled parts of a step, handed over as one table of addresses."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from ..arrays import Array, Int32Array, IntArray
from ..kernels.array_table import float32_at, float64_at, int32_at, int64_at
from ..kernels.compiled import shared
from ..kernels.packed import packing
from ..proximity.candidate_kernels import QUERY_SPACE
from ..proximity.pairs import MAX_ROWS
from .constants import CandidateTriangles, StepConstants, unpack_candidates, unpack_constants

COLUMNS = 11  # of a pair's row: the ten of ``proximity.rows_kernel``, then the slack to its obstacle's buffered margin
SLACK = 10


class MotionSpace(NamedTuple):
    """Workspace of a motion's certificate; n joints, s segments, b obstacles.

    made: the step, clipped to the joints' ranges; chord, slack: of each segment, see ``chords`` and ``binding_slack``.
    floor: distances that the motion must keep; within: those up to which pairs are searched.
    shape: rows of one shape's pairs; query: see ``candidate_kernels.query_views``.
    """

    made: Annotated[Array, "n"]
    chord: Annotated[Array, "s"]
    slack: Annotated[Array, "s"]
    floor: Annotated[Array, "b", "s"]
    within: Annotated[Array, "b", "s"]
    shape: Annotated[Array, 3, 10]
    query: Annotated[Array, QUERY_SPACE]


MOTION_SPACE = packing(MotionSpace, "n", "s", "b")
_scratch_views = MOTION_SPACE.views


class PairSpace(NamedTuple):
    """Workspace for R pairs of tool and obstacles.

    rows: (R, 11); labels: (R, 3) segment, triangle and obstacle; order: (R + MAX_ROWS,) of ``binding``.
    """

    rows: Array
    labels: Int32Array
    order: Int32Array

    @classmethod
    def of(cls, pairs: int) -> PairSpace:
        """Allocate the workspace for that many pairs."""
        return cls(
            np.empty((pairs, COLUMNS)), np.empty((pairs, 3), np.int32), np.empty(pairs + MAX_ROWS, np.int32)
        )  # fmt: skip


class Inputs(NamedTuple):
    """Everything that is constant over the steps of a context; ``program``: workspace of its programs."""

    constants: StepConstants
    candidates: CandidateTriangles
    rows: Array
    labels: Int32Array
    order: Int32Array
    scratch: MotionSpace
    program: Array


@shared
def unpack_inputs(t: IntArray) -> Inputs:
    """Return the inputs of a table (``array_table.table_of``); for compiled code only.

    Its arrays are ``Surroundings.arrays``, a ``PairSpace``, a packed ``MotionSpace`` and the workspace of the programs.
    """
    constants = unpack_constants(float64_at(t[0], (t[1],)), int64_at(t[2], (t[3],)))
    n, s, b = len(constants.lower), len(constants.radius), len(constants.margin)
    candidates = unpack_candidates(
        s, float32_at(t[4], (t[5],)), float64_at(t[6], (t[7],)), int32_at(t[8], (t[9],)),
        int32_at(t[10], (t[11], t[12])), float64_at(t[13], (t[14],)),
    )  # fmt: skip
    return Inputs(
        constants, candidates, float64_at(t[15], (t[16], t[17])), int32_at(t[18], (t[19], t[20])),
        int32_at(t[21], (t[22],)), _scratch_views(float64_at(t[23], (t[24],)), n, s, b), float64_at(t[25], (t[26],)),
    )  # fmt: skip
