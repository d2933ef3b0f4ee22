"""One moment of the tool as a single array of numbers, so that a compiled call takes and gives it whole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import compiled

Array = NDArray[np.float64]


def moment_size(dof: int, segments: int, bodies: int) -> int:
    """Numbers in a moment of n joints, S segments and B bodies."""
    return 8 * dof + 12 + 6 * segments + bodies * segments


@compiled
def moment_parts(
    moment: Array, dof: int, segments: int, bodies: int
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
    """Views of a moment's parts, patient frame, mm and rad.

    They are: joints (n,), joint velocity (n,), tip position (3,), tip rotation (3, 3), Jacobian (6, n), the segments'
    start (S, 3) and end (S, 3), distance (B, S) from every body to every segment.
    """
    a = 2 * dof + 12
    b = a + 6 * dof
    c = b + 6 * segments
    return (
        moment[:dof],
        moment[dof : 2 * dof],
        moment[2 * dof : 2 * dof + 3],
        moment[2 * dof + 3 : a].reshape(3, 3),
        moment[a:b].reshape(6, dof),
        moment[b : b + 3 * segments].reshape(segments, 3),
        moment[b + 3 * segments : c].reshape(segments, 3),
        moment[c : c + bodies * segments].reshape(bodies, segments),
    )
