"""Decimation of a surface: by edge collapse, and with a bound that holds for every point of the original.

`within` restores each original triangle that the decimated surface has left too far away. Restored triangles may
overlap decimated ones: they can only add bone. The bound is certified over whole triangles. The distance to one
triangle is convex, so its maximum over another one is at that one's corners; the minimum of these maxima over several
triangles of the result bounds the distance of every point of the original triangle. A triangle that fails is
subdivided, and restored if its parts fail as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import fast_simplification
import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.convex_bound import convex_bounds
from vfix_engine.anatomy.surface import clean, compact
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.proximity.quarters import quarters

_AGGRESSIVENESS = 5.0  # of the edge collapse, 0 to 10: slower and closer to the original than its default of 7
_CERTIFIED_SHARE = 1.5  # largest bound over whole triangles, relative to the tolerance at vertices
_SPLITS = 4  # times that a triangle is subdivided into four before it is restored
_CHUNK = 100_000  # triangles certified at a time, to limit memory


@dataclass(frozen=True)
class ThinnedSurface:
    """A decimated surface and its deviation from the original in mm.

    mean_deviation_mm: mean distance from the vertices of one to the triangles of the other, the larger direction.
    max_deviation_mm: largest distance over all vertices of both, in both directions.
    certified_mm: upper bound of the distance of any point of the original from the surface; None if only vertices were
        measured.
    put_back: number of restored triangles of the original.
    """

    mesh: TriangleMesh
    mean_deviation_mm: float
    max_deviation_mm: float
    certified_mm: float | None = None
    put_back: int = 0


def thin(mesh: TriangleMesh, target_triangles: int) -> ThinnedSurface:
    """Decimate by quadric edge collapse to about `target_triangles`, and measure the deviation at all vertices.

    A mesh of at most that size is returned unchanged.
    """
    if len(mesh.faces) <= target_triangles:
        return ThinnedSurface(mesh, 0.0, 0.0, 0.0)
    return measured(mesh, collapsed(mesh, target_triangles))


def measured(
    mesh: TriangleMesh, thinned: TriangleMesh, tell: Callable[[float], None] = lambda share: None
) -> ThinnedSurface:
    """Measure the deviation of a decimated surface from the original at all vertices; `tell` as in `within`."""
    there, back = _deviations(mesh, thinned, tell)
    return ThinnedSurface(thinned, max(there[0], back[0]), max(there[1], back[1]))


def clustered(mesh: TriangleMesh, target_triangles: int) -> TriangleMesh:
    """Reduce to roughly `target_triangles` for display: the vertices in a cell of a grid are merged in their mean."""
    sample = mesh.triangles[:: max(1, len(mesh.faces) // 10_000)]
    edge = float(np.linalg.norm(sample[:, 1] - sample[:, 0], axis=1).mean())
    cell = 1.3 * edge * np.sqrt(len(mesh.faces) / target_triangles)
    index = np.floor((mesh.vertices - mesh.vertices.min(axis=0)) / cell).astype(np.int64)
    count = index.max(axis=0) + 1
    _, number = np.unique((index[:, 0] * count[1] + index[:, 1]) * count[2] + index[:, 2], return_inverse=True)
    size = np.bincount(number)
    means = [np.bincount(number, weights=mesh.vertices[:, axis]) / size for axis in range(3)]
    faces = number[mesh.faces]
    kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return TriangleMesh(*compact(np.column_stack(means), faces[kept]))


def collapsed(mesh: TriangleMesh, target_triangles: int) -> TriangleMesh:
    """Decimate by quadric edge collapse to about `target_triangles`, without measuring the deviation."""
    vertices, faces = fast_simplification.simplify(
        np.array(mesh.vertices), np.array(mesh.faces), target_count=target_triangles, agg=_AGGRESSIVENESS
    )
    return clean(TriangleMesh(vertices.astype(np.float64), faces.astype(np.int32)), 1).mesh


def within(
    original: TriangleMesh,
    thinned: TriangleMesh,
    tolerance_mm: float,
    tell: Callable[[float], None] = lambda share: None,
) -> ThinnedSurface:
    """Restore those triangles of the original that the decimated surface left too far away.

    Afterwards every vertex of the original lies within `tolerance_mm` of the surface, and every point of its triangles
    within `certified_mm`, which is at most 1.5 times that. Restored triangles keep their orientation; if there are any,
    the surface is open.

    Args:
        original: the source of the decimated surface, or the surface that it replaces.
        tell: called with the completed fraction.
    """
    tree = ProximityTree(thinned)
    distance, _, nearest = tree.point_distance(original.vertices)
    tell(0.2)
    back = (distance > tolerance_mm)[original.faces].any(axis=1)
    bound = np.zeros(len(original.faces))
    rest = np.flatnonzero(~back)
    for start in range(0, len(rest), _CHUNK):
        part = original.faces[rest[start : start + _CHUNK]]
        bound[rest[start : start + _CHUNK]] = bound_over(
            original.vertices[part], tree, _CERTIFIED_SHARE * tolerance_mm, nearest[part]
        )
        tell(0.2 + 0.6 * start / len(rest))
    back |= bound > _CERTIFIED_SHARE * tolerance_mm
    joined = _joined(thinned, original, back) if back.any() else thinned
    there, reverse = _deviations(original, joined)
    certified = float(bound[~back].max(initial=0.0))
    return ThinnedSurface(
        joined, max(there[0], reverse[0]), max(there[1], reverse[1]), certified, int(back.sum())
    )  # fmt: skip


def bound_over(
    triangles: Array, tree: ProximityTree, enough_mm: float, candidates: npt.NDArray[np.int32] | None = None
) -> Array:
    """Upper bounds (n,) [mm] of the distance of every point of triangles (n, 3, 3) to the mesh of a tree.

    A triangle whose bound exceeds `enough_mm` is subdivided into four, a limited number of times; its bound is then the
    largest of its parts.

    candidates: (n, m) faces of the mesh that may be nearest; None: those nearest to the corners are searched.
    """
    if candidates is None:
        candidates = tree.point_distance(triangles.reshape(-1, 3))[2].reshape(-1, 3)
    bound, candidates = _convex_bound(triangles, candidates, tree, enough_mm)
    settled = np.where(bound > enough_mm, 0.0, bound)  # over the parts that need no further subdivision
    owner = np.flatnonzero(bound > enough_mm)
    parts, candidates = triangles[owner], candidates[owner]
    for _ in range(_SPLITS):
        parts, owner = quarters(parts), np.repeat(owner, 4)
        of_parts, candidates = _convex_bound(parts, np.repeat(candidates, 4, axis=0), tree, enough_mm)
        enough = of_parts <= enough_mm
        np.maximum.at(settled, owner[enough], of_parts[enough])
        worst = settled.copy()
        np.maximum.at(worst, owner[~enough], of_parts[~enough])
        bound = np.where(bound > enough_mm, np.minimum(bound, worst), bound)
        parts, owner, candidates = parts[~enough], owner[~enough], candidates[~enough]
        if not len(owner):
            break
    return bound


def _convex_bound(
    triangles: Array, candidates: npt.NDArray[np.int32], tree: ProximityTree, enough_mm: float
) -> tuple[Array, npt.NDArray[np.int32]]:
    """Bounds (n,), and the candidates (n, m + 1) with the face nearest to each triangle's centroid appended."""
    middle = tree.point_distance(triangles.mean(axis=1))[2]
    more = np.column_stack([middle, candidates]).astype(np.int32)
    return convex_bounds(triangles, more, tree.mesh.vertices, tree.mesh.faces, enough_mm), more


def _joined(thinned: TriangleMesh, original: TriangleMesh, back: BoolArray) -> TriangleMesh:
    vertices, faces = compact(original.vertices, original.faces[back])
    return TriangleMesh(
        np.concatenate([thinned.vertices, vertices]), np.concatenate([thinned.faces, faces + len(thinned.vertices)])
    )


def _deviations(
    a: TriangleMesh, b: TriangleMesh, tell: Callable[[float], None] = lambda share: None
) -> tuple[tuple[float, float], tuple[float, float]]:
    """(mean, largest) distance of the vertices of each to the triangles of the other: of a's to b, of b's to a."""
    there = ProximityTree(b).point_distance(a.vertices)[0]
    tell(len(a.vertices) / (len(a.vertices) + len(b.vertices) + len(a.faces) / 4.0))  # building a's tree takes time too
    back = ProximityTree(a).point_distance(b.vertices)[0]
    return (float(there.mean()), float(there.max())), (float(back.mean()), float(back.max()))
