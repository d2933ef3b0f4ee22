"""Conversion of DICOM pixels to Hounsfield units, with validation of their storage (PS3.3 C.7.6.3, PS3.5 8.1)."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.grid_header import check_length
from vfix_engine.files.itk import decode
from vfix_engine.files.volume import AIR_HU, to_hu

Whole = npt.NDArray[Any]

PIXEL_TAGS = (
    "SamplesPerPixel", "PhotometricInterpretation", "Rows", "Columns", "BitsAllocated", "BitsStored", "HighBit",
    "PixelRepresentation", "RescaleSlope", "RescaleIntercept", "RescaleType", "PixelPaddingValue",
    "PixelPaddingRangeLimit", "PixelData",
)  # fmt: skip
_MAX_SIDE = 4096  # [pixel]
_GREY = ("MONOCHROME1", "MONOCHROME2")  # they differ in their display, not in their Hounsfield units
# Transfer syntaxes whose frames pydicom decodes with the installed packages; single slices are decoded by GDCM.
_FRAMES_UNPACKED = ("1.2.840.10008.1.2.5", "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81")


@dataclass(frozen=True)
class PixelLayout:
    """Storage of a pixel. allocated, stored: bits. shift: unused bits below the stored ones. signed: pixel sign."""

    allocated: int
    stored: int
    shift: int
    signed: bool


def checked_layout(dataset: Any, where: str) -> PixelLayout:
    """Return the storage of a file's pixels. Raises ImageError if it is not supported."""
    rows, columns = int(dataset.Rows), int(dataset.Columns)
    if not (1 < rows <= _MAX_SIDE and 1 < columns <= _MAX_SIDE):
        raise ImageError(f"{where} claims {rows} x {columns} pixels.")
    kind = dataset.get("PhotometricInterpretation")
    if int(dataset.get("SamplesPerPixel") or 1) != 1 or kind not in _GREY:
        raise ImageError(f"{where} is not a single grey image.")
    allocated, stored, high = (int(dataset[keyword].value) for keyword in ("BitsAllocated", "BitsStored", "HighBit"))
    sign = int(dataset.PixelRepresentation)
    if allocated not in (8, 16, 32, 64) or not 1 <= stored <= high + 1 <= allocated or sign not in (0, 1):
        raise ImageError(
            f"{where} stores its pixels in a way that is not read: {stored} bits of {allocated} up to bit {high} "
            "(BitsStored, BitsAllocated, HighBit). Export the series anew."
        )
    layout = PixelLayout(allocated, stored, high + 1 - stored, bool(sign))
    if layout.shift and dataset.file_meta.TransferSyntaxUID.is_compressed:
        raise ImageError(
            f"{where} is packed, and its {stored} bits do not end at bit {high} (HighBit is not BitsStored less one), "
            "which is not read. Export the series unpacked."
        )
    return layout


def words_of_slice(dataset: Any, data: bytes, where: str) -> Whole:
    """Read (rows, columns) pixels of a file with one slice, as input of `hounsfield`."""
    if dataset.file_meta.TransferSyntaxUID.is_compressed:
        slope, intercept = rescale(dataset, where)
        unpacked: Whole = np.rint((_decoded_by_gdcm(data) - intercept) / slope).astype(np.int64)
        return unpacked
    return _native(dataset, 1, where)


def words_of_frames(dataset: Any, where: str) -> Whole:
    """Read (frames, rows, columns) pixels, as input of `hounsfield`. Raises ImageError for other compressions."""
    syntax = dataset.file_meta.TransferSyntaxUID
    count = int(dataset.get("NumberOfFrames") or 1)
    if not syntax.is_compressed:
        return _native(dataset, count, where).reshape(count, int(dataset.Rows), int(dataset.Columns))
    if syntax not in _FRAMES_UNPACKED:
        raise ImageError(
            f"the frames of {where} are packed as {syntax.name}, which is not read for enhanced CT; export it "
            "unpacked, or as JPEG-LS or RLE."
        )
    values: Whole = dataset.pixel_array
    return values.reshape(count, int(dataset.Rows), int(dataset.Columns))


def hounsfield(dataset: Any, words: Whole, layout: PixelLayout, where: str) -> npt.NDArray[np.int16]:
    """Convert pixels to (rows, columns) Hounsfield units with the rescale and padding of `dataset`."""
    slope, intercept = rescale(dataset, where)
    if words.shape != (int(dataset.Rows), int(dataset.Columns)):
        raise ImageError(f"{where} holds another number of pixels than it claims.")
    stored = _stored(words, layout)
    hu = to_hu(stored * slope + intercept)
    hu[_padding(dataset, words, stored, layout)] = AIR_HU
    return hu


def rescale(dataset: Any, where: str) -> tuple[float, float]:
    """Slope and intercept. Raises ImageError if they are missing or invalid."""
    for keyword in ("RescaleSlope", "RescaleIntercept"):
        if dataset.get(keyword) is None:
            raise ImageError(f"{where} has no {keyword}; its values are not Hounsfield units.")
    slope, intercept = (float(value) for value in numbers([dataset.RescaleSlope, dataset.RescaleIntercept], 2, where))
    if slope == 0.0:
        raise ImageError(f"the rescale slope of {where} is zero.")
    return slope, intercept


def numbers(values: Any, count: int, where: str) -> Array:
    """Return that many finite numbers. Raises ImageError."""
    found = np.array([float(value) for value in values])
    if found.shape != (count,) or not np.isfinite(found).all():
        raise ImageError(f"a position, direction, spacing or rescale of {where} is not made of finite numbers.")
    return found


def _native(dataset: Any, frames: int, where: str) -> Whole:
    """Uncompressed pixels with all bits of their words, including those outside the value."""
    claimed = frames * int(dataset.Rows) * int(dataset.Columns) * (int(dataset.BitsAllocated) // 8)
    check_length(len(dataset.PixelData), claimed, where=where.removeprefix("the "), padding=claimed % 2)
    dataset.BitsStored, dataset.HighBit = dataset.BitsAllocated, int(dataset.BitsAllocated) - 1
    words: Whole = dataset.pixel_array
    return words


def _stored(words: Whole, layout: PixelLayout) -> Whole:
    """Extract the values of pixels: the stored bits of each word, with their sign."""
    spare = layout.allocated - layout.stored
    if not spare or words.dtype.itemsize * 8 != layout.allocated:  # already done by a decoder
        return words
    raised = np.left_shift(words, spare - layout.shift)  # removes higher bits, such as an overlay
    return np.right_shift(raised, spare)


def _padding(dataset: Any, words: Whole, stored: Whole, layout: PixelLayout) -> npt.NDArray[np.bool_]:
    """Mask of padding pixels outside the scanner's field of view, by their stored value or range.

    The tags can have another sign than the pixels (SS on unsigned ones), and a padding pixel can fill its whole word:
    words and values are compared with them modulo the size of a word.
    """
    value = dataset.get("PixelPaddingValue")
    if value is None:
        return np.zeros(stored.shape, dtype=np.bool_)
    limit = dataset.get("PixelPaddingRangeLimit")
    first, last = int(value), int(value if limit is None else limit)
    word = 1 << layout.allocated
    if not all(-word // 2 <= end < word for end in (first, last)):  # no pixel can have this value
        return np.zeros(stored.shape, dtype=np.bool_)
    # Of the two directions from one end to the other use the shorter one; the ends can have different signs.
    low, span = min((first, (last - first) % word), (last, (first - last) % word), key=lambda way: way[1])
    unsigned = np.dtype(f"u{layout.allocated // 8}")
    found = np.zeros(stored.shape, dtype=np.bool_)
    for values in (words, stored):
        found |= values.astype(unsigned) - unsigned.type(low % word) <= unsigned.type(span)
    return found


def _decoded_by_gdcm(data: bytes) -> Array:
    """(rows, columns) rescaled values of a compressed slice, through a temporary file, since GDCM only reads files."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "slice.dcm"
        file.write_bytes(data)
        values: Array = decode(file, "GDCMImageIO")[1][0].astype(np.float64)
    return values
