"""Lower bounds of the distances between one segment and 16 boxes or triangles, in single precision.

A node holds 16 boxes as 6 × 16 float32: x, y and z of the centres, then of the half extents, relative to an origin.

Facets are triangles rounded to ten bits per coordinate, 8 float32 and 3 × 16 int32 per block. The int32 hold, for each
triangle, its centroid and two corners relative to it, three coordinates in one number. The float32 are: origin (3) and
span of the centroids, span of the corners, largest rounding error of a corner, largest distance of a corner from its
centroid, and one unused.

The bound is the gap along the direction g from the segment's nearest point to the centre: |g| minus the support of the
box or triangle along g. The rounding errors of facets and of the computation are subtracted, so that a bound never
exceeds the distance.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Float32Array, Int32Array
from ..kernels.compiled import inlined, no_refcount, vectorised

NODE = 96  # numbers in a node
FACETS = 56  # numbers in a block's facets
HEADER = 8  # of them before the triangles
PROBE = 12  # constants of a segment: p relative to the origin, d, d / d·d, rounding allowance

_INFINITY_BITS = np.int32(0x7F800000)  # the bits of infinity
_ZERO = np.float32(0.0)
_ONE = np.float32(1.0)
# Rounding allowance, relative to the largest coordinate: larger than the about 40 roundings of 2⁻²⁴ of a bound.
_ROUNDING = 1e-5
_ROTATION_SHARE = np.float32(0.125)  # of that allowance, for the rounding of the vector from the axis to a centroid
_HALF = np.float32(1.5)
_TEN = np.int32(0x7FE000)  # the upper ten bits of the mantissa of a float32
_FROM_ONE = np.int32(0x3F800000)  # the bits of 1
FARTHEST = 1e15  # mm


@no_refcount
def describe_single(p: Array, d: Array, frame: Array, probe: Float32Array) -> None:
    """Write the constants (PROBE,) of the segment p + t·d; frame (4,): origin of the boxes, largest coordinate."""
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    share = 1.0 / dd if dd > 1e-30 else 0.0
    far = frame[3]
    for k in range(3):
        probe[k] = p[k] - frame[k]
        probe[3 + k] = d[k]
        probe[6 + k] = d[k] * share
        far += abs(p[k] - frame[k]) + abs(d[k])
    # If squaring a coordinate overflows float32, the allowance is infinite and nothing is rejected.
    probe[9] = _ROUNDING * far if far < FARTHEST else np.inf


@vectorised
def box_gaps(node: Float32Array, probe: Float32Array, gaps: Float32Array) -> None:
    """Lower bounds (16,) in mm of the distances from the segment's axis to 16 boxes; negative where they touch.

    A bound may be NaN: reject a box only where its bound compares as greater than a limit.
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
    """The three coordinates in [1, 2) of a facet's word, ten bits of mantissa each."""
    x = np.int32(((word << 1) & _TEN) | _FROM_ONE).view(np.float32)
    y = np.int32(((word << 11) & _TEN) | _FROM_ONE).view(np.float32)
    z = np.int32(((word >> 9) & _TEN) | _FROM_ONE).view(np.float32)
    return x, y, z


@vectorised
def facet_gaps(facets: Int32Array, probe: Float32Array, limit: np.float32, gaps: Float32Array) -> int:
    """Write lower bounds (16,) of the distances from the axis to 16 triangles; return how many are above ``limit``.

    The vector from the axis to a centroid is perpendicular to the axis up to rounding. Rounding rotates a short vector
    more; the effect on the farthest corner is subtracted.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    origin = facets[:HEADER].view(np.float32)
    ox, oy, oz, span, corner = origin[0] - px, origin[1] - py, origin[2] - pz, origin[3], origin[4]
    off, rotation = slack + origin[5], slack * _ROTATION_SHARE * origin[6]
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
        support = corner * min(min(one, two), -(one + two)) - rotation
        gaps[j] = size + support / (size if size > _ZERO else _ONE) - off
    over = 0
    for j in range(16):  # a separate loop: a 64-bit counter halves the lanes
        over += int(gaps[j] > limit)
    return over


@vectorised
def facet_bounds(facets: Int32Array, probe: Float32Array) -> tuple[np.float32, np.float32]:
    """Lower and upper bound of the smallest distance from the segment's axis to 16 triangles.

    The distance of a centroid is an upper bound of that of its triangle.
    """
    px, py, pz, dx, dy, dz = probe[0], probe[1], probe[2], probe[3], probe[4], probe[5]
    hx, hy, hz, slack = probe[6], probe[7], probe[8], probe[9]
    origin = facets[:HEADER].view(np.float32)
    ox, oy, oz, span, corner = origin[0] - px, origin[1] - py, origin[2] - pz, origin[3], origin[4]
    off, rotation = slack + origin[5], slack * _ROTATION_SHARE * origin[6]
    low, high = _INFINITY_BITS, _INFINITY_BITS
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
        support = corner * min(min(one, two), -(one + two)) - rotation
        gap = size + support / (size if size > _ZERO else _ONE)
        # The bits of non-negative floats are ordered like the floats, and an integer minimum is vectorised.
        low = min(low, np.float32(max(gap, _ZERO)).view(np.int32))
        high = min(high, np.float32(size).view(np.int32))
    return np.int32(low).view(np.float32) - off, np.int32(high).view(np.float32) + off
