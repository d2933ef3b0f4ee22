"""Surfaces in STL, binary and text. Neither states a frame or a unit."""

from __future__ import annotations

import re
import struct
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import MeshError
from vfix_engine.files.mesh_parts import MeshArrays, check_count, fault_of, number_of, without_mark

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84  # [byte] of a binary file, including the number of triangles
_START = 4096  # [byte] by which a text file is recognised
# The name of a solid ends with its line and can contain any word; if no line begins with a facet, it ends before one.
_NAME = (
    re.compile(rb"\s*solid\b[^\r\n]*[\r\n]\s*(?=facet\b|endsolid\b)", re.IGNORECASE),
    re.compile(rb"\s*solid\b.*?(?=\bfacet\s+normal\s|\bendsolid\b)", re.IGNORECASE | re.DOTALL),
)
_END = re.compile(rb"\bendsolid\b[^\r\n]*\s*\Z", re.IGNORECASE)
_CORNER = [b"vertex", b"", b"", b""]
_FACET = [b"facet", b"normal", b"", b"", b"", b"outer", b"loop", *3 * _CORNER, b"endloop", b"endfacet"]
_FIRST_CORNER = 8  # index of the word in a facet


def read_stl(data: bytes) -> MeshArrays:
    """Read vertices (n, 3) in the file's units and triangles (m, 3). Raises MeshError.

    Coincident vertices are merged, since STL stores each triangle separately.
    """
    (count,) = struct.unpack_from("<I", data, 80) if len(data) >= _HEADER else (0,)
    spare = len(data) - _HEADER - _RECORD.itemsize * count
    if spare == 0:  # binary, even if it begins with 'solid'
        corners = np.frombuffer(data, _RECORD, count, _HEADER)["corners"].reshape(-1, 3)
    elif _is_text(data):
        corners = _text_corners(without_mark(data, "STL"))
    elif b"\0" not in data[:_START] and b"facet" in data[:_START].lower():
        raise MeshError("the STL file is text and does not begin with 'solid'; delete what stands before that word.")
    elif spare > 0 and count > 0:
        raise MeshError(
            f"the STL file holds {spare:,} byte{'s' * (spare > 1)} too many after the {count:,} triangles that it "
            "claims; another program may have added to it: save it again."
        )
    else:
        held = max(len(data) - _HEADER, 0) // _RECORD.itemsize
        raise MeshError(f"the STL file claims {count:,} triangles and holds {held:,}; it is cut off or damaged.")
    if not np.isfinite(corners).all():
        raise MeshError("some corners of the surface are not finite numbers.")
    vertices, inverse = np.unique(corners.astype(np.float64), axis=0, return_inverse=True)
    return vertices, inverse.reshape(-1, 3)


def _is_text(data: bytes) -> bool:
    start = data[:_START].lower()
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16, which is refused by name
        start = start[2:].replace(b"\0", b"")
    words = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    return words.startswith(b"solid") and b"\0" not in words and (b"facet" in words or b"endsolid" in words)


def _text_corners(text: bytes) -> npt.NDArray[np.float64]:
    name = next((one for pattern in _NAME if (one := pattern.match(text))), None)
    words = text[name.end() :].split() if name else []
    size = len(_FACET)
    starts = words[::size]
    count = next((n for n, word in enumerate(starts) if word.lower() != b"facet"), len(starts))
    ended = len(words) > count * size and words[count * size].lower() == b"endsolid"
    for place, wanted in enumerate(_FACET):
        found = words[place : count * size : size]
        wrong = next((n for n, word in enumerate(found) if wanted and word.lower() != wanted), len(found))
        if wrong < count:
            why = "it is cut off or damaged" if len(words) < (wrong + 1) * size else "it is damaged"
            raise MeshError(f"facet {wrong + 1:,} of the text STL file is not a normal and three corners; {why}.")
    if not ended:
        raise MeshError(f"the text STL file does not end after its {count:,} facets; it is cut off or damaged.")
    _check_end(text, words[count * size + 1 :])
    check_count(count)
    numbers = [words[_FIRST_CORNER + n : count * size : size] for n in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
    try:
        columns = [[number_of(word) for word in column] for column in numbers]
    except ValueError:
        why = fault_of([word for column in numbers for word in column])
        raise MeshError(f"a corner in the text STL file is not three numbers: {why}.") from None
    return np.array(columns, dtype=np.float64).T.reshape(-1, 3)


def _check_end(text: bytes, after: list[bytes]) -> None:
    """Refuse content after the end of the solid, except its name. after: words behind 'endsolid'."""
    if any((one.lower(), other.lower()) == (b"outer", b"loop") for one, other in pairwise(after)):
        raise MeshError("the text STL file holds several solids; save each as a file, or all as one solid.")
    if not _END.search(text[-_START:]):
        raise MeshError("the text STL file goes on after its end; it is damaged, or more than one file.")
