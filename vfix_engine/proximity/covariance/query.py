"""Queries of the covariance tree (Li 2007, section III.D, eq. 8), compiled."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Int32Array
from ...geometry.triangle_kernels import segment_point, segment_triangle
from ...kernels.compiled import compiled
from ..rows_kernel import fits, widened, write_row
from .box_kernel import segment_box
from .build import STACK


@compiled
def node_gap(frame: Array, box: Array, p: Array, d: Array, lp: Array, ld: Array) -> tuple[float, float]:
    """Squared distance from the segment to the node's box and its t; lp, ld get the segment in the node's frame."""
    for k in range(3):  # (8)
        lp[k] = (
            frame[k, 0] * (p[0] - frame[3, 0]) + frame[k, 1] * (p[1] - frame[3, 1]) + frame[k, 2] * (p[2] - frame[3, 2])
        )
        ld[k] = frame[k, 0] * d[0] + frame[k, 1] * d[1] + frame[k, 2] * d[2]
    return segment_box(lp, ld, box)


@compiled
def group_row(
    frame: Array, box: Array, lp: Array, ld: Array, t: float, gap: float, segment: int, p: Array, d: Array,
    radius: float, row: Array, label: Int32Array,
) -> None:  # fmt: skip
    """The pair between the segment and a node's box as one row."""
    distance = np.sqrt(gap)
    label[0], label[1] = segment, -1
    row[0] = distance - radius
    for i in range(3):
        row[4 + i] = p[i] + t * d[i]
        row[7 + i] = frame[3, i]
    for k in range(3):
        inside = min(max(lp[k] + t * ld[k], box[0, k]), box[1, k])
        for i in range(3):
            row[7 + i] += frame[k, i] * inside
    for i in range(3):
        row[1 + i] = (row[4 + i] - row[7 + i]) / distance


@compiled
def tree_pairs(
    frame: Array, box: Array, child: Int32Array, first: Int32Array, last: Int32Array, order: Int32Array,
    corners: Array, spheres: Array, normals: Array, start: Array, end: Array, radius: Array,
    threshold: float, flat: float, exact_within: float,
) -> tuple[Array, Int32Array]:  # fmt: skip
    """All pairs with distance − radius ≤ threshold as rows (see ``pairs_from_rows``).

    Nodes no thicker than ``flat`` and farther than ``exact_within``, in mm, give one pair on their box instead.
    """
    rows, labels = np.empty((256, 10)), np.empty((256, 2), np.int32)
    found = 0
    stack, lp, ld = np.empty(STACK, np.int32), np.empty(3), np.empty(3)
    for segment in range(len(radius)):
        p, d = start[segment], end[segment] - start[segment]
        dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        limit = threshold + radius[segment]
        if limit < 0.0:
            continue
        top = 1
        stack[0] = 0
        while top > 0:
            top -= 1
            node = stack[top]
            gap, t = node_gap(frame[node], box[node], p, d, lp, ld)
            if gap > limit * limit:
                continue
            if child[node] >= 0:
                thick = box[node, 1, 2] - box[node, 0, 2]
                if thick <= flat and gap > 0.0 and np.sqrt(gap) - radius[segment] > exact_within:
                    if found == len(rows):
                        rows, labels = widened(rows, labels)
                    group_row(
                        frame[node], box[node], lp, ld, t, gap, segment, p, d, radius[segment],
                        rows[found], labels[found],
                    )  # fmt: skip
                    found += 1
                else:
                    stack[top], stack[top + 1] = child[node] + 1, child[node]
                    top += 2
                continue
            for place in range(first[node], last[node]):
                if fits(p, d, dd, spheres[place], limit):
                    if found == len(rows):
                        rows, labels = widened(rows, labels)
                    if write_row(p, d, radius[segment], limit, corners[place], normals[place], rows[found]):
                        labels[found, 0], labels[found, 1] = segment, order[place]
                        found += 1
    return rows[:found].copy(), labels[:found].copy()


@compiled
def tree_nearest(
    frame: Array, box: Array, child: Int32Array, first: Int32Array, last: Int32Array, corners: Array, spheres: Array,
    p: Array, d: Array, bound: float,
) -> tuple[float, int]:  # fmt: skip
    """Nearest triangle to one axis segment: (squared distance, place); (bound², −1) when none is nearer than bound."""
    stack, lp, ld = np.empty(STACK, np.int32), np.empty(3), np.empty(3)
    gaps = np.empty(STACK)
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    best, where = bound * bound, -1
    top = 1
    stack[0], gaps[0] = 0, 0.0
    while top > 0:
        top -= 1
        node = stack[top]
        if gaps[top] >= best:
            continue
        if child[node] >= 0:
            one = child[node]
            gap, _ = node_gap(frame[one], box[one], p, d, lp, ld)
            other_gap, _ = node_gap(frame[one + 1], box[one + 1], p, d, lp, ld)
            nearer = gap <= other_gap
            # The nearer child is searched first, so that the bound shrinks early.
            stack[top], gaps[top] = (one + 1, other_gap) if nearer else (one, gap)
            stack[top + 1], gaps[top + 1] = (one, gap) if nearer else (one + 1, other_gap)
            top += 2
            continue
        for place in range(first[node], last[node]):
            reach = np.sqrt(best) + spheres[place, 3]
            if (
                segment_point(
                    p[0], p[1], p[2], d[0], d[1], d[2], dd, spheres[place, 0], spheres[place, 1], spheres[place, 2]
                )
                <= reach * reach
            ):
                c = corners[place]
                near = segment_triangle(
                    p[0], p[1], p[2], d[0], d[1], d[2], c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
                )[0]
                if near < best:
                    best, where = near, place
    return best, where


@compiled
def tree_points(
    frame: Array, box: Array, child: Int32Array, first: Int32Array, last: Int32Array, order: Int32Array,
    corners: Array, spheres: Array, points: Array,
) -> tuple[Array, Array, Int32Array]:  # fmt: skip
    """Distance (n,), closest point (n, 3) and triangle (n,) of each point (n, 3)."""
    count = len(points)
    distance, closest, triangle = np.empty(count), np.empty((count, 3)), np.empty(count, np.int32)
    still = np.zeros(3)
    for i in range(count):
        q = points[i]
        near, place = tree_nearest(frame, box, child, first, last, corners, spheres, q, still, np.inf)
        c = corners[place]
        _, _, x, y, z, _ = segment_triangle(
            q[0], q[1], q[2], 0.0, 0.0, 0.0, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
        )
        distance[i], triangle[i] = np.sqrt(near), order[place]
        closest[i, 0], closest[i, 1], closest[i, 2] = x, y, z
    return distance, closest, triangle
