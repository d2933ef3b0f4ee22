"""Surfaces at the door: .ply, .stl and .obj in, LPS mm out; and .ply out, naming its frame and unit.

trimesh reads the triangles; what it would pass over in silence (a false count, NaN, an index out of range, nothing at
all) is checked here, before and after.
"""

from __future__ import annotations

import io
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import MeshError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.frame_report import FrameReport, settle, to_lps_mm

MESH_SUFFIXES = (".ply", ".stl", ".obj")
MAX_FILE_BYTES = 1 << 30
MAX_TRIANGLES = 5_000_000
_HEADER_BYTES = 4096
_STL_RECORD = 50  # [byte] one triangle of a binary STL
# 3D Slicer writes the frame as 'SPACE=LPS' into the comment of each of these formats; the unit follows its example.
_NAMED_FRAME = re.compile(rb"SPACE=(LPS|RAS)\b")
_NAMED_UNIT = re.compile(rb"UNIT=(mm|m)\b")
_PLY_BYTES = {
    **dict.fromkeys((b"char", b"uchar", b"int8", b"uint8"), 1),
    **dict.fromkeys((b"short", b"ushort", b"int16", b"uint16"), 2),
    **dict.fromkeys((b"int", b"uint", b"float", b"int32", b"uint32", b"float32"), 4),
    **dict.fromkeys((b"double", b"float64"), 8),
}


def is_mesh(path: Path) -> bool:
    """Whether the name says that a surface is in it."""
    return path.suffix.lower() in MESH_SUFFIXES


def read_mesh(
    path: Path, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> tuple[TriangleMesh, FrameReport]:
    """Read a surface into LPS mm; every triangle of the file is kept, in order; polygons are split into triangles.

    frame, unit: what the user says where the file does not ('LPS' or 'RAS', 'mm' or 'm').
    assume: take LPS mm where nobody says, and report it, instead of raising.

    Raises MeshError when the surface cannot be used and FrameError when frame or unit are missing or contradict it.
    """
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
    head = data[:_HEADER_BYTES]
    named = [match and match[1].decode() for match in (_NAMED_FRAME.search(head), _NAMED_UNIT.search(head))]
    read_frame, read_unit, report = settle((named[0], named[1]), (frame, unit), assume=assume)
    vertices, faces = _read_stl(data) if kind == "stl" else _read_with_trimesh(data, kind)
    _check(vertices, faces)
    return TriangleMesh(to_lps_mm(vertices, read_frame, read_unit), faces), report


def write_ply(path: Path, mesh: TriangleMesh) -> None:
    """Write a binary PLY in LPS mm that names both; vertices as double, so that nothing is lost."""
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
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshError(f"a triangle names corner {faces.max()}, but there are only {len(vertices)}.")


def _read_stl(data: bytes) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Corners that coincide exactly become one vertex: STL stores each triangle on its own."""
    (count,) = struct.unpack_from("<I", data, 80) if len(data) >= 84 else (0,)
    if len(data) >= 84 and len(data) == 84 + _STL_RECORD * count:  # binary, whatever its first word is
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


def _read_with_trimesh(data: bytes, kind: str) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    import trimesh  # imported here: slow to load

    if kind == "ply":
        _check_ply(data)
    options = {"maintain_order": True, "skip_materials": True} if kind == "obj" else {}
    try:
        # From memory and without a resolver: a material or texture that the file names is never opened.
        loaded = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False, **options)
        return np.asarray(loaded.vertices, dtype=np.float64), np.asarray(loaded.faces, dtype=np.int64)
    # trimesh raises whatever a damaged file provokes; its words quote the file.
    except Exception as error:
        raise MeshError(f"the {kind.upper()} file is damaged ({type(error).__name__}).") from None


def _check_ply(data: bytes) -> None:
    """The header's counts against the bytes that are there, so that nothing is allocated on a false claim."""
    end = re.search(rb"end_header\r?\n", data[: 1 << 16])
    if not data.startswith(b"ply") or end is None:
        raise MeshError("the file is not PLY, or its header is cut off.")
    lines = [line.split() for line in data[: end.start()].splitlines()]
    binary = [b"format", b"ascii", b"1.0"] not in lines
    needed, count, counts = 0, 0, {}
    for line in lines:
        if line[:1] == [b"element"] and len(line) == 3 and line[2].isdigit() and len(line[2]) < 12:
            count = int(line[2])
            counts[line[1]] = count
        elif line[:1] == [b"element"]:
            raise MeshError("the PLY header has an element without a count.")
        elif line[:1] == [b"property"] and len(line) > 2:
            size = _PLY_BYTES.get(line[2] if line[1] == b"list" else line[1])
            if size is None:
                raise MeshError("the PLY header names a type that is not known.")
            needed += count * (size if binary else 2)  # as text, at least a digit and a space
    if needed > len(data) - end.end() + 2:
        raise MeshError(f"the PLY file is cut off: its header claims at least {needed:,} bytes more than it holds.")
    if not counts.get(b"vertex") or not counts.get(b"face"):
        raise MeshError("the PLY file holds no triangles.")
