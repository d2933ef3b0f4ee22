"""Distances of many poses of a tool to bone and to soft tissue, from distance fields, compiled.

A field is two grids, a fine one within a coarse one; a point outside both is NaN.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..geometry.grid_value import grid_value
from ..kernels.compiled import nogil

BONE, TOUCHED, DEEPEST, DEPTH, UNKNOWN = range(5)  # columns of `pose_figures`


@nogil
def pose_figures(fine: Any, whole: Any, rotations: Any, positions: Any, ends: Any, radius: Any, step: float) -> Any:
    """Measure poses of a tool, (n, 5).

    BONE: smallest distance of its surface to bone in mm. TOUCHED: length of it whose surface is in tissue, DEEPEST: the
    largest depth, DEPTH: integral of the depth over the length in mm². UNKNOWN: 1 if the tool leaves the known space
    while it is in or next to tissue; air is extrapolated beyond the end of a scan.

    Args:
        fine, whole: (bone, tissue, origin, step) each, the values (K, J, I) in mm, positive outside.
        rotations: (n, 3, 3) and positions: (n, 3) of the tip.
        ends: (S, 2, 3) front and back of the tool's segments in the tip frame; radius: (S,).
        step: sample spacing along the tool in mm.
    """
    bone, tissue, origin, size = fine
    bone_whole, tissue_whole, origin_whole, size_whole = whole
    out = np.empty((len(positions), 5))
    for n in range(len(positions)):
        least, touched, deepest, depth, unknown = math.inf, 0.0, 0.0, 0.0, 0.0
        room = 0.0  # to tissue, at the last known point
        for s in range(len(radius)):
            fx, fy, fz = ends[s, 0, 0], ends[s, 0, 1], ends[s, 0, 2]
            bx, by, bz = ends[s, 1, 0] - fx, ends[s, 1, 1] - fy, ends[s, 1, 2] - fz
            length = math.sqrt(bx * bx + by * by + bz * bz)
            pieces = max(int(length / step), 1)
            r = rotations[n]
            for k in range(pieces + 1):
                share = k / pieces
                px, py, pz = fx + share * bx, fy + share * by, fz + share * bz
                x = positions[n, 0] + r[0, 0] * px + r[0, 1] * py + r[0, 2] * pz
                y = positions[n, 1] + r[1, 0] * px + r[1, 1] * py + r[1, 2] * pz
                z = positions[n, 2] + r[2, 0] * px + r[2, 1] * py + r[2, 2] * pz
                to_tissue = grid_value(tissue, origin, size, x, y, z)
                if to_tissue == to_tissue:
                    to_bone = grid_value(bone, origin, size, x, y, z)
                else:
                    to_tissue = grid_value(tissue_whole, origin_whole, size_whole, x, y, z)
                    to_bone = grid_value(bone_whole, origin_whole, size_whole, x, y, z)
                if to_tissue != to_tissue:  # NaN
                    if room < radius[s]:
                        unknown = 1.0
                    continue
                room = to_tissue
                least = min(least, to_bone - radius[s])
                inside = radius[s] - to_tissue
                if inside > 0.0:
                    weight = length / (pieces + 1)
                    touched += weight
                    deepest = max(deepest, inside)
                    depth += inside * weight
        out[n, 0], out[n, 1], out[n, 2], out[n, 3], out[n, 4] = least, touched, deepest, depth, unknown
    return out
