"""Slow oracles: exact arithmetic for one pair, every triangle in turn for a mesh."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations

import numpy as np

from vfix_engine.geometry.triangle_kernels import segment_triangle
from vfix_engine.kernels.compiled import compiled

Vector = list[Fraction]


def _exact(values: np.ndarray) -> Vector:
    return [Fraction(float(v)) for v in values]


def _minus(a: Vector, b: Vector) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def _dot(a: Vector, b: Vector) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def _determinant(m: list[Vector]) -> Fraction:
    if not m:
        return Fraction(1)
    return sum(
        ((-1) ** j * m[0][j] * _determinant([row[:j] + row[j + 1 :] for row in m[1:]]) for j in range(len(m))),
        Fraction(0),
    )


def _least_squares(columns: list[Vector], target: Vector) -> list[Fraction] | None:
    """Exact solution of the normal equations; None when the columns depend on each other."""
    gram = [[_dot(a, b) for b in columns] for a in columns]
    whole = _determinant(gram)
    if whole == 0:
        return None
    right = [_dot(a, target) for a in columns]
    return [
        _determinant([[*row[:j], right[i], *row[j + 1 :]] for i, row in enumerate(gram)]) / whole
        for j in range(len(columns))
    ]


def exact_distance(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> float:
    """Distance of segment and triangle: the best of all their features, each solved in rational arithmetic."""
    ends, corners = [_exact(p), _exact(q)], [_exact(c) for c in triangle]
    best: Fraction | None = None
    for on_segment in ([0], [1], [0, 1]):
        for size in (1, 2, 3):
            for feature in combinations(range(3), size):
                base_s, base_t = ends[on_segment[0]], corners[feature[0]]
                columns = [_minus(ends[i], base_s) for i in on_segment[1:]]
                columns += [_minus(base_t, corners[i]) for i in feature[1:]]
                weights = _least_squares(columns, _minus(base_t, base_s))
                if weights is None:
                    continue
                split = len(on_segment) - 1
                if any(w < 0 for w in weights) or sum(weights[:split]) > 1 or sum(weights[split:]) > 1:
                    continue
                gap = _minus(base_s, base_t)
                for w, column in zip(weights, columns, strict=True):
                    gap = [g + w * c for g, c in zip(gap, column, strict=True)]
                squared = _dot(gap, gap)
                best = squared if best is None or squared < best else best
    assert best is not None
    return math.sqrt(best)


def kernel(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> tuple[float, float, np.ndarray, bool]:
    """The compiled kernel on arrays: (distance, t, point on the triangle, crossing)."""
    gap, t, x, y, z, crosses = segment_triangle(*p, *(q - p), *triangle.ravel())
    return math.sqrt(gap), t, np.array([x, y, z]), crosses


Point = tuple[float, float, float]


@compiled
def _dots(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _along(p: Point, t: float, d: Point) -> Point:
    """p + t d."""
    return p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2]


@compiled
def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _to_point(p: Point, d: Point, point: Point) -> float:
    """From a point to the segment from p along d, squared."""
    size, r = _dots(d, d), _along(point, -1.0, p)
    t = min(max(_dots(r, d) / size, 0.0), 1.0) if size > 0.0 else 0.0
    gap = _along(r, -t, d)
    return _dots(gap, gap)


@compiled
def _to_edge(p: Point, d: Point, a: Point, e: Point) -> float:
    """Between two segments, squared: the crossing of their lines, or an end of one of them."""
    best = min(_to_point(p, d, a), _to_point(p, d, _along(a, 1.0, e)))
    best = min(best, _to_point(a, e, p), _to_point(a, e, _along(p, 1.0, d)))
    r = _along(p, -1.0, a)
    dd, ee, de, dr, er = _dots(d, d), _dots(e, e), _dots(d, e), _dots(d, r), _dots(e, r)
    whole = dd * ee - de * de
    t, s = de * er - ee * dr, dd * er - de * dr
    if whole > 0.0 and 0.0 <= t <= whole and 0.0 <= s <= whole:
        gap = _along(_along(r, t / whole, d), -s / whole, e)
        best = min(best, _dots(gap, gap))
    return best


@compiled
def _over_face(point: Point, a: Point, b: Point, c: Point, normal: Point) -> bool:
    """Whether the foot of a point on the plane is in the triangle."""
    for v, w in ((a, b), (b, c), (c, a)):
        if _dots(_cross(_along(w, -1.0, v), _along(point, -1.0, v)), normal) < 0.0:
            return False
    return True


@compiled
def _to_triangle(p: Point, d: Point, a: Point, b: Point, c: Point) -> float:
    """By its edges, the feet of the segment's ends on its face, and where the segment crosses it."""
    ab, bc, ca = _along(b, -1.0, a), _along(c, -1.0, b), _along(a, -1.0, c)
    best = math.sqrt(min(_to_edge(p, d, a, ab), _to_edge(p, d, b, bc), _to_edge(p, d, c, ca)))
    normal = _cross(ab, _along(c, -1.0, a))
    size, climb = math.sqrt(_dots(normal, normal)), _dots(normal, d)
    if not size > 0.0:
        return best
    for point in (p, _along(p, 1.0, d)):
        if _over_face(point, a, b, c, normal):
            best = min(best, abs(_dots(_along(point, -1.0, a), normal)) / size)
    t = _dots(_along(a, -1.0, p), normal) / climb if climb != 0.0 else -1.0
    return 0.0 if 0.0 <= t <= 1.0 and _over_face(_along(p, t, d), a, b, c, normal) else best


@compiled
def _every(start: np.ndarray, end: np.ndarray, corners: np.ndarray, out: np.ndarray) -> None:
    for s in range(len(start)):
        p = start[s, 0], start[s, 1], start[s, 2]
        d = _along((end[s, 0], end[s, 1], end[s, 2]), -1.0, p)
        for f in range(len(corners)):
            k = corners[f]
            out[s, f] = _to_triangle(p, d, (k[0], k[1], k[2]), (k[3], k[4], k[5]), (k[6], k[7], k[8]))


def every_distance(p: np.ndarray, q: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distances (F,) of one segment to all triangles, or (S, F) of segments (S, 3); none left out.

    Compiled for its speed; it takes nothing from the kernels that it is to judge. A segment that is parallel to an edge
    but for 1e-7 is beyond it: there ``exact_distance`` judges.
    """
    start, end = np.atleast_2d(p).astype(float), np.atleast_2d(q).astype(float)
    out = np.empty((len(start), len(triangles)))
    _every(start, end, np.ascontiguousarray(triangles.reshape(-1, 9)), out)
    return out if np.ndim(p) == 2 else out[0]
