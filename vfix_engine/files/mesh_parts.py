"""Common parts of the surface readers: byte-order mark, rows, numbers, and triangulation of polygons as fans."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import MeshError

MAX_TRIANGLES = 5_000_000
MeshArrays = tuple[npt.NDArray[Any], npt.NDArray[Any]]
_DECIMAL_COMMA = re.compile(rb"\d,\d")


def without_mark(data: bytes, kind: str) -> bytes:
    """Remove the byte-order mark of UTF-8. Raises MeshError for UTF-16; kind: of the file, for the message."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise MeshError(f"the {kind} file is text in UTF-16; save it as UTF-8 or ASCII.")
    return data.removeprefix(b"\xef\xbb\xbf")


def rows_of(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Number, from 1, and words of each line that is not empty, without the comment after #."""
    for number, line in enumerate(data.splitlines(), start=1):
        if words := line.partition(b"#")[0].split():
            yield number, words


def check_last_line(data: bytes, kind: str) -> None:
    """Refuse a last line without a line break: its last number may be truncated."""
    if not data.endswith((b"\n", b"\r")):
        raise MeshError(
            f"the last line of the {kind} file does not end in a line break, so that its last number may be "
            "incomplete. If you know that the file is whole, add a line break at its end."
        )


def check_count(triangles: int) -> None:
    """Raise MeshError for more than MAX_TRIANGLES."""
    if triangles > MAX_TRIANGLES:
        raise MeshError(f"the file holds {triangles:,} triangles; at most {MAX_TRIANGLES:,} are read.")


def number_of(word: bytes) -> float:
    """Parse a number of a text file. Raises ValueError for forms that only Python accepts, such as '1_0'."""
    if b"_" in word:
        raise ValueError("no number")
    return float(word)


def fault_of(words: Sequence[bytes]) -> str:
    """Explain why words of a text file are not the required numbers, as the end of a sentence."""
    if any(_DECIMAL_COMMA.search(word) for word in words):
        return "its numbers have decimal commas; save it with decimal points"
    return "it is damaged"


def fans(sizes: npt.ArrayLike, corners: npt.NDArray[Any], kind: str) -> npt.NDArray[np.int64]:
    """Triangulate polygons as fans about their first vertex, (m, 3).

    sizes: number of vertices of each polygon, one after the other in `corners`; kind: of the file, for the message.
    Raises MeshError for a polygon of fewer than three vertices, and if the counts do not match.
    """
    sizes, corners = np.asarray(sizes, dtype=np.int64), corners.astype(np.int64, copy=False)
    if (sizes < 3).any():
        raise MeshError(f"a polygon of the {kind} file has fewer than three corners; save it with triangles.")
    if sizes.sum() != len(corners):
        raise MeshError(f"the polygons of the {kind} file do not fit their corners; it is damaged.")
    starts = np.cumsum(sizes) - sizes
    triangles = sizes - 2
    firsts = np.repeat(starts, triangles)
    within = np.arange(len(firsts)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return np.stack([corners[firsts], corners[firsts + within + 1], corners[firsts + within + 2]], axis=1)
