"""Voxels inside a lumen's surface, by the parity of crossings along lines, for each closed component.

A line enters or leaves at every crossing, so a voxel is inside if the number of crossings before it is odd. Lines run
along x, y and z, and two of the three decide: a defective triangle affects one line, not the lumen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from ...errors import InputError, PathwayError
from ...geometry.mesh import TriangleMesh
from ...kernels.compiled import compiled
from .voxel_pieces import add_piece, check_memory, closed_pieces

Voxels = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class VoxelLumen:
    """Voxels of a lumen, the first axis along x.

    inside: (X, Y, Z); origin: (3,) mm, centre of voxel (0, 0, 0) in the patient frame; voxel_mm: edge of a voxel.
    """

    inside: NDArray[np.bool_]
    origin: Array
    voxel_mm: float

    def place(self, voxels: ArrayLike) -> Array:
        """Centres (n, 3) in mm of voxels (n, 3)."""
        centres: Array = self.origin + self.voxel_mm * np.asarray(voxels, dtype=np.float64)
        return centres

    def depth(self) -> Array:
        """Distance (X, Y, Z) in mm from each voxel's centre to that of the nearest one outside; 0 outside."""
        from scipy.ndimage import distance_transform_edt  # imported here: slow to load

        depth: Array = distance_transform_edt(self.inside, sampling=self.voxel_mm)
        return depth


def voxels_of(mesh: TriangleMesh, voxel_mm: float) -> VoxelLumen:
    """Compute the inside of a surface, padded by two voxels outside.

    Raises:
        InputError: the edge is not a positive length, or the voxels would exceed the memory limit.
        PathwayError: the surface encloses no voxel.
    """
    if not (math.isfinite(voxel_mm) and voxel_mm > 0.0):
        raise InputError(f"a voxel's edge of {voxel_mm} mm: give a finite, positive length")
    low, high = mesh.bounds
    counts = np.ceil((high - low) / voxel_mm) + 4.0
    check_memory(float(np.prod(counts)), voxel_mm, high - low)
    shape = counts.astype(np.int64)
    origin: Array = low - 1.5 * voxel_mm
    corners = (mesh.triangles - origin) / voxel_mm
    inside = np.zeros(shape, dtype=np.bool_)
    for faces in closed_pieces(mesh):
        own = corners[faces]
        first = np.clip(np.floor(own.min(axis=(0, 1))).astype(np.int64) - 1, 0, shape - 1)
        last = np.clip(np.ceil(own.max(axis=(0, 1))).astype(np.int64) + 2, first + 1, shape)
        box = tuple(slice(*pair) for pair in zip(first, last, strict=True))
        add_piece(inside[box], by_parity(own - first, last - first))
    if not inside.any():
        raise PathwayError(f"the surface encloses no voxel of {voxel_mm:g} mm: is it closed, and in millimetres?")
    return VoxelLumen(inside, origin, voxel_mm)


def by_parity(corners: Array, shape: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mask of a box's voxels inside triangles with corners (F, 3, 3) in voxels; two of three directions decide."""
    votes = np.zeros(shape, dtype=np.uint8)
    for axis in range(3):
        order = ((axis + 1) % 3, (axis + 2) % 3, axis)
        turns = np.zeros(shape[list(order)], dtype=np.uint8)
        mark_crossings(np.ascontiguousarray(corners[:, :, order]), turns)
        np.bitwise_xor.accumulate(turns, axis=2, out=turns)
        votes += turns.transpose(np.argsort(order))
    inside: NDArray[np.bool_] = votes >= 2
    return inside


def piece_with(lumen: VoxelLumen, voxel: tuple[int, int, int]) -> VoxelLumen:
    """Keep only the voxels connected to a voxel through faces, cropped to their box with a rim of two voxels."""
    from scipy.ndimage import label  # imported here: slow to load

    numbers, _ = label(lumen.inside)
    piece = numbers == numbers[voxel]
    spans = []
    for axis in range(3):
        used = np.flatnonzero(piece.any(axis=tuple({0, 1, 2} - {axis})))
        spans.append((int(used[0]), int(used[-1]) + 1))
    cut = np.pad(piece[tuple(slice(*span) for span in spans)], 2)
    return VoxelLumen(cut, lumen.place([[span[0] - 2 for span in spans]])[0], lumen.voxel_mm)


@compiled
def mark_crossings(corners: Array, turns: Voxels) -> None:
    """For each line along the last axis, flip the voxel after each crossing with a triangle.

    corners: (F, 3, 3) in voxels; turns: (U, V, W), out. Only the lower end of an edge belongs to it, and its crossing
    with a row is computed in the same order for both of its triangles: no line can pass between two neighbours or cross
    both.
    """
    crossing_u, crossing_w = np.empty(2), np.empty(2)
    for f in range(corners.shape[0]):
        v0, v1, v2 = corners[f, 0, 1], corners[f, 1, 1], corners[f, 2, 1]
        first = max(math.ceil(min(v0, v1, v2)), 0)
        last = min(math.floor(max(v0, v1, v2)), turns.shape[1] - 1)
        for v in range(first, last + 1):
            found = 0
            for k in range(3):
                low, high = k, (k + 1) % 3
                if corners[f, low, 1] > corners[f, high, 1]:
                    low, high = high, low
                at_low, at_high = corners[f, low, 1], corners[f, high, 1]
                if at_low <= v < at_high:
                    share = (v - at_low) / (at_high - at_low)
                    crossing_u[found] = corners[f, low, 0] + share * (corners[f, high, 0] - corners[f, low, 0])
                    crossing_w[found] = corners[f, low, 2] + share * (corners[f, high, 2] - corners[f, low, 2])
                    found += 1
            if found == 2:
                flip_row(crossing_u[0], crossing_w[0], crossing_u[1], crossing_w[1], v, turns)


@compiled
def flip_row(u0: float, w0: float, u1: float, w1: float, v: int, turns: Voxels) -> None:
    """Process one triangle in one row: from (u0, w0), which belongs to it, to (u1, w1), which does not."""
    if u1 < u0:
        u0, w0, u1, w1 = u1, w1, u0, w0
    for u in range(max(math.ceil(u0), 0), min(math.ceil(u1), turns.shape[0])):
        w = math.ceil(w0 + (u - u0) / (u1 - u0) * (w1 - w0))
        if w < turns.shape[2]:
            turns[u, v, max(w, 0)] ^= 1
