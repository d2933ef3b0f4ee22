"""Lower bounds of the distances from one segment to 16 boxes or triangles at once: single precision, never too large.

Boxes lie as a node: 6 × 16 float32, all x of the centres, y, z, then half extents; relative to a frame's origin.
Shells are boxes along axes of their own: 15 × 16 float32, centres, three axes, half extents.
Facets lie as 10 × 16 float32: a triangle's middle, two of its corners from there, how far the farthest corner is.
The direction from the segment's nearest point to the centre separates the two at least as far as the support of the
box or triangle along it leaves room; what rounding may have added is taken off again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compiled import borrowing, vectorised

Array = NDArray[np.float64]
Single = NDArray[np.float32]

NODE = 96  # numbers in a node
SHELL = 240  # numbers in a node's shells
FACETS = 160  # numbers in a block's facets
PROBE = 12  # numbers that describe a segment: p from the origin, d, d / d·d, slack

_MOST = np.int32(0x7F800000)  # the bits of infinity
_ZERO = np.float32(0.0)
_ONE = np.float32(1.0)
# Of the largest coordinate: more than all roundings of the bound together (about 40 of 2⁻²⁴ each).
_ROUNDING = 1e-5
_TURNED = np.float32(0.125)  # of that slack: more than the roundings of the way from the axis to a middle
_FARTHEST = 1e15


@borrowing
def describe_single(p: Array, d: Array, frame: Array, probe: Single) -> None:
    """The numbers of the segment p + t·d for ``box_gaps``; frame (4,): the boxes' origin, their largest coordinate."""
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    share = 1.0 / dd if dd > 1e-30 else 0.0
    far = frame[3]
    for k in range(3):
        probe[k] = p[k] - frame[k]
        probe[3 + k] = d[k]
        probe[6 + k] = d[k] * share
        far += abs(p[k] - frame[k]) + abs(d[k])
    # Beyond the range in which float32 can square a coordinate nothing is told apart and nothing left out.
    probe[9] = _ROUNDING * far if far < _FARTHEST else np.inf


@vectorised
def box_gaps(node: Single, probe: Single, gaps: Single) -> None:
    """Lower bounds in mm of the distances from the segment's axis to 16 boxes, negative where they touch.

    A bound may be NaN where nothing can be said: leave a box out only if its bound is greater than something.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    for j in range(16):
        gx, gy, gz = node[j] - px, node[16 + j] - py, node[32 + j] - pz
        t = gx * hx + gy * hy + gz * hz
        t = min(max(t, _ZERO), _ONE)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        support = abs(gx) * node[48 + j] + abs(gy) * node[64 + j] + abs(gz) * node[80 + j]
        gap = size - support / (size if size > _ZERO else _ONE)
        gaps[j] = (gap if gap > _ZERO else _ZERO) - slack


@vectorised
def shell_gaps(shell: Single, probe: Single, gaps: Single) -> None:
    """As ``box_gaps`` for boxes along their own axes."""
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    for j in range(16):
        gx, gy, gz = shell[j] - px, shell[16 + j] - py, shell[32 + j] - pz
        t = gx * hx + gy * hy + gz * hz
        t = min(max(t, _ZERO), _ONE)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        support = abs(gx * shell[48 + j] + gy * shell[64 + j] + gz * shell[80 + j]) * shell[192 + j]
        support += abs(gx * shell[96 + j] + gy * shell[112 + j] + gz * shell[128 + j]) * shell[208 + j]
        support += abs(gx * shell[144 + j] + gy * shell[160 + j] + gz * shell[176 + j]) * shell[224 + j]
        gap = size - support / (size if size > _ZERO else _ONE)
        gaps[j] = (gap if gap > _ZERO else _ZERO) - slack


@vectorised
def facet_gaps(facets: Single, probe: Single, limit: np.float32, gaps: Single) -> int:
    """Lower bounds (16,) of the distances from the axis to 16 triangles; how many are over ``limit``.

    The way from the axis to a triangle's middle is across the axis but for its rounding, which turns it the more the
    shorter it is: that is what is taken off for the farthest corner.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    turned = slack * _TURNED
    over = 0
    for j in range(16):
        gx, gy, gz = facets[j] - px, facets[16 + j] - py, facets[32 + j] - pz
        t = gx * hx + gy * hy + gz * hz
        t = min(max(t, _ZERO), _ONE)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        one = gx * facets[48 + j] + gy * facets[64 + j] + gz * facets[80 + j]
        two = gx * facets[96 + j] + gy * facets[112 + j] + gz * facets[128 + j]
        support = min(min(one, two), -(one + two)) - turned * facets[144 + j]
        gap = size + support / (size if size > _ZERO else _ONE) - slack
        gaps[j] = gap
        over += int(gap > limit)
    return over


@vectorised
def facet_bounds(facets: Single, probe: Single) -> tuple[np.float32, np.float32]:
    """Bounds of the least distance from the segment's axis to 16 triangles: never more, never less.

    No triangle is farther than its middle.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    turned = slack * _TURNED
    low, high = _MOST, _MOST
    for j in range(16):
        gx, gy, gz = facets[j] - px, facets[16 + j] - py, facets[32 + j] - pz
        t = gx * hx + gy * hy + gz * hz
        t = min(max(t, _ZERO), _ONE)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        one = gx * facets[48 + j] + gy * facets[64 + j] + gz * facets[80 + j]
        two = gx * facets[96 + j] + gy * facets[112 + j] + gz * facets[128 + j]
        support = min(min(one, two), -(one + two)) - turned * facets[144 + j]
        gap = size + support / (size if size > _ZERO else _ONE)
        # Of numbers that are not negative the bits have the order of the numbers, and their least is found in lanes.
        low = min(low, np.float32(max(gap, _ZERO)).view(np.int32))
        high = min(high, np.float32(size).view(np.int32))
    return np.int32(low).view(np.float32) - slack, np.int32(high).view(np.float32) + slack
