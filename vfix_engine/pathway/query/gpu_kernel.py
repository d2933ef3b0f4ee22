"""The kernel of ``gpu.py``: Kwok 2013, eq. 1-9. Loading this module loads numba's CUDA part."""

from __future__ import annotations

import importlib
from functools import lru_cache
from typing import Any

import numpy as np

from ..packed import BALL, BALL_RADIUS, SECTION
from .section import signed_distance

cuda: Any = importlib.import_module("numba.cuda")  # a global, because numba's simulator replaces it
STAGED = 32  # segments in shared memory at a time: 9 kB


@lru_cache(maxsize=8)
def deviation_kernel(threads: int) -> Any:
    """Return the kernel for blocks of ``threads`` threads, compiled at its first call.

    Its grid is (poses × links, blocks of a link). ``points`` (V, 3) and ``start`` (L + 1,) are the vertices in mm,
    ``asked`` (poses × links, 14) frames and windows, ``rows`` and ``polar`` the pathway. ``found`` (poses × links,
    blocks, 3) receives the deepest vertex of each block: its depth, number and segment; -1 if a block has no vertex.
    """
    return cuda.jit(kernel_function(threads))


def kernel_function(threads: int) -> Any:
    """The kernel in Python; mostly one function, since shared memory and barriers belong to the whole block."""
    least_of_stage, deepest_of_block = _pieces(threads)

    def deviations(points: Any, start: Any, asked: Any, rows: Any, polar: Any, found: Any) -> None:
        stage = cuda.shared.array((STAGED, SECTION), np.float64)
        depths = cuda.shared.array(threads, np.float64)
        vertices = cuda.shared.array(threads, np.int64)
        segments = cuda.shared.array(threads, np.int64)
        pose, block, thread = cuda.blockIdx.x, cuda.blockIdx.y, cuda.threadIdx.x
        link = pose % (start.shape[0] - 1)
        begin, end = start[link], start[link + 1]
        first, last = int(asked[pose, 12]), int(asked[pose, 13])
        stride = cuda.gridDim.y * threads
        turns = (end - begin + stride - 1) // stride  # equal for all threads of the block, which synchronise
        depth, vertex, segment = -1.0, begin, first
        staged = -1
        for turn in range(turns):
            i = begin + turn * stride + block * threads + thread
            x, y, z = 0.0, 0.0, 0.0
            if i < end:
                a, b, c = points[i, 0], points[i, 1], points[i, 2]
                x = asked[pose, 0] * a + asked[pose, 1] * b + asked[pose, 2] * c + asked[pose, 3]
                y = asked[pose, 4] * a + asked[pose, 5] * b + asked[pose, 6] * c + asked[pose, 7]
                z = asked[pose, 8] * a + asked[pose, 9] * b + asked[pose, 10] * c + asked[pose, 11]
            least, at = np.inf, first
            for low in range(first, last, STAGED):
                count = min(STAGED, last - low)
                if staged != low:
                    cuda.syncthreads()
                    for k in range(thread, count * SECTION, threads):
                        stage[k // SECTION, k % SECTION] = rows[low + k // SECTION, k % SECTION]
                    cuda.syncthreads()
                    staged = low
                if i < end and least > 0.0:
                    least, at = least_of_stage(x, y, z, stage, polar[low : low + count + 1], low, least, at)
            if i < end and least > depth:  # eq. 9, of the thread
                depth, vertex, segment = least, i, at
        depths[thread], vertices[thread], segments[thread] = depth, vertex, segment
        deepest_of_block(thread, depths, vertices, segments)
        if thread == 0:
            found[pose, block, 0] = depths[0]
            found[pose, block, 1] = float(vertices[0])
            found[pose, block, 2] = float(segments[0])

    return deviations


def _pieces(threads: int) -> tuple[Any, Any]:
    """Two device functions: one thread's search in the staged segments, and the final reduction over a block."""
    section: Any = cuda.jit(device=True)(signed_distance)

    def least_of_stage(x: Any, y: Any, z: Any, stage: Any, polar: Any, low: Any, least: Any, at: Any) -> Any:
        """Eq. 8 over the staged segments, numbered from ``low``, continuing the previous minimum."""
        near, nearest = np.inf, 0  # the most likely segment of the vertex is tested first
        for j in range(polar.shape[0] - 1):
            u, v, w = x - stage[j, BALL], y - stage[j, BALL + 1], z - stage[j, BALL + 2]
            away = u * u + v * v + w * w
            if away < near:
                near, nearest = away, j
        for k in range(-1, polar.shape[0] - 1):
            j = nearest if k < 0 else k
            u, v, w = x - stage[j, BALL], y - stage[j, BALL + 1], z - stage[j, BALL + 2]
            reach = least + stage[j, BALL_RADIUS]  # a ball that is farther away contains nothing nearer
            if least > 0.0 and k != nearest and u * u + v * v + w * w < reach * reach:
                gap = section(x, y, z, stage, polar, j)[0]  # eq. 1-7
                if gap <= 0.0:
                    gap = 0.0
                if gap < least:  # False for NaN
                    least, at = gap, low + j
        return least, at

    def deepest_of_block(thread: Any, depths: Any, vertices: Any, segments: Any) -> None:
        """Eq. 9 over the threads of a block, with the result at index 0; of equal ones the first vertex."""
        cuda.syncthreads()
        half = threads // 2
        while half > 0:
            if thread < half:
                far, other = depths[thread + half], vertices[thread + half]
                if far > depths[thread] or (far == depths[thread] and other < vertices[thread]):
                    depths[thread], vertices[thread] = far, other
                    segments[thread] = segments[thread + half]
            cuda.syncthreads()
            half //= 2

    return cuda.jit(device=True)(least_of_stage), cuda.jit(device=True)(deepest_of_block)
