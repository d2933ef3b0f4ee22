"""Boxes along the principal axes of what they hold (Li 2007, eq. 6-7) and the grouped pairs from them, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES
from .compiled import borrowing
from .covariance.build import principal_axes

Array = NDArray[np.float64]
Single = NDArray[np.float32]


@borrowing
def moments(corners: Array, frame: Array, sums: Array) -> None:
    """Sums of a block's corners: how many, x, y, z, xx, xy, xz, yy, yz, zz about the frame's origin."""
    sums[:] = 0.0
    sums[0] = 3.0 * LANES
    for j in range(LANES):
        for c in range(3):
            x = corners[LANES * 3 * c + j] - frame[0]
            y = corners[LANES * (3 * c + 1) + j] - frame[1]
            z = corners[LANES * (3 * c + 2) + j] - frame[2]
            sums[1] += x
            sums[2] += y
            sums[3] += z
            sums[4] += x * x
            sums[5] += x * y
            sums[6] += x * z
            sums[7] += y * y
            sums[8] += y * z
            sums[9] += z * z


@borrowing
def axes_of(sums: Array, frame: Array, spread: Array, axes: Array) -> None:
    """Centroid and principal axes (Li 2007, eq. 6) of what was summed."""
    x, y, z = sums[1] / sums[0], sums[2] / sums[0], sums[3] / sums[0]
    axes[3, 0], axes[3, 1], axes[3, 2] = frame[0] + x, frame[1] + y, frame[2] + z
    spread[0, 0], spread[1, 1], spread[2, 2] = sums[4] - x * sums[1], sums[7] - y * sums[2], sums[9] - z * sums[3]
    spread[0, 1] = spread[1, 0] = sums[5] - x * sums[2]
    spread[0, 2] = spread[2, 0] = sums[6] - x * sums[3]
    spread[1, 2] = spread[2, 1] = sums[8] - y * sums[3]
    principal_axes(spread, axes)


@borrowing
def extents(corners: Array, axes: Array, slab: Array) -> None:
    """Box of some blocks in a local frame (Li 2007, eq. 7, of the corners themselves)."""
    for k in range(3):
        ex, ey, ez = axes[k, 0], axes[k, 1], axes[k, 2]
        low, high = np.inf, -np.inf
        for b in range(len(corners) // CORNERS):
            for c in range(3):
                at = CORNERS * b + LANES * 3 * c
                for j in range(at, at + LANES):
                    x = corners[j] - axes[3, 0]
                    y = corners[j + LANES] - axes[3, 1]
                    z = corners[j + 2 * LANES] - axes[3, 2]
                    local = ex * x + ey * y + ez * z
                    low, high = min(low, local), max(high, local)
        slab[0, k], slab[1, k] = low, high


@borrowing
def put_shell(axes: Array, slab: Array, frame: Array, lane: int, shell: Single) -> None:
    for k in range(3):
        centre = axes[3, k] - frame[k]
        for i in range(3):
            centre += axes[i, k] * 0.5 * (slab[0, i] + slab[1, i])
            shell[LANES * (3 + 3 * k + i) + lane] = axes[k, i]
        shell[LANES * k + lane] = centre
        # Grown by what float32 may lose of the centre and of the axes.
        half = 0.5 * (slab[1, k] - slab[0, k])
        shell[LANES * (12 + k) + lane] = half * 1.000001 + 1e-6 * frame[3]


@borrowing
def group_row(shell: Single, lane: int, query: Array, probe: Single, frame: Array, radius: float, row: Array) -> None:
    """The pair of the segment's point nearest to a box's centre and the plane across the way there, before the box."""
    x = shell[lane] + frame[0] - query[0]
    y = shell[LANES + lane] + frame[1] - query[1]
    z = shell[2 * LANES + lane] + frame[2] - query[2]
    t = min(max(query[15] + x * query[12] + y * query[13] + z * query[14], 0.0), 1.0)
    x, y, z = t * query[3] - x, t * query[4] - y, t * query[5] - z
    size = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    gap = size - probe[9]
    for i in range(3):
        along = x * shell[LANES * (3 + 3 * i) + lane]
        along += y * shell[LANES * (4 + 3 * i) + lane] + z * shell[LANES * (5 + 3 * i) + lane]
        gap -= abs(along) * shell[LANES * (12 + i) + lane]
    row[0], row[1], row[2], row[3] = gap - radius, x, y, z
    row[4], row[5], row[6] = query[0] + t * query[3], query[1] + t * query[4], query[2] + t * query[5]
    row[7], row[8], row[9] = row[4] - gap * x, row[5] - gap * y, row[6] - gap * z
