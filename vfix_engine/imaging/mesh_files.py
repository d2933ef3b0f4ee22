"""Reader of surfaces (.ply, .stl, .obj, .glb, .vtk, .vtp) into LPS mm, and writer of .ply with its frame and unit.

trimesh reads the triangles of a PLY. What it accepts silently (wrong counts, NaN, indices out of range, no triangle) is
checked here, before and after.
"""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Callable, Iterator
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import FrameError, MeshError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.frame_report import FrameReport, resolve_frame, to_lps_mm
from vfix_engine.imaging.mesh_glb import read_glb
from vfix_engine.imaging.mesh_vtk import read_vtk, read_vtp

MESH_SUFFIXES = (".ply", ".stl", ".obj", ".glb", ".vtk", ".vtp")
MAX_FILE_BYTES = 1 << 30
MAX_TRIANGLES = 5_000_000
FARTHEST_MM = 1e5  # of a corner from the origin
_HEADER_BYTES = 4096
_STL_RECORD = 50  # [byte] one triangle of a binary STL
# 3D Slicer writes the frame as 'SPACE=LPS' into the comment of each of these formats; the unit follows its example.
_NAMED_FRAME = re.compile(rb"SPACE=(?:LPS|RAS)\b")
_NAMED_UNIT = re.compile(rb"UNIT=(?:mm|m)\b")
_PLY_BYTES = {
    **dict.fromkeys((b"char", b"uchar", b"int8", b"uint8"), 1),
    **dict.fromkeys((b"short", b"ushort", b"int16", b"uint16"), 2),
    **dict.fromkeys((b"int", b"uint", b"float", b"int32", b"uint32", b"float32"), 4),
    **dict.fromkeys((b"double", b"float64"), 8),
}


def is_mesh(path: Path) -> bool:
    """Whether the name ends like that of a surface."""
    return path.suffix.lower() in MESH_SUFFIXES


def read_mesh(
    path: str | Path, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> tuple[TriangleMesh, FrameReport]:
    """Read a surface into LPS mm. Triangles keep their order; polygons are split into triangles.

    The counts of the file are compared with its content, so that a truncated file is refused.

    Args:
        frame, unit: 'LPS' or 'RAS', 'mm' or 'm', where the file does not name them.
        assume: take LPS mm where neither names them, and report it, instead of raising FrameError.

    Raises:
        MeshError: the surface cannot be used.
        FrameError: frame or unit are missing, or contradict the file.
    """
    path = Path(path)
    if not path.is_file():
        raise MeshError("there is no such file.")
    if not is_mesh(path):
        raise MeshError(f"a surface is read from {', '.join(MESH_SUFFIXES)}.")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise MeshError(f"the file is larger than {MAX_FILE_BYTES >> 20} MiB.")
    data = path.read_bytes()
    kind = path.suffix.lower()[1:]
    if not data:
        raise MeshError("the file is empty.")
    named_frame = _named(_NAMED_FRAME, data)
    if kind in _VTK_READERS:
        vertices, faces, space = _VTK_READERS[kind](data)
        named_frame = named_frame or space
    read_frame, read_unit, report = resolve_frame(
        (named_frame, _named(_NAMED_UNIT, data)), (frame, unit), assume=assume
    )
    if kind in _READERS:
        vertices, faces = _READERS[kind](data)
    _check(vertices, faces)
    placed = to_lps_mm(vertices, read_frame, read_unit)
    farthest = float(np.abs(placed).max())
    if farthest > FARTHEST_MM:
        raise MeshError(
            f"a corner of the surface is {farthest:.3g} mm from the origin; at most {FARTHEST_MM:g} mm are taken. "
            "The file is damaged, or its unit is another."
        )
    return TriangleMesh(placed, faces), report


def _named(pattern: re.Pattern[bytes], data: bytes) -> str | None:
    """The frame or unit in the comments; FrameError where two comments contradict each other."""
    words = list(dict.fromkeys(word.decode() for word in pattern.findall(data)))
    if len(words) > 1:
        raise FrameError(f"the file says {words[1]} after {words[0]}; keep the one that is right, or split the file.")
    return words[0].partition("=")[2] if words else None


def write_ply(path: Path, mesh: TriangleMesh) -> None:
    """Write a binary PLY in LPS mm, with frame and unit named and vertices in double precision."""
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS UNIT=mm\ncomment Not for clinical use\n"
        f"element vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    records = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    records["count"] = 3
    records["corners"] = mesh.faces
    path.write_bytes(head.encode("ascii") + mesh.vertices.astype("<f8").tobytes() + records.tobytes())


def _check(vertices: npt.NDArray[Any], faces: npt.NDArray[Any]) -> None:
    if len(faces) == 0 or len(vertices) == 0:
        raise MeshError("the file holds no triangles.")
    if len(faces) > MAX_TRIANGLES:
        raise MeshError(f"the file holds {len(faces):,} triangles; at most {MAX_TRIANGLES:,} are read.")
    if faces.ndim != 2 or faces.shape[1] != 3 or vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError("the file does not hold triangles in three dimensions.")
    if not np.isfinite(vertices).all():
        raise MeshError("some corners of the surface are not finite numbers.")
    named = int(faces.min() if faces.min() < 0 else faces.max())
    if not 0 <= named < len(vertices):
        raise MeshError(f"a triangle names corner {named}, but the {len(vertices):,} corners are counted from 0.")


def _read_stl(data: bytes) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Corners that coincide exactly become one vertex: STL stores each triangle on its own."""
    (count,) = struct.unpack_from("<I", data, 80) if len(data) >= 84 else (0,)
    if len(data) >= 84 and len(data) == 84 + _STL_RECORD * count:  # binary, even where it begins with 'solid'
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(data, dtype=record, offset=84)["corners"].reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:_HEADER_BYTES]:
        corners = _ascii_stl_corners(data)
    else:
        held = max(len(data) - 84, 0) // _STL_RECORD
        raise MeshError(f"the STL file claims {count:,} triangles and holds {held:,}; it is cut off or damaged.")
    if not np.isfinite(corners).all():
        raise MeshError("some corners of the surface are not finite numbers.")
    vertices, inverse = np.unique(corners.astype(np.float64), axis=0, return_inverse=True)
    return vertices, inverse.reshape(-1, 3)


def _ascii_stl_corners(data: bytes) -> npt.NDArray[np.float64]:
    words = data.split()
    starts = [n for n, word in enumerate(words) if word == b"vertex"]
    if len(starts) != 3 * words.count(b"endfacet") or words.count(b"endsolid") != 1:
        raise MeshError("the text STL file is cut off or holds several solids.")
    try:
        return np.array([[float(word) for word in words[n + 1 : n + 4]] for n in starts]).reshape(-1, 3)
    except ValueError:
        raise MeshError("a corner in the text STL file is not three numbers.") from None


def _read_obj(data: bytes) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Corners and polygons, line by line; normals, textures, materials and groups change no triangle."""
    _check_last_line(data, "OBJ")
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for number, words in _rows(data):
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]
                vertices.append([float(x), float(y), float(z)])
            elif words[0] == b"f":
                first, *others = (_obj_corner(word, len(vertices)) for word in words[1:])
                if len(others) < 2:
                    raise ValueError
                faces.extend((first, a, b) for a, b in pairwise(others))
        except ValueError:
            raise MeshError(
                f"line {number} of the OBJ file is not a {'corner' if words[0] == b'v' else 'triangle or polygon'}; "
                "the file is cut off or damaged."
            ) from None
    return np.array(vertices).reshape(-1, 3), np.array(faces, dtype=np.int64).reshape(-1, 3)


def _obj_corner(word: bytes, known: int) -> int:
    """Index, from 0, of the corner that a polygon names: counted from 1, or backwards from the last one so far."""
    index = int(word.partition(b"/")[0])
    if index == 0 or index < -known or index >= 1 << 31:
        raise ValueError
    return index - 1 if index > 0 else known + index


def _check_last_line(data: bytes, kind: str) -> None:
    """Refuse a last line without an end: its last number may be truncated."""
    if not data.endswith((b"\n", b"\r")):
        raise MeshError(
            f"the last line of the {kind} file has no end: the file is cut off. "
            "If you know that it is whole, add a line break at its end."
        )


def _rows(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Number, counted from 1, and words of each line that is not empty, without the comment after #."""
    for number, line in enumerate(data.splitlines(), start=1):
        if words := line.partition(b"#")[0].split():
            yield number, words


def _read_ply(data: bytes) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    import trimesh  # imported here: slow to load

    _check_ply(data)
    try:
        # From memory and without a resolver, so that no texture is opened.
        loaded = trimesh.load_mesh(io.BytesIO(data), file_type="ply", process=False)
        return np.asarray(loaded.vertices, dtype=np.float64), np.asarray(loaded.faces, dtype=np.int64)
    # trimesh raises many types of errors for a damaged file, and their messages quote it.
    except Exception as error:
        raise MeshError(f"the PLY file is damaged or cut off ({type(error).__name__}).") from None


def _check_ply(data: bytes) -> None:
    """Compare the counts of the header with the content, before anything is allocated for them."""
    end = re.search(rb"end_header\r?\n", data[: 1 << 16])
    if not data.startswith(b"ply") or end is None:
        raise MeshError("the file is not PLY, or its header is cut off.")
    header = [line.split() for line in data[: end.start()].splitlines()]
    elements = _ply_elements(header)
    counts = {name: count for name, count, _ in elements}
    if not counts.get(b"vertex") or not counts.get(b"face"):
        raise MeshError("the PLY file holds no triangles.")
    body = data[end.end() :]
    if [b"format", b"ascii", b"1.0"] in header:
        _check_ply_rows(body, elements)
        return
    # A list has at least its own length. trimesh compares the exact number of bytes before it reads any.
    needed = sum(count * sum(_PLY_BYTES[kind[0]] for kind in kinds) for _, count, kinds in elements)
    if needed > len(body):
        raise MeshError(
            f"the PLY file is cut off: its header claims at least {needed:,} bytes, {len(body):,} are there."
        )


def _ply_elements(header: list[list[bytes]]) -> list[tuple[bytes, int, list[list[bytes]]]]:
    """Name, count and types of the properties of each element; of a list those of its length and of its items."""
    elements: list[tuple[bytes, int, list[list[bytes]]]] = []
    for line in header:
        if line[:1] == [b"element"]:
            if len(line) != 3 or not line[2].isdigit() or len(line[2]) > 11:
                raise MeshError("the PLY header has an element without a count.")
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == [b"property"] and len(line) > 2:
            kinds = line[2:4] if line[1] == b"list" else line[1:2]
            if not elements or not all(kind in _PLY_BYTES for kind in kinds):
                raise MeshError("the PLY header names a type that is not known, or a property of no element.")
            elements[-1][2].append(kinds)
    return elements


def _check_ply_rows(body: bytes, elements: list[tuple[bytes, int, list[list[bytes]]]]) -> None:
    """A text PLY has one row for each item; each must have as many values as its properties take."""
    claimed, there = sum(count for _, count, _ in elements), sum(1 for _ in _rows(body))
    if there != claimed:
        raise MeshError(
            f"the PLY header claims {claimed:,} rows of values, but {there:,} are there; the file is cut off or "
            "damaged."
        )
    _check_last_line(body, "PLY")
    rows = _rows(body)
    for _, count, kinds in elements:
        for number, words in islice(rows, count):
            taken = 0
            for kind in kinds:
                listed = words[taken] if len(kind) == 2 and taken < len(words) else b"0"
                taken += 1 + (int(listed) if listed.isdigit() and len(listed) < 6 else 0)
            if taken != len(words):
                raise MeshError(f"row {number:,} of the PLY file has {len(words)} values, not {taken}; it is damaged.")


_READERS: dict[str, Callable[[bytes], tuple[npt.NDArray[Any], npt.NDArray[Any]]]] = {
    "stl": _read_stl,
    "obj": _read_obj,
    "ply": _read_ply,
    "glb": read_glb,
}
_VTK_READERS = {"vtk": read_vtk, "vtp": read_vtp}  # that know the frame of their fields too
