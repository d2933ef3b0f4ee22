"""Boundary fixture (Li 2007, eq. 16-17): no point of the tool enters the margin around the surface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled, no_refcount
from ..proximity.proximity import Pairs
from ..robots import TipState
from .fixture import Rows, Situation
from .rows import Constraint
from .state import StepState
from .stopping import approach_bounds


@no_refcount
def approach(normal: Array, point: Array, position: Array, jacobian: Array, row: Array) -> None:
    """Row over Δq of −n·ΔP, the approach of a point of the tool along n (Li 2007, eq. 16).

    n·(ω × r) = ω·(r × n), where r is the vector from the tip to the point.

    Args:
        normal, point: (3,) unit vector n and the point in mm, patient frame.
        position, jacobian: (3,) and (6, n) of the tip.
        row: output; its first n entries are written.
    """
    x, y, z = point[0] - position[0], point[1] - position[1], point[2] - position[2]
    a, b, c = normal[0], normal[1], normal[2]
    u, v, w = y * c - z * b, z * a - x * c, x * b - y * a
    for j in range(jacobian.shape[1]):
        linear = a * jacobian[0, j] + b * jacobian[1, j] + c * jacobian[2, j]
        row[j] = -linear - (u * jacobian[3, j] + v * jacobian[4, j] + w * jacobian[5, j])


@compiled
def _approaches(normals: Array, points: Array, position: Array, jacobian: Array, rows: Array) -> None:
    for i in range(len(rows)):
        approach(normals[i], points[i], position, jacobian, rows[i])


def boundary(pairs: Pairs, tip: TipState, margin_mm: float, change: float = np.inf) -> Constraint:
    """One row per pair (Li 2007, eq. 16-17); distances are from the tool's surface, so its radius is included.

    The row of pair k is −n_k·ΔP_k ≤ approach_bound(distance_k − margin), with n_k the unit vector from the surface to
    the tool and ΔP_k = J_k Δq, J_k the Jacobian (3, n) of the tool's point P_k.

    Args:
        pairs: m closest pairs, lengths in mm.
        tip: the pose and Jacobian at which the pairs were measured.
        margin_mm: distance that the linearised motion keeps.
        change: deceleration · dt² in mm; ∞ gives eq. 16, where a point may use all of its slack in one step.

    Returns:
        m constraint rows of the kind 'bone', in mm.
    """
    count = len(pairs.distance)
    matrix = np.zeros((count, tip.jacobian.shape[1] + 1))
    _approaches(pairs.normal, pairs.on_tool, tip.position, tip.jacobian, matrix)
    return Constraint("bone", matrix, approach_bounds(pairs.distance - margin_mm, change), np.arange(count))


@dataclass(frozen=True)
class Boundary:
    """Boundary of one structure: no part of the tool comes nearer than ``margin_mm``, and it can stop in time.

    A ``ControlContext`` lists these in its ``fixtures``. There kernels write the rows and the certificate checks the
    motion; this class gives the same rows to programs that are built without a context.

    Args:
        margin_mm: smallest distance in mm. deceleration_mm_per_s2: with which a point can stop before it.
        body: row of ``StepState.distance``; 0 is the anatomy, the zones follow.
        structure: id of the structure.
    """

    margin_mm: float
    deceleration_mm_per_s2: float = 300.0
    body: int = 0
    structure: str = "bone"

    def rows(self, now: Situation) -> Rows:
        """One constraint row per pair of this structure, in mm."""
        change = self.deceleration_mm_per_s2 * now.dt_s**2
        own = np.flatnonzero(now.body == self.body)
        constraint = boundary(now.pairs.take(own), now.state.tip, self.margin_mm, change)
        return Rows((), (replace(constraint, kind="zone") if self.body else constraint,))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        """Whether every segment keeps the margin at the new pose, or its distance where that was less.

        The certificate checks the motion between the poses.
        """
        kept = np.minimum(before.distance[self.body], self.margin_mm)
        return bool((after.distance[self.body] >= kept).all())
