"""Slow oracles: exact arithmetic for one pair, every triangle in turn for a mesh."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations

import numpy as np

from vfix_engine.geometry.compiled import compiled
from vfix_engine.geometry.triangle_kernels import segment_triangle

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


@compiled
def _every(start: np.ndarray, end: np.ndarray, corners: np.ndarray, out: np.ndarray) -> None:
    for s in range(len(start)):
        p, d = start[s], end[s] - start[s]
        for f in range(len(corners)):
            c = corners[f]
            gap = segment_triangle(
                p[0], p[1], p[2], d[0], d[1], d[2], c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
            )[0]
            out[s, f] = np.sqrt(gap)


def every_distance(p: np.ndarray, q: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distances (F,) of one segment to all triangles, or (S, F) of segments (S, 3); none left out."""
    start, end = np.atleast_2d(p).astype(float), np.atleast_2d(q).astype(float)
    out = np.empty((len(start), len(triangles)))
    _every(start, end, np.ascontiguousarray(triangles.reshape(-1, 9)), out)
    return out if np.ndim(p) == 2 else out[0]
