"""How much clearance a snake's vertices have in their pathway, where it falls, and how fast it can: for a QP's rows.

The signed clearance of a vertex is δ of eq. 8 (Kwok 2013) outside of the window, and inside minus the least distance
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


APART_MM = 3.0  # vertices nearer to each other than that ...
ALIKE = 0.95  # ... whose gradients have more than this cosine get one row


class Binding(NamedTuple):
    """Vertices that get a row of a QP: signed + gradient · (motion of the vertex) ≤ bound of its link."""

    link: IntArray
    """(n,)."""
    vertex: IntArray
    """(n,) rows in ``LinkVertices.points``."""
    point: Array
    """(n, 3) where they are in the patient frame, mm."""
    signed: Array
    """(n,) mm."""
    gradient: Array
    """(n, 3) without unit: what ``signed`` grows by per mm."""


def clearances(
    query: Query, packed: PackedPathway, frames: ArrayLike, windows: ArrayLike | tuple[int, int]
) -> tuple[Array, Array, IntArray]:
    """Signed clearance (V,) in mm of every vertex, its gradient (V, 3) and the segment (V,) it is taken from.

    The gradient is that of the winning segment's section: along x - c of the wall's nearest point c, and around the
    axis by as much as the wall's radius changes there. On the wall itself it points outwards.
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
    """Of each link the vertices with the largest signed clearance, no two of which say the same.

    Args:
        query, packed, frames, windows: as for ``clearances``.
        bound: (L,) mm, what each link may deviate.
        near_mm: vertices that have more than this left to their link's bound are left out.
        per_link: so many of a link at most.

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

    In the section's own coordinates, t along the axis and h from it, the distance to the wall changes by no more than
    1 per mm; and as the section turns by dφ about the axis, by no more than its wall moves in it: K dφ,

        K = max over both contours of √((R tan β)² + (R' / cos β)²),   cos β = M·e, R' = dR/dψ.

    Turning takes h dφ, perpendicular to the section, so Λ = √(1 + (K / h)²). A point whose deviation is
    δ has h ≥ c - δ from the axis of the segment that it is measured to, c its inscribed radius, and so has every point
    of the straight line where δ is no more than that.

    Args:
        deviation_mm: the largest deviation that is asked for, less than every inscribed radius. None: half of each
            inscribed radius, and any deviation of points between their segment's planes, whose h is no less than that.

    It holds for two points whose connecting line stays between the window's outer planes: there a point inside of a
    segment leaves it through the wall, where δ grows from 0, or into a neighbour, which has the same section there.
    Beyond the window's ends δ has a step.
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
