"""A snake's vertices in compact patches of 16, as the compiled query reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

if TYPE_CHECKING:  # the query is to be had without the robots' libraries
    from ..robots.snake_surface import LinkVertices

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LANES = 16


class VertexBlocks(NamedTuple):
    """Blocks of 16 vertices of one link each, in the frame of that link, mm; all read-only.

    A block that has fewer repeats some of them.
    """

    lanes: Array
    """(B, 48): x of the 16, y, z."""
    ball: Array
    """(B, 4): centre and radius of a ball about them."""
    start: Index
    """(L + 1,): link l has the blocks start[l] … start[l + 1] - 1."""
    index: Index  # type: ignore[assignment]  # tuple has a method of that name, which nobody calls here
    """(B, 16): their rows in ``LinkVertices.points``."""


def vertex_blocks(vertices: LinkVertices) -> VertexBlocks:
    """The vertices sorted into blocks, each link's halved again and again across its longest extent.

    Raises:
        InputError: points that are not finite, or a link that has none.
    """
    points = np.array(vertices.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError("vertices of a snake are finite points (V, 3) in mm")
    index: list[Index] = []
    start = [0]
    for link, (first, last) in enumerate(zip(vertices.start[:-1], vertices.start[1:], strict=True)):
        if not 0 <= first < last <= len(points):
            raise InputError(f"link {link} has no vertices: rows {first} to {last} of {len(points)}")
        patches = _halved(points, np.arange(first, last))
        # The link's first vertex is the first of its first block: it is named where nothing deviates.
        patches.sort(key=lambda patch: first not in patch)
        patches[0] = np.sort(patches[0])
        index += patches
        start.append(len(index))
    rows = np.array([np.resize(one, LANES) for one in index], dtype=np.int64)
    lanes = np.ascontiguousarray(points[rows].transpose(0, 2, 1)).reshape(-1, 3 * LANES)
    ball = np.array([_ball(points[one]) for one in index])
    blocks = VertexBlocks(lanes, ball, np.array(start, dtype=np.int64), rows)
    for array in blocks:
        array.setflags(write=False)
    return blocks


def _halved(points: Array, index: Index) -> list[Index]:
    """Rows in patches of 16, the last may have fewer."""
    if len(index) <= LANES:
        return [index]
    spread = np.ptp(points[index], axis=0)
    ordered = index[np.argsort(points[index, int(spread.argmax())], kind="stable")]
    blocks = -(-len(index) // LANES)
    half = LANES * (blocks // 2)
    return _halved(points, ordered[:half]) + _halved(points, ordered[half:])


def _ball(points: Array) -> tuple[float, float, float, float]:
    """A ball about points: begun at the middle of their box, moved towards the farthest again and again."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    best, best_radius = centre, float(np.linalg.norm(points - centre, axis=1).max())
    for k in range(1, 60):  # Bădoiu & Clarkson 2003: the way to the farthest point, divided by k + 1
        away = np.linalg.norm(points - centre, axis=1)
        centre = centre + (points[away.argmax()] - centre) / (k + 1)
        radius = float(np.linalg.norm(points - centre, axis=1).max())
        if radius < best_radius:
            best, best_radius = centre, radius
    grown = best_radius * (1.0 + 1e-12) + 1e-12  # more than the distances may have been rounded
    return float(best[0]), float(best[1]), float(best[2]), grown
