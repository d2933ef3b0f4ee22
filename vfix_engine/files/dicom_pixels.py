"""Pixels of a DICOM image as Hounsfield units: how they are stored is checked (PS3.3 C.7.6.3, PS3.5 8.1)."""

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
_GREY = ("MONOCHROME1", "MONOCHROME2")  # they differ in how they are shown, not in their Hounsfield units
# Whose packed frames pydicom decodes with what vfix installs; one slice is decoded by GDCM.
_FRAMES_UNPACKED = ("1.2.840.10008.1.2.5", "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81")


@dataclass(frozen=True)
class PixelLayout:
    """How a pixel is stored. allocated, stored: bits. shift: bits below those that are stored. signed: as it says."""

    allocated: int
    stored: int
    shift: int
    signed: bool


def checked_layout(dataset: Any, where: str) -> PixelLayout:
    """How the pixels of a file are stored. Raises ImageError for a way that is not read."""
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
    """(rows, columns) pixels of a file of one slice, before `hounsfield`."""
    if dataset.file_meta.TransferSyntaxUID.is_compressed:
        slope, intercept = rescale(dataset, where)
        unpacked: Whole = np.rint((_decoded_by_gdcm(data) - intercept) / slope).astype(np.int64)
        return unpacked
    return _native(dataset, 1, where)


def words_of_frames(dataset: Any, where: str) -> Whole:
    """(frames, rows, columns) pixels, before `hounsfield`. Raises ImageError for frames packed in another way."""
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
    """(rows, columns) Hounsfield units of pixels; the rescale and padding of `dataset` count."""
    slope, intercept = rescale(dataset, where)
    if words.shape != (int(dataset.Rows), int(dataset.Columns)):
        raise ImageError(f"{where} holds another number of pixels than it claims.")
    stored = _stored(words, layout)
    hu = to_hu(stored * slope + intercept)
    hu[_padding(dataset, words, stored, layout)] = AIR_HU
    return hu


def rescale(dataset: Any, where: str) -> tuple[float, float]:
    """Slope and intercept. Raises ImageError where they are missing or no use."""
    for keyword in ("RescaleSlope", "RescaleIntercept"):
        if dataset.get(keyword) is None:
            raise ImageError(f"{where} has no {keyword}; its values are not Hounsfield units.")
    slope, intercept = (float(value) for value in numbers([dataset.RescaleSlope, dataset.RescaleIntercept], 2, where))
    if slope == 0.0:
        raise ImageError(f"the rescale slope of {where} is zero.")
    return slope, intercept


def numbers(values: Any, count: int, where: str) -> Array:
    """That many finite numbers. Raises ImageError."""
    found = np.array([float(value) for value in values])
    if found.shape != (count,) or not np.isfinite(found).all():
        raise ImageError(f"a position, direction, spacing or rescale of {where} is not made of finite numbers.")
    return found


def _native(dataset: Any, frames: int, where: str) -> Whole:
    """Unpacked pixels with all bits of their words, among them those that do not belong to the value."""
    claimed = frames * int(dataset.Rows) * int(dataset.Columns) * (int(dataset.BitsAllocated) // 8)
    check_length(len(dataset.PixelData), claimed, where=where.removeprefix("the "), padding=claimed % 2)
    dataset.BitsStored, dataset.HighBit = dataset.BitsAllocated, int(dataset.BitsAllocated) - 1
    words: Whole = dataset.pixel_array
    return words


def _stored(words: Whole, layout: PixelLayout) -> Whole:
    """The values of pixels: the stored bits of each word, with their sign."""
    spare = layout.allocated - layout.stored
    if not spare or words.dtype.itemsize * 8 != layout.allocated:  # a decoder has done it
        return words
    raised = np.left_shift(words, spare - layout.shift)  # drops what lies above, such as an overlay
    return np.right_shift(raised, spare)


def _padding(dataset: Any, words: Whole, stored: Whole, layout: PixelLayout) -> npt.NDArray[np.bool_]:
    """Mask of padding pixels outside the scanner's field of view, by their stored value or range.

    The tags may be of the other sign than the pixels (SS on unsigned ones), and a padding pixel may fill its whole
    word: words and values are compared with them modulo the size of a word.
    """
    value = dataset.get("PixelPaddingValue")
    if value is None:
        return np.zeros(stored.shape, dtype=np.bool_)
    limit = dataset.get("PixelPaddingRangeLimit")
    first, last = int(value), int(value if limit is None else limit)
    word = 1 << layout.allocated
    if not all(-word // 2 <= end < word for end in (first, last)):  # no pixel can have it
        return np.zeros(stored.shape, dtype=np.bool_)
    # Of the two ways round from one end to the other the shorter one; the ends may be of different signs.
    low, span = min((first, (last - first) % word), (last, (first - last) % word), key=lambda way: way[1])
    unsigned = np.dtype(f"u{layout.allocated // 8}")
    found = np.zeros(stored.shape, dtype=np.bool_)
    for values in (words, stored):
        found |= values.astype(unsigned) - unsigned.type(low % word) <= unsigned.type(span)
    return found


def _decoded_by_gdcm(data: bytes) -> Array:
    """(rows, columns) rescaled values of a compressed slice, through a temporary file, since GDCM reads files only."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "slice.dcm"
        file.write_bytes(data)
        values: Array = decode(file, "GDCMImageIO")[1][0].astype(np.float64)
    return values
