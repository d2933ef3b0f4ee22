"""NIfTI-1, single file, plain or gzip: header validated against nifti1.h; frame RAS by definition of the format."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError
from vfix_engine.files.frame_report import MM_PER_UNIT, check_unit
from vfix_engine.files.grid_header import (
    MAX_VOXELS,
    GridHeader,
    check_length,
    check_not_packed,
    check_sizes,
    check_transform,
    inflated,
)
from vfix_engine.files.volume import check_finite

_HEADER_BYTES = 352
_PIECE = 1 << 20  # [byte]
_TYPE_OF_DATATYPE = {
    2: "u1",
    4: "i2",
    8: "i4",
    16: "f4",
    64: "f8",
    256: "i1",
    512: "u2",
    768: "u4",
    1024: "i8",
    1280: "u8",
}
_UNITS = {1: "m", 2: "mm", 3: "um"}
_UNKNOWN_UNIT = 0
UNIT_ASSUMED = "The NIfTI header does not name its unit; mm was assumed."
_SCANNER = 1  # code of a position in scanner coordinates
_AGREE, _TOO_FAR = 0.1, 1.0  # [voxel] differences of two transforms of one volume: equal, and contradictory


def read_header(path: Path, unit: str | None = None) -> GridHeader:
    """Read and validate the header of a NIfTI-1 file and the length of its voxels; RAS mm. Raises ImageError.

    unit: for a header that states none; None assumes mm and notes it.
    """
    check_unit(unit)
    with path.open("rb") as file:
        pieces = _pieces(file, packed=path.name.lower().endswith(".gz"))
        head = b""
        while len(head) < _HEADER_BYTES:
            piece = next(pieces, None)
            if piece is None:
                raise ImageError("the file is shorter than a NIfTI header; it is cut off or not NIfTI.")
            head += piece
        order = _byte_order(head)
        sizes, begin, voxel = _grid(head, order)
        check_length(_length_of_voxels(chain([head], pieces), begin, voxel), math.prod(sizes) * voxel.itemsize)
    code = head[123] & 7
    named = code != _UNKNOWN_UNIT
    used = _UNITS.get(code) if named else unit or "mm"
    if used is None:
        raise ImageError("the NIfTI header's unit of length is not known.")
    transform, placed, note = _transform(head, order, sizes)
    transform[:3] *= MM_PER_UNIT[used]
    notes = [*([note] if note else []), *([] if named or unit is not None else [UNIT_ASSUMED])]
    frame = "RAS" if placed else None
    return GridHeader(sizes, check_transform(transform, 1.0), frame, "mm", tuple(notes), unit_named=named)


def bytes_before_voxels(path: Path) -> bytes:
    """Header and extensions, uncompressed, of a file that `read_header` accepts; at most the first mebibyte.

    Raises ImageError for a damaged stream.
    """
    with path.open("rb") as file:
        pieces = _pieces(file, packed=path.name.lower().endswith(".gz"))
        head = b""
        while len(head) < _PIECE and (piece := next(pieces, None)) is not None:
            head += piece
    if len(head) < _HEADER_BYTES:
        return b""
    _, begin, _ = _grid(head, _byte_order(head))
    return head[: min(begin, _PIECE)]


def _pieces(file: BinaryIO, *, packed: bool) -> Iterator[bytes]:
    """Iterate over the file's uncompressed bytes. Raises ImageError if its name contradicts its compression."""
    head = file.read(2)
    file.seek(0)
    if not packed:
        check_not_packed(head, ".nii")
        yield from iter(lambda: file.read(_PIECE), b"")
        return
    if head != b"\x1f\x8b":
        raise ImageError("the file is not packed with gzip, as its name says; it is cut off, or an .nii file.")
    yield from inflated(file, 31, MAX_VOXELS * 8)


def _grid(head: bytes, order: str) -> tuple[tuple[int, int, int], int, np.dtype[Any]]:
    """Sizes of the axes, offset of the voxels in the file, and their type."""
    dims = struct.unpack_from(order + "8h", head, 40)
    if not 3 <= dims[0] <= 7 or any(size != 1 for size in dims[4 : dims[0] + 1]):
        shape = " x ".join(str(size) for size in dims[1 : max(0, min(dims[0], 7)) + 1])
        raise ImageError(f"the NIfTI file has {dims[0]} dimensions ({shape}); a CT volume has 3.")
    sizes = check_sizes(list(dims[1:4]))
    datatype, bitpix = struct.unpack_from(order + "2h", head, 70)
    code = _TYPE_OF_DATATYPE.get(datatype)
    voxel = np.dtype(order + (code or "u1"))
    if code is None or bitpix != 8 * voxel.itemsize:
        raise ImageError("the NIfTI file holds a type of voxel that is not a plain number.")
    (offset,) = struct.unpack_from(order + "f", head, 108)
    if not _HEADER_BYTES <= offset <= 1 << 24:
        raise ImageError("the NIfTI header does not say rightly where its voxels begin.")
    return sizes, int(offset), voxel


def _length_of_voxels(pieces: Iterable[bytes], begin: int, voxel: np.dtype[Any]) -> int:
    """Number of bytes of voxels. Raises ImageError for NaN or infinity, which SimpleITK's NIfTI library sets to 0."""
    seen, rest = 0, b""
    for piece in pieces:
        voxels = piece[max(0, begin - seen) :]
        seen += len(piece)
        if voxel.kind == "f":
            rest += voxels
            values = np.frombuffer(rest, voxel, len(rest) // voxel.itemsize)
            check_finite(values)
            rest = rest[values.nbytes :]
    return max(0, seen - begin)


def _byte_order(head: bytes) -> str:
    for order in ("<", ">"):
        (length,) = struct.unpack_from(order + "i", head, 0)
        if length == 348:
            break
        if length == 540:
            raise ImageError("the file is NIfTI-2; save it as NIfTI-1.")
    else:
        raise ImageError("the file is not NIfTI: its header does not begin with its length.")
    if head[344:348] == b"ni1\0":
        raise ImageError("the NIfTI header belongs to a pair of files (.hdr, .img); save it as one .nii file.")
    if head[344:348] != b"n+1\0":
        raise ImageError("the file is not NIfTI: its magic word is missing.")
    return order


def _transform(head: bytes, order: str, sizes: tuple[int, int, int]) -> tuple[npt.NDArray[np.float64], bool, str]:
    """((4, 4) from index to the file's unit, whether the header states the position in the patient, a note or '').

    Of two transforms the sform is used if it is in scanner coordinates, else the qform, as in the library that reads
    the voxels.
    """
    qform_code, sform_code = struct.unpack_from(order + "2h", head, 252)
    found = {}
    if sform_code > 0:
        rows = np.array(struct.unpack_from(order + "12f", head, 280)).reshape(3, 4)
        found["sform"] = np.vstack([rows, [0, 0, 0, 1]])
    if qform_code > 0:
        found["qform"] = _quaternion_transform(head, order)
    if not found:
        return np.diag([*struct.unpack_from(order + "3f", head, 80), 1.0]), False, ""
    if len(found) == 1:
        return found.popitem()[1], True, ""
    corners = np.array([[*(np.array(corner) * (np.array(sizes) - 1)), 1] for corner in np.ndindex(2, 2, 2)])
    off = float(np.linalg.norm((corners @ (found["sform"] - found["qform"]).T)[:, :3], axis=1).max())
    voxels = off / max(float(np.linalg.norm(found["qform"][:3, :3], axis=0).min()), 1e-9)
    if not voxels <= _TOO_FAR:
        raise ImageError(
            f"the NIfTI header places the volume twice (sform, qform), {voxels:.3g} voxels apart; keep one of the two."
        )
    used = "sform" if sform_code == _SCANNER else "qform"
    words = f"The NIfTI header places the volume twice (sform, qform), {voxels:.2g} voxels apart; the {used} is used."
    return found[used], True, words if voxels > _AGREE else ""


def _quaternion_transform(head: bytes, order: str) -> npt.NDArray[np.float64]:
    """Method 2 of nifti1.h: rotation by the unit quaternion (a, b, c, d), third column times qfac."""
    qfac, *pixdim = struct.unpack_from(order + "4f", head, 76)
    if not min(pixdim) > 0.0:
        figures = " x ".join(f"{value:g}" for value in pixdim)
        raise ImageError(f"the NIfTI header has voxels of {figures} (pixdim); they must be above 0.")
    b, c, d, *offset = struct.unpack_from(order + "6f", head, 256)
    square = b * b + c * c + d * d
    if not square <= 1.0 + 1e-4:
        raise ImageError("the NIfTI header's rotation is not one.")
    a = math.sqrt(max(0.0, 1.0 - square))
    if a < 1e-6:  # rotation by π: rounding of the three stored components must not shear the grid
        b, c, d = (value / math.sqrt(square) for value in (b, c, d))
    rotation = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ]
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation * pixdim
    if qfac < 0:
        transform[:3, 2] *= -1.0
    transform[:3, 3] = offset
    return transform
