"""The engine's query of one pose on several threads, each with a part of every link's vertices.

The engine itself uses one thread. Its kernel is compiled again here, without the GIL.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, cast

import numba
import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.query.query import Deviations, Query
from vfix_engine.pathway.query.query_fast import link_deviations
from vfix_engine.pathway.query.query_simd import WORK
from vfix_engine.robots.snake_surface import LinkVertices

_released: Callable[..., None] = numba.njit(error_model="numpy", nogil=True, cache=True)(
    cast(Any, link_deviations).py_func
)


class ThreadedQuery:
    """Deviations of a snake's links, computed by ``threads`` threads in parallel. Has to be closed."""

    def __init__(self, vertices: LinkVertices, packed: PackedPathway, window: tuple[int, int], threads: int):
        links = len(vertices.start) - 1
        self._packed = packed
        self._window = np.tile(np.array(window, dtype=np.int64), (links, 1))
        self._parts = [_Part(part, links) for part in _shares(vertices, threads)]
        self._pool = ThreadPoolExecutor(max(threads - 1, 1))

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

    def deviations(self, frames: Array) -> Array:
        """Return d_l (L,) in mm of one pose (L, 3, 4)."""
        waiting = [self._pool.submit(self._ask, part, frames) for part in self._parts[1:]]
        depth = self._ask(self._parts[0], frames)
        for one in waiting:
            depth = np.maximum(depth, one.result())
        return depth

    def _ask(self, part: _Part, frames: Array) -> Array:
        _released(self._packed, part.blocks, self._window, frames, part.found, part.work)
        return part.found.depth


class _Part:
    """The vertices of one thread, and its own memory."""

    def __init__(self, vertices: LinkVertices, links: int):
        self.blocks = Query(vertices).blocks
        self.found = Deviations(np.empty(links), np.empty(links, dtype=np.int64), np.empty(links, dtype=np.int64))
        self.work = np.zeros(WORK)


def _shares(vertices: LinkVertices, threads: int) -> list[LinkVertices]:
    """Split every link's vertices, which are ordered along the link, into one contiguous run per thread."""
    of_link = [
        np.array_split(vertices.points[first:last], threads)
        for first, last in zip(vertices.start[:-1], vertices.start[1:], strict=True)
    ]
    shares = []
    for k in range(threads):
        points = [runs[k] for runs in of_link]
        start = np.concatenate([[0], np.cumsum([len(run) for run in points])]).astype(np.int64)
        shares.append(LinkVertices(np.concatenate(points), start))
    return shares
