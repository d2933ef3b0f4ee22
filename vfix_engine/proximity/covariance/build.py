"""Construction of the covariance tree (Li 2007, section III.D, eq. 6-7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Int32Array
from ...kernels.compiled import compiled

STACK = 160  # entries of a traversal stack: a branch has at most _DEEPEST levels plus the bisections below them
_DEEPEST = 96


class TreeNodes(NamedTuple):
    """The tree as arrays, children behind their parents.

    frame: (N, 4, 3): rows 0-2 the axes of the local frame (largest variance first), row 3 its origin.
    box: (N, 2, 3) lowest and highest corner in that frame, inflated by the largest sphere (eq. 7), mm.
    child: (N,) first of the two children, −1 for a leaf.
    first, last: (N,) the node's range in ``order``.
    order: (F,) triangle of the mesh at each place.
    """

    frame: Array
    box: Array
    child: Int32Array
    first: Int32Array
    last: Int32Array
    order: Int32Array


@compiled
def principal_axes(m: Array, axes: Array) -> None:
    """Write the eigenvectors of the symmetric matrix m (3, 3) into the rows of ``axes``, largest eigenvalue first.

    Jacobi rotations: the result is orthonormal also for repeated or zero eigenvalues. Overwrites m.
    """
    for i in range(3):
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = m[0, 1] ** 2 + m[0, 2] ** 2 + m[1, 2] ** 2
        if off <= 1e-24 * (m[0, 0] ** 2 + m[1, 1] ** 2 + m[2, 2] ** 2):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if m[p, q] != 0.0:
                    theta = 0.5 * (m[q, q] - m[p, p]) / m[p, q]
                    t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + np.sqrt(theta * theta + 1.0))
                    c = 1.0 / np.sqrt(t * t + 1.0)
                    s = t * c
                    for k in range(3):
                        a, b = m[k, p], m[k, q]
                        m[k, p], m[k, q] = c * a - s * b, s * a + c * b
                    for k in range(3):
                        a, b = m[p, k], m[q, k]
                        m[p, k], m[q, k] = c * a - s * b, s * a + c * b
                        a, b = axes[p, k], axes[q, k]
                        axes[p, k], axes[q, k] = c * a - s * b, s * a + c * b
    for i in range(2):
        for j in range(2 - i):
            if m[j, j] < m[j + 1, j + 1]:
                m[j, j], m[j + 1, j + 1] = m[j + 1, j + 1], m[j, j]
                for k in range(3):
                    axes[j, k], axes[j + 1, k] = axes[j + 1, k], axes[j, k]


@compiled
def _place(centres: Array, radii: Array, members: Int32Array, frame: Array, box: Array, along: Array) -> None:
    """Write frame and box of the members; ``along`` gets their first local coordinate."""
    count = len(members)
    frame[3, :] = 0.0
    for i in range(count):
        for k in range(3):
            frame[3, k] += centres[members[i], k]
    frame[3, :] /= count
    moments = np.zeros((3, 3))
    for i in range(count):  # (6)
        x = centres[members[i], 0] - frame[3, 0]
        y = centres[members[i], 1] - frame[3, 1]
        z = centres[members[i], 2] - frame[3, 2]
        moments[0, 0] += x * x
        moments[0, 1] += x * y
        moments[0, 2] += x * z
        moments[1, 1] += y * y
        moments[1, 2] += y * z
        moments[2, 2] += z * z
    moments[1, 0], moments[2, 0], moments[2, 1] = moments[0, 1], moments[0, 2], moments[1, 2]
    principal_axes(moments, frame)
    box[0, :], box[1, :] = np.inf, -np.inf
    r_max, far = 0.0, 0.0
    for i in range(count):
        x = centres[members[i], 0] - frame[3, 0]
        y = centres[members[i], 1] - frame[3, 1]
        z = centres[members[i], 2] - frame[3, 2]
        for k in range(3):
            local = frame[k, 0] * x + frame[k, 1] * y + frame[k, 2] * z
            box[0, k], box[1, k] = min(box[0, k], local), max(box[1, k], local)
            if k == 0:
                along[i] = local
        r_max = max(r_max, radii[members[i]])
        far = max(far, abs(centres[members[i], 0]), abs(centres[members[i], 1]), abs(centres[members[i], 2]))
    # Enlarged by the rounding of coordinates and frame, so that no triangle lies outside its box.
    r_max += 1e-12 * (far + r_max)
    box[0, :] -= r_max  # (7)
    box[1, :] += r_max


@compiled
def _split(members: Int32Array, along: Array, spare: Int32Array, halve: bool) -> int:
    """Partition the members at x = 0 of the centroid's frame; return the size of the first part.

    Members with equal centres are halved by their order, so that the recursion ends.
    """
    count = len(members)
    low, high = 0, 0
    for i in range(count):
        if along[i] < 0.0:
            members[low] = members[i]
            low += 1
        else:
            spare[high] = members[i]
            high += 1
    for i in range(high):
        members[low + i] = spare[i]
    if halve or low == 0 or high == 0:
        return count // 2
    return low


@compiled
def build(
    centres: Array, radii: Array, leaf_size: int
) -> tuple[Array, Array, Int32Array, Int32Array, Int32Array, Int32Array]:
    """Nodes of the tree over sphere centres (F, 3) with radii (F,); the fields of ``TreeNodes``."""
    count = len(centres)
    capacity = 2 * count
    frame, box = np.empty((capacity, 4, 3)), np.empty((capacity, 2, 3))
    child, first, last = np.full(capacity, -1, np.int32), np.empty(capacity, np.int32), np.empty(capacity, np.int32)
    depth = np.zeros(capacity, np.int32)
    order = np.arange(count).astype(np.int32)
    spare, along = np.empty(count, np.int32), np.empty(count)
    first[0], last[0] = 0, count
    done, made = 0, 1
    while done < made:
        members = order[first[done] : last[done]]
        _place(centres, radii, members, frame[done], box[done], along)
        if len(members) > leaf_size:
            low = _split(members, along, spare, depth[done] > _DEEPEST)
            child[done] = made
            first[made], last[made] = first[done], first[done] + low
            first[made + 1], last[made + 1] = first[done] + low, last[done]
            depth[made] = depth[made + 1] = depth[done] + 1
            made += 2
        done += 1
    return frame[:made].copy(), box[:made].copy(), child[:made].copy(), first[:made].copy(), last[:made].copy(), order
