"""Reader of surfaces (.ply, .stl, .obj, .glb, .vtk, .vtp) into LPS mm, and writer of .ply with its frame and unit.

Content that any format can have but is not a surface (NaN, a missing vertex, no triangle) is refused here; the readers
of the formats compare what a file declares with what it contains.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import FrameError, MeshError
from vfix_engine.files.frame_report import FrameReport, named_unit_of, resolve_frame, to_lps_mm
from vfix_engine.files.mesh_glb import read_glb
from vfix_engine.files.mesh_obj import read_obj
from vfix_engine.files.mesh_parts import MeshArrays, check_count
from vfix_engine.files.mesh_ply import read_ply
from vfix_engine.files.mesh_stl import read_stl
from vfix_engine.files.mesh_vtk import read_vtk, read_vtp
from vfix_engine.geometry.mesh import TriangleMesh

# Readers by suffix: of a format that names no frame itself, and of one whose reader returns it too.
READERS: dict[str, Callable[[bytes], MeshArrays]] = {
    ".ply": read_ply,
    ".stl": read_stl,
    ".obj": read_obj,
    ".glb": read_glb,
}
FRAMED_READERS: dict[str, Callable[[bytes], tuple[npt.NDArray[Any], npt.NDArray[Any], str | None]]] = {
    ".vtk": read_vtk,
    ".vtp": read_vtp,
}
MAX_FILE_BYTES = 1 << 30
VERTEX_LIMIT_MM = 1e5  # largest distance of a vertex from the origin
# 3D Slicer writes the frame as 'SPACE=LPS' into the comment of each of these formats; the unit is written alike.
_NAMED_FRAME = re.compile(rb"SPACE=(?:LPS|RAS)\b")
_NAMED_UNIT = re.compile(rb"\bUNIT=[\w\xb5\xc2\xbc\xce]+")


def mesh_suffixes() -> tuple[str, ...]:
    """Return the suffixes of the surface formats that are read, lower case with their dot."""
    return (*READERS, *FRAMED_READERS)


def is_mesh(path: Path) -> bool:
    """Whether the file name has a suffix of a surface."""
    return path.suffix.lower() in mesh_suffixes()


def read_mesh(
    path: str | Path, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> tuple[TriangleMesh, FrameReport]:
    """Read a surface into LPS mm. Triangles keep their order; polygons are split into triangles.

    The counts of the file are compared with its content, so that a truncated file is refused.

    Args:
        frame, unit: 'LPS' or 'RAS', 'mm', 'm' or 'um', if the file does not state them.
        assume: if neither states them, assume LPS mm and report it instead of raising FrameError.

    Raises:
        MeshError: the surface cannot be used.
        FrameError: frame or unit are missing, or contradict the file.
    """
    path = Path(path)
    if not path.is_file():
        raise MeshError("there is no such file.")
    if not is_mesh(path):
        raise MeshError(f"a surface is read from {', '.join(mesh_suffixes())}.")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise MeshError(f"the file is larger than {MAX_FILE_BYTES >> 20} MiB.")
    data = path.read_bytes()
    if not data:
        raise MeshError("the file is empty.")
    named_frame, unit_words = _named(_NAMED_FRAME, data), _named(_NAMED_UNIT, data)
    named_unit = None if unit_words is None else named_unit_of([unit_words])
    suffix = path.suffix.lower()
    if suffix in FRAMED_READERS:
        vertices, faces, own_frame = FRAMED_READERS[suffix](data)
        named_frame = named_frame or own_frame
    read_frame, read_unit, report = resolve_frame((named_frame, named_unit), (frame, unit), assume=assume)
    if suffix in READERS:
        vertices, faces = READERS[suffix](data)
    _check(vertices, faces)
    placed = to_lps_mm(vertices, read_frame, read_unit)
    farthest = float(np.abs(placed).max())
    if farthest > VERTEX_LIMIT_MM:
        raise MeshError(
            f"a corner of the surface is {farthest:.3g} mm from the origin; at most {VERTEX_LIMIT_MM:g} mm are taken. "
            "The file is damaged, or its unit is another."
        )
    return TriangleMesh(placed, faces), report


def _named(pattern: re.Pattern[bytes], data: bytes) -> str | None:
    """Frame or unit in the comments; FrameError if two comments contradict each other."""
    words = list(dict.fromkeys(word.decode("utf-8", "replace") for word in pattern.findall(data)))
    if len(words) > 1:
        raise FrameError(f"the file says {words[1]} after {words[0]}; keep the one that is right, or split the file.")
    return words[0].partition("=")[2] if words else None


def write_ply(path: Path, mesh: TriangleMesh) -> None:
    """Write a binary PLY in LPS mm, with frame and unit stated and vertices in double precision."""
    path.write_bytes(ply_bytes(mesh))


def ply_bytes(mesh: TriangleMesh) -> bytes:
    """The content of the file that `write_ply` writes."""
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS UNIT=mm\ncomment Not for clinical use\n"
        f"element vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    records = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    records["count"] = 3
    records["corners"] = mesh.faces
    return head.encode("ascii") + mesh.vertices.astype("<f8").tobytes() + records.tobytes()


def _check(vertices: npt.NDArray[Any], faces: npt.NDArray[Any]) -> None:
    if len(faces) == 0 or len(vertices) == 0:
        raise MeshError("the file holds no triangles.")
    check_count(len(faces))
    if faces.ndim != 2 or faces.shape[1] != 3 or vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError("the file does not hold triangles in three dimensions.")
    if not np.isfinite(vertices).all():
        raise MeshError("some corners of the surface are not finite numbers.")
    named = int(faces.min() if faces.min() < 0 else faces.max())
    if not 0 <= named < len(vertices):
        raise MeshError(
            f"a triangle names corner {named}, counted from 0, of a surface with {len(vertices):,} corners; the file "
            "is damaged or incomplete. Export it again."
        )
