"""Closest pairs between tool and surface, and their reduction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Int32Array
from ..kernels.compiled import no_refcount

MAX_ROWS = 40  # pairs of one control program
COSINE, RADIUS_MM = 0.95, 4.0  # of normals and of points on the axis: pairs that agree within both are redundant

# Columns of the fields of ``Pairs`` in the kernels' rows and labels.
_COLUMNS: dict[str, tuple[str, int | slice]] = {
    "distance": ("_rows", 0),
    "normal": ("_rows", slice(1, 4)),
    "on_tool": ("_rows", slice(4, 7)),
    "on_surface": ("_rows", slice(7, 10)),
    "segment": ("_labels", 0),
    "triangle": ("_labels", 1),
}


@dataclass(frozen=True, eq=False)
class Pairs:
    """N closest pairs of tool segments and triangles; lengths in mm, patient frame.

    distance: (N,) from the capsule's surface to the anatomy; negative inside the capsule.
    normal: (N, 3) unit vectors from the surface to the axis; the triangle's own normal where they intersect.
    on_tool: (N, 3) points P_k on the axis; on_surface: (N, 3) points P_b on the anatomy (Li 2007, section III.D).
    segment: (N,) index of the tool's segment.
    triangle: (N,) index of the face; −1 for a grouped pair of the covariance tree.
    """

    distance: Array
    normal: Array
    on_tool: Array
    on_surface: Array
    segment: Int32Array
    triangle: Int32Array

    def __len__(self) -> int:
        return len(self.distance)

    def __getattr__(self, name: str) -> Any:
        """Create a column of the kernel's rows on first access."""
        place, own = _COLUMNS.get(name), self.__dict__
        if place is None or not ("_rows" in own or "_buffer" in own):
            raise AttributeError(f"pairs have no {name}")
        if "_rows" not in own:
            own["_rows"], own["_labels"] = rows_and_labels(own["_buffer"], own["_count"])
        column = own[name] = own[place[0]][:, place[1]]
        return column

    def take(self, rows: NDArray[np.int64]) -> Pairs:
        """Return the pairs with these indices, in that order."""
        return Pairs(
            self.distance[rows],
            self.normal[rows],
            self.on_tool[rows],
            self.on_surface[rows],
            self.segment[rows],
            self.triangle[rows],
        )


@dataclass(frozen=True, eq=False)
class Pair:
    """One closest pair; the fields are those of ``Pairs`` for one row."""

    distance: float
    normal: Array
    on_tool: Array
    on_surface: Array
    segment: int
    triangle: int

    def __getattr__(self, name: str) -> Any:
        """As in ``Pairs``, for a pair that ``pair_from_row`` made."""
        place = _COLUMNS.get(name)
        if place is None or "_row" not in self.__dict__:
            raise AttributeError(f"a pair has no {name}")
        part = self.__dict__[name] = np.array(self.__dict__["_row"][place[1]])
        part.setflags(write=False)
        return part


def pair_from_row(row: tuple[float, ...], segment: int, triangle: int) -> Pair:
    """A pair from the ten numbers of a kernel's row; its vectors become arrays when they are read."""
    pair = object.__new__(Pair)
    own = pair.__dict__
    own["_row"], own["distance"], own["segment"], own["triangle"] = row, row[0], segment, triangle
    return pair


def pairs_from_rows(rows: Array, labels: Int32Array) -> Pairs:
    """Pairs from the kernels' rows: (N, 10) distance, normal, on_tool, on_surface; (N, 2) segment, triangle."""
    rows.setflags(write=False)
    labels.setflags(write=False)
    pairs = object.__new__(Pairs)
    pairs.__dict__["_rows"], pairs.__dict__["_labels"] = rows, labels
    return pairs


def pairs_from_buffer(buffer: Array, found: int) -> Pairs:
    """Pairs from the buffer of a query, see ``rows_and_labels``.

    The buffer is split on first access of a column, since splitting takes as long as a small query.
    """
    pairs = object.__new__(Pairs)
    own = pairs.__dict__
    own["_buffer"], own["_count"] = buffer, found
    return pairs


def rows_and_labels(buffer: Array, found: int) -> tuple[Array, Int32Array]:
    """Rows (N, 10) and labels (N, 2) of ``found`` pairs in a buffer (11 R,): R rows, then R labels."""
    buffer.setflags(write=False)
    labels = 10 * (len(buffer) // 11)
    rows = buffer[: 10 * found].reshape(found, 10)
    return rows, buffer[labels : labels + found].view(np.int32).reshape(found, 2)


def reduce_pairs(pairs: Pairs, max_rows: int = MAX_ROWS, cosine: float = COSINE, radius: float = RADIUS_MM) -> Pairs:
    """The at most ``max_rows`` nearest pairs that are not redundant, nearest first.

    A pair is redundant if a nearer selected pair of the same segment has a normal that agrees within ``cosine`` and a
    point on the axis within ``radius`` mm: its row would be nearly the same and weaker.
    """
    rows = np.column_stack([pairs.distance, pairs.normal, pairs.on_tool])
    labels = np.column_stack([pairs.segment, pairs.triangle])
    kept = np.empty(min(max_rows, len(pairs)), np.int32)
    found = select(rows, labels, 0, np.arange(len(pairs), dtype=np.int32), len(pairs), cosine, radius, kept)
    return pairs.take(kept[:found].astype(np.int64))


@no_refcount
def select(
    rows: Array, labels: Int32Array, key: int, waiting: Int32Array, count: int, cosine: float, radius: float,
    kept: Int32Array,
) -> int:  # fmt: skip
    """Write the indices of the pairs that ``reduce_pairs`` keeps, in its order, and return their number.

    Args:
        rows, labels: of the kernels, see ``pairs_from_rows``; the first seven columns and the first one are read.
        key: column of the rows by which they are sorted; equal numbers stay in the given order.
        waiting: the indices of the ``count`` pairs from which to select; overwritten.
        kept: out; its length is the largest number of pairs.
    """
    left, found = count, 0
    while left > 0 and found < len(kept):
        best = 0
        for i in range(1, left):
            if rows[waiting[i], key] < rows[waiting[best], key]:
                best = i
        b = waiting[best]
        kept[found] = b
        found += 1
        still = 0
        for i in range(left):
            w = waiting[i]
            same = False
            if labels[w, 0] == labels[b, 0]:
                x, y, z = rows[w, 4] - rows[b, 4], rows[w, 5] - rows[b, 5], rows[w, 6] - rows[b, 6]
                along = rows[w, 1] * rows[b, 1] + rows[w, 2] * rows[b, 2] + rows[w, 3] * rows[b, 3]
                same = along >= cosine and x * x + y * y + z * z <= radius * radius
            if w != b and not same:
                waiting[still] = w
                still += 1
        left = still
    return found
