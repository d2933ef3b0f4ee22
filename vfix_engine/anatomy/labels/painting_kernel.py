"""Voxels swept by a brush along a line (compiled, single-threaded)."""

from __future__ import annotations

from math import ceil, floor, sqrt
from typing import Any

from vfix_engine.kernels.compiled import compiled, inlined

_PARALLEL = 1e-12  # [mm^2] squared step of a row across the line, below which the row is parallel to it


@inlined
def _row_span(c0: Any, c1: Any, c2: Any, d0: Any, d1: Any, d2: Any, square: float, first: int, last: int) -> Any:
    """Indices [first, last) of a row whose points c + i d can lie within sqrt(square) of the origin, plus one voxel."""
    a = d0 * d0 + d1 * d1 + d2 * d2
    b = c0 * d0 + c1 * d1 + c2 * d2
    if a <= _PARALLEL:
        return first, last
    under = b * b - a * (c0 * c0 + c1 * c1 + c2 * c2 - square)
    wide = sqrt(max(under, 0.0))
    low, high = floor((-b - wide) / a) - 1.0, ceil((-b + wide) / a) + 2.0
    if under < 0.0 and -under > 1e-6 * (b * b + a * square):
        return first, first
    return int(max(float(first), min(low, float(last)))), int(min(float(last), max(high, float(first))))


@inlined
def _across(x: float, y: float, z: float, w: Any, length: float) -> Any:
    """Component of a vector perpendicular to w."""
    if length <= 0.0:
        return x, y, z
    part = (x * w[0] + y * w[1] + z * w[2]) / length
    return x - part * w[0], y - part * w[1], z - part * w[2]


@compiled
def draw_line(
    mask: Any,
    affine: Any,
    start: Any,
    along: Any,
    normal: Any,
    half: float,
    disc: bool,
    square: float,
    low: Any,
    high: Any,
    value: bool,
) -> None:
    """Set the voxels of a mask (K, J, I) within the root of `square` [mm^2] of a line; for a disc, those of its layer.

    affine: (4, 4) from (i, j, k) to LPS mm. along: (3,) to the line's end, perpendicular to the normal for a disc.
    half: half of the layer's thickness. low, high: (3,) first indices i, j, k that may be set, and those after the
        last.
    """
    w0, w1, w2 = along[0], along[1], along[2]
    nx, ny, nz = normal[0], normal[1], normal[2]
    length = (w0 * w0 + w1 * w1) + w2 * w2
    step_away = affine[0, 0] * nx + affine[1, 0] * ny + affine[2, 0] * nz if disc else 0.0
    d0, d1, d2 = _across(
        affine[0, 0] - step_away * nx, affine[1, 0] - step_away * ny, affine[2, 0] - step_away * nz, along, length
    )
    for k in range(low[2], high[2]):
        for j in range(low[1], high[1]):
            x0 = affine[0, 1] * j + affine[0, 2] * k + affine[0, 3] - start[0]
            y0 = affine[1, 1] * j + affine[1, 2] * k + affine[1, 3] - start[1]
            z0 = affine[2, 1] * j + affine[2, 2] * k + affine[2, 3] - start[2]
            off = x0 * nx + y0 * ny + z0 * nz if disc else 0.0
            c0, c1, c2 = _across(x0 - off * nx, y0 - off * ny, z0 - off * nz, along, length)
            first, last = _row_span(c0, c1, c2, d0, d1, d2, square, low[0], high[0])
            for i in range(first, last):
                # In the order of the page's arithmetic, so that both round equally.
                x = ((affine[0, 0] * i + affine[0, 1] * j) + affine[0, 2] * k) + affine[0, 3] - start[0]
                y = ((affine[1, 0] * i + affine[1, 1] * j) + affine[1, 2] * k) + affine[1, 3] - start[1]
                z = ((affine[2, 0] * i + affine[2, 1] * j) + affine[2, 2] * k) + affine[2, 3] - start[2]
                if disc:
                    away = (x * nx + y * ny) + z * nz
                    if not (-half <= away < half):  # half-open, so that a plane between two layers selects one
                        continue
                    x, y, z = x - away * nx, y - away * ny, z - away * nz
                if length > 0.0:
                    part = min(1.0, max(0.0, ((x * w0 + y * w1) + z * w2) / length))
                    x, y, z = x - part * w0, y - part * w1, z - part * w2
                if (x * x + y * y) + z * z <= square:
                    mask[k, j, i] = value
