"""Signed clearance of a snake's vertices in their pathway with its gradient and Lipschitz constant, for rows of a QP.

The signed clearance of a vertex is δ of Kwok 2013, eq. 8, outside the window, and inside minus the smallest distance
to the walls v2 v3 of the window's sections.
"""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, IntArray
from ...errors import InputError
from ..packed import INSCRIBED_RADIUS, LIPSCHITZ
from .clearance_kernel import choose_binding, vertex_clearances

if TYPE_CHECKING:
    from ..packed import PackedPathway
    from .query import Query


APART_MM = 3.0  # vertices closer to each other than that ...
ALIKE = 0.95  # ... and whose gradients have a larger cosine than this share one row


class Binding(NamedTuple):
    """Vertices with a row of a QP: signed + gradient · (motion of the vertex) ≤ bound of its link."""

    link: IntArray
    """(n,)."""
    vertex: IntArray
    """(n,) rows in ``LinkVertices.points``."""
    point: Array
    """(n, 3) positions in the patient frame, mm."""
    signed: Array
    """(n,) mm."""
    gradient: Array
    """(n, 3) dimensionless: derivative of ``signed`` with respect to the position."""


def clearances(
    query: Query, packed: PackedPathway, frames: ArrayLike, windows: ArrayLike | tuple[int, int]
) -> tuple[Array, Array, IntArray]:
    """Signed clearance (V,) in mm of every vertex, its gradient (V, 3) and the segment (V,) that determines it.

    The gradient is that of the determining segment's section: along x - c with c the wall's nearest point, and around
    the axis by the change of the wall's radius there. On the wall itself it points outwards.
    Arguments and errors are those of ``Query.deviations`` with one pose.
    """
    poses, window = query.checked(packed, frames, windows)
    points, start = query.vertices.points, query.vertices.start
    signed, gradient = np.empty(len(points)), np.empty((len(points), 3))
    segment = np.empty(len(points), dtype=np.int64)
    vertex_clearances(packed.rows, packed.polar, window, poses[0], points, start, signed, gradient, segment)
    return signed, gradient, segment


def binding_vertices(
    query: Query,
    packed: PackedPathway,
    frames: ArrayLike,
    windows: ArrayLike | tuple[int, int],
    bound: ArrayLike,
    near_mm: float = np.inf,
    per_link: int = 8,
) -> Binding:
    """Select of each link the vertices with the largest signed clearance, without redundant ones.

    Args:
        query, packed, frames, windows: as for ``clearances``.
        bound: (L,) mm, largest deviation of each link.
        near_mm: vertices that are further than this from their link's bound are excluded.
        per_link: largest number of vertices of a link.

    Raises:
        InputError: as ``Query.deviations``; bounds of another shape or not numbers.
    """
    limit = np.array(bound, dtype=np.float64)
    if limit.shape != (query.links,) or np.isnan(limit).any():
        raise InputError(f"bounds are numbers ({query.links},) in mm, not {limit.shape}")
    signed, gradient, _ = clearances(query, packed, frames, windows)
    points, start = query.vertices.points, query.vertices.start
    chosen = np.empty(per_link * query.links, dtype=np.int64)
    count = choose_binding(points, start, signed, gradient, limit - near_mm, per_link, APART_MM, ALIKE, chosen)
    vertex = chosen[:count].copy()
    link: IntArray = np.searchsorted(start, vertex, side="right") - 1
    poses = query.checked(packed, frames, windows)[0][0, link]
    point = np.einsum("nij,nj->ni", poses[:, :, :3], points[vertex]) + poses[:, :, 3]
    return Binding(link, vertex, point, signed[vertex], gradient[vertex])


def lipschitz_constant(packed: PackedPathway, first: int, last: int, deviation_mm: float | None = None) -> float:
    """Λ with |δ(x) - δ(y)| ≤ Λ ‖x - y‖ for the deviation δ of eq. 8 from the segments ``first`` … ``last`` - 1.

    In the section's own coordinates, t along the axis and h from it, the distance to the wall changes by at most
    1 per mm; and as the section rotates by dφ about the axis, by at most the displacement of its wall: K dφ,

        K = max over both contours of √((R tan β)² + (R' / cos β)²),   cos β = M·e, R' = dR/dψ.

    The rotation is a motion of h dφ, perpendicular to the section, so Λ = √(1 + (K / h)²). A point whose deviation is
    δ has h ≥ c - δ from the axis of the segment that it is measured to, with c its inscribed radius, and so has every
    point of the straight line on which δ is at most that.

    Args:
        deviation_mm: upper bound of the deviations, less than every inscribed radius. None: half of each
            inscribed radius, and any deviation of points between their segment's planes, whose h is at least that.

    It holds for two points whose connecting line stays between the window's outer planes: there a point inside a
    segment leaves it through the wall, where δ increases from 0, or into a neighbour, which has the same section there.
    Beyond the window's ends δ is discontinuous.
    """
    rows = packed.rows[first:last]
    if deviation_mm is None:
        return float(rows[:, LIPSCHITZ].max())
    inscribed = rows[:, INSCRIBED_RADIUS]
    if not 0.0 <= deviation_mm < inscribed.min():
        raise InputError(
            f"a deviation of {deviation_mm} mm, but the least inscribed radius is {inscribed.min():.3f} mm"
        )
    turned = np.sqrt(np.maximum(rows[:, LIPSCHITZ] ** 2 - 1.0, 0.0)) * 0.5 * inscribed / (inscribed - deviation_mm)
    return hypot(1.0, float(turned.max()))
