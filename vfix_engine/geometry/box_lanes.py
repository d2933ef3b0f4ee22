"""Lower bounds of the distances from one segment to 16 boxes or triangles at once: single precision, never too large.

Boxes lie as a node: 6 × 16 float32, all x of the centres, y, z, then half extents; relative to a frame's origin.
Facets are triangles rounded to ten bits: eight float32 of the block, then 3 × 16 int32, for each triangle its middle
and two of its corners from there, x, y and z in one number each. The eight are origin (3) and span of the middles, span
of the corners, how far a rounded corner is off at most, how far it is from its middle at most, and one not used.
What a corner is off widens the bounds.
The direction from the segment's nearest point to the centre separates the two at least as far as the support of the
box or triangle along it allows; what rounding may have added is taken off again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compiled import borrowing, inlined, vectorised

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Words = NDArray[np.int32]

NODE = 96  # numbers in a node
FACETS = 56  # numbers in a block's facets
HEADER = 8  # of them before the triangles
PROBE = 12  # numbers that describe a segment: p from the origin, d, d / d·d, slack

_MOST = np.int32(0x7F800000)  # the bits of infinity
_ZERO = np.float32(0.0)
_ONE = np.float32(1.0)
# Of the largest coordinate: more than all roundings of the bound together (about 40 of 2⁻²⁴ each).
_ROUNDING = 1e-5
_TURNED = np.float32(0.125)  # of that slack: more than the roundings of the vector from the axis to a middle
_HALF = np.float32(1.5)
_TEN = np.int32(0x7FE000)  # the upper ten bits behind the point of a float32
_FROM_ONE = np.int32(0x3F800000)  # the bits of 1
FARTHEST = 1e15  # mm


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
    # Beyond the range in which float32 can square a coordinate values cannot be distinguished and nothing is left out.
    probe[9] = _ROUNDING * far if far < FARTHEST else np.inf


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


@inlined
def unpacked(word: int) -> tuple[np.float32, np.float32, np.float32]:
    """The three numbers in [1, 2) of a facet's word: ten bits each are put behind the point of a 1."""
    x = np.int32(((word << 1) & _TEN) | _FROM_ONE).view(np.float32)
    y = np.int32(((word << 11) & _TEN) | _FROM_ONE).view(np.float32)
    z = np.int32(((word >> 9) & _TEN) | _FROM_ONE).view(np.float32)
    return x, y, z


@vectorised
def facet_gaps(facets: Words, probe: Single, limit: np.float32, gaps: Single) -> int:
    """Lower bounds (16,) of the distances from the axis to 16 triangles; how many are over ``limit``.

    The vector from the axis to a triangle's middle is across the axis but for its rounding, which turns it the more the
    shorter it is: that is what is taken off for the farthest corner.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    origin = facets[:HEADER].view(np.float32)
    ox, oy, oz, span, corner = origin[0] - px, origin[1] - py, origin[2] - pz, origin[3], origin[4]
    off, turned = slack + origin[5], slack * _TURNED * origin[6]
    for j in range(16):
        mx, my, mz = unpacked(facets[8 + j])
        gx, gy, gz = ox + span * mx, oy + span * my, oz + span * mz
        t = gx * hx + gy * hy + gz * hz
        t = min(max(t, _ZERO), _ONE)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        ax, ay, az = unpacked(facets[24 + j])
        bx, by, bz = unpacked(facets[40 + j])
        half = _HALF * (gx + gy + gz)
        one, two = gx * ax + gy * ay + gz * az - half, gx * bx + gy * by + gz * bz - half
        support = corner * min(min(one, two), -(one + two)) - turned
        gaps[j] = size + support / (size if size > _ZERO else _ONE) - off
    over = 0
    for j in range(16):  # a loop of its own: counting in 64 bits halves the lanes
        over += int(gaps[j] > limit)
    return over


@vectorised
def facet_bounds(facets: Words, probe: Single) -> tuple[np.float32, np.float32]:
    """Bounds of the least distance from the segment's axis to 16 triangles: never more, never less.

    No triangle is farther than its middle.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    origin = facets[:HEADER].view(np.float32)
    ox, oy, oz, span, corner = origin[0] - px, origin[1] - py, origin[2] - pz, origin[3], origin[4]
    off, turned = slack + origin[5], slack * _TURNED * origin[6]
    low, high = _MOST, _MOST
    for j in range(16):
        mx, my, mz = unpacked(facets[8 + j])
        gx, gy, gz = ox + span * mx, oy + span * my, oz + span * mz
        t = gx * hx + gy * hy + gz * hz
        t = min(max(t, _ZERO), _ONE)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        ax, ay, az = unpacked(facets[24 + j])
        bx, by, bz = unpacked(facets[40 + j])
        half = _HALF * (gx + gy + gz)
        one, two = gx * ax + gy * ay + gz * az - half, gx * bx + gy * by + gz * bz - half
        support = corner * min(min(one, two), -(one + two)) - turned
        gap = size + support / (size if size > _ZERO else _ONE)
        # Of numbers that are not negative the bits have the order of the numbers, and their least is found in lanes.
        low = min(low, np.float32(max(gap, _ZERO)).view(np.int32))
        high = min(high, np.float32(size).view(np.int32))
    return np.int32(low).view(np.float32) - off, np.int32(high).view(np.float32) + off
