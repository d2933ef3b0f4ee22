"""Validation of the header of an image file, before any voxel is decoded."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError

MAX_VOXELS = 300_000_000  # a head of 512 x 512 x 1100; 0.6 GB as int16
MAX_SIDE = 8192  # [voxel]
PLAUSIBLE_SPACING = (0.01, 30.0)  # [mm] of a CT
_CHUNK = 1 << 20  # [byte]
_RIGHT_ANGLES = 1e-4  # tolerance of dot products of unit directions, as in ``Volume``


@dataclass(frozen=True)
class GridHeader:
    """A validated header.

    sizes: numbers of voxels along i, j, k.
    transform_index_to_file: (4, 4) from (i, j, k) to the file's own frame and unit.
    frame: as stated by the file, or None. unit: mm if the file states none, because the spacing must be plausible in
        mm.
    unit_named: whether the header states the unit of its lengths; False if only a convention defines it.
    notes: sentences on doubts about the header. further_axes: whether there are axes in addition to the three.
    """

    sizes: tuple[int, int, int]
    transform_index_to_file: npt.NDArray[np.float64]
    frame: str | None
    unit: str
    notes: tuple[str, ...] = ()
    further_axes: bool = False
    unit_named: bool = True


def check_sizes(sizes: list[int]) -> tuple[int, int, int]:
    """Check three plausible voxel counts. Raises ImageError."""
    if len(sizes) != 3 or min(sizes) < 2:
        raise ImageError(f"a CT volume has three axes of at least two voxels, not {sizes}.")
    count = math.prod(sizes)
    if max(sizes) > MAX_SIDE or count > MAX_VOXELS:
        raise ImageError(f"the header claims {sizes[0]} x {sizes[1]} x {sizes[2]} voxels; {MAX_VOXELS:,} can be read.")
    return sizes[0], sizes[1], sizes[2]


def check_transform(transform: npt.NDArray[np.float64], mm_per_unit: float) -> npt.NDArray[np.float64]:
    """Check a transform (4, 4). Raises ImageError unless it is finite, orthogonal and of a plausible spacing."""
    if not np.isfinite(transform).all():
        raise ImageError("the placement in the header is not finite.")
    spacing = np.linalg.norm(transform[:3, :3], axis=0) * mm_per_unit
    low, high = PLAUSIBLE_SPACING
    if not ((spacing >= low) & (spacing <= high)).all():
        figures = " x ".join(f"{value:g}" for value in spacing)
        raise ImageError(f"a voxel of {figures} mm is not one of a CT ({low:g} to {high:g} mm); check the unit.")
    if np.abs(transform[:3, 3]).max() * mm_per_unit > 1e5:
        raise ImageError("the volume lies more than 100 m from its own origin; check the header.")
    axes = transform[:3, :3] * mm_per_unit / spacing
    if np.abs(axes.T @ axes - np.eye(3)).max() > _RIGHT_ANGLES:
        raise ImageError(
            "the directions of the voxel axes in the header are not at right angles; a sheared or flat grid cannot be "
            "used. Export it resampled to a regular grid."
        )
    return transform


def check_length(found: int, claimed: int, *, where: str = "file", padding: int = 0) -> None:
    """Raise ImageError if the number of voxel bytes differs from the header's.

    padding: number of bytes that may follow the voxels.
    """
    if found < claimed:
        raise ImageError(f"the {where} is cut off: the header claims {claimed:,} bytes of voxels, {found:,} are there.")
    if found > claimed + padding:
        raise ImageError(
            f"the {where} is longer than its header says: it claims {claimed:,} bytes of voxels, {found:,} are there. "
            "The header belongs to another volume, or is damaged."
        )


def check_not_packed(head: bytes, kind: str) -> None:
    """Raise ImageError for a gzip file whose name does not indicate it."""
    if head.startswith(b"\x1f\x8b"):
        raise ImageError(f"the file is packed with gzip as a whole, which its name does not say; unpack it to {kind}.")


def inflated(stream: BinaryIO, wbits: int, limit: int) -> Iterator[bytes]:
    """Decompress a zlib (wbits 15) or gzip (31) stream in pieces, up to `limit` bytes.

    Raises:
        ImageError: the stream is damaged, truncated or above the limit, or followed by data.
    """
    total = 0
    inflater = zlib.decompressobj(wbits)
    while True:
        if inflater.eof:
            pending = inflater.unused_data or stream.read(_CHUNK)
            if not pending:
                return
            if wbits != 31 or not pending.startswith(b"\x1f\x8b"):
                raise ImageError("something follows the compressed voxels; the file is damaged.")
            inflater = zlib.decompressobj(wbits)
        else:
            pending = inflater.unconsumed_tail or stream.read(_CHUNK)
            if not pending:
                raise ImageError("the compressed voxels are cut off; copy or export the file again.")
        try:
            data = inflater.decompress(pending, _CHUNK)
        except zlib.error:
            raise ImageError("the compressed voxels are damaged.") from None
        total += len(data)
        if total > limit:
            raise ImageError(f"the compressed voxels hold more than the {limit:,} bytes that the header claims.")
        yield data


def inflated_length(stream: BinaryIO, wbits: int, limit: int) -> int:
    """Uncompressed length of a zlib (wbits 15) or gzip (31) stream. Raises ImageError as `inflated` does."""
    return sum(len(data) for data in inflated(stream, wbits, limit))
