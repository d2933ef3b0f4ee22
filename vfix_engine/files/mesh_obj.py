"""Surfaces in Wavefront OBJ: vertices and polygons; normals, textures, materials and groups are ignored.

http://paulbourke.net/dataformats/obj/. An unknown statement is refused instead of skipped: it may be a vertex, and
every following polygon would refer to other vertices.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vfix_engine.errors import MeshError
from vfix_engine.files.mesh_parts import (
    MeshArrays,
    check_count,
    check_last_line,
    fans,
    fault_of,
    number_of,
    without_mark,
)

_PASSED_OVER = frozenset(
    b"vt vn vp p l g s mg o usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj".split()
)
_FREE_FORM = frozenset(
    b"curv curv2 surf cstype deg bmat step parm trim hole scrv sp end con ctech stech bzp bsp cdc cdp res".split()
)
_KNOWN = _PASSED_OVER | _FREE_FORM | {b"v", b"f", b"fo", b"call", b"csh"}
_CORNER_WORDS = (4, 5, 7, 8)  # with three coordinates, a weight, a colour, or both


def read_obj(data: bytes) -> MeshArrays:
    """Read vertices (n, 3) in the file's units and triangles (m, 3). Raises MeshError."""
    data = without_mark(data, "OBJ")
    check_last_line(data, "OBJ")
    vertices: list[list[float]] = []
    corners: list[int] = []
    sizes: list[int] = []
    for number, words in _statements(data):
        kind = words[0]
        try:
            if kind == b"v":
                vertices.append(_corner(words))
            elif kind in (b"f", b"fo"):
                named = [_index(word, len(vertices)) for word in words[1:]]
                if len(named) < 3:
                    raise ValueError
                corners += named
                sizes.append(len(named))
            elif kind not in _PASSED_OVER:
                raise MeshError(f"line {number} of the OBJ file {_not_read(kind)}")
        except ValueError:
            what = "corner" if kind == b"v" else "triangle or polygon"
            raise MeshError(f"line {number} of the OBJ file is not a {what}: {fault_of(words)}.") from None
    check_count(len(sizes))
    faces = fans(sizes, np.array(corners, dtype=np.int64), "OBJ")
    return np.array(vertices, dtype=np.float64).reshape(-1, 3), faces


def _statements(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Number of the first line, from 1, and words of each statement, without the comment after #.

    A backslash at the end joins a line with the next one, unless that begins a statement of its own: a name may end
    with a backslash, and the following vertex must not be lost.
    """
    waiting: tuple[int, list[bytes]] | None = None
    blank = False  # whether a blank precedes the backslash of the incomplete line
    for number, line in enumerate(data.splitlines(), start=1):
        text, mark, _ = line.partition(b"#")
        text = text.rstrip()
        goes_on = text.endswith(b"\\") and not mark
        text = text[:-1] if goes_on else text
        words = text.split()
        if waiting is not None:
            if words and words[0] in _KNOWN:
                yield waiting
            elif words and not (blank or text[:1].isspace()):
                raise MeshError(
                    f"line {number} of the OBJ file goes on with the line before it, and nobody can tell whether a "
                    "number goes on too; put a blank before the backslash there."
                )
            else:
                number, words = waiting[0], waiting[1] + words
        blank = text[-1:].isspace()
        waiting = (number, words) if goes_on and words else None
        if waiting is None and words:
            yield number, words
    if waiting is not None:
        raise MeshError(f"line {waiting[0]} of the OBJ file goes on in a line that is not there; the file is cut off.")


def _corner(words: list[bytes]) -> list[float]:
    if len(words) not in _CORNER_WORDS:
        raise ValueError
    return [number_of(word) for word in words[1:]][:3]


def _index(word: bytes, known: int) -> int:
    """Index, from 0, of a polygon's vertex: given from 1, or negative relative to the last one so far."""
    index = int(word.partition(b"/")[0])
    if b"_" in word or index == 0 or index < -known or index >= 1 << 31:
        raise ValueError
    return index - 1 if index > 0 else known + index


def _not_read(kind: bytes) -> str:
    if kind in _FREE_FORM:
        return f"has a free-form curve or surface ('{kind.decode()}'), which is not read; save it with polygons."
    if kind in (b"call", b"csh"):
        return f"calls another file or program ('{kind.decode()}'), which is not done; save all in one file."
    name = kind[:20].decode("ascii", "replace")
    return f"begins with {name!r}, which no statement of an OBJ file does; it is damaged, or of another format."
