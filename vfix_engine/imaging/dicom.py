"""One DICOM CT series from a folder or a zip: read slice by slice, checked to be one regular stack, in LPS mm.

Only the few tags named here are read, and no value of any of them but geometry ever leaves this module: messages count
and measure, they do not quote.
"""

from __future__ import annotations

import io
import logging
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError
from vfix_engine.imaging.dicom_files import contents
from vfix_engine.imaging.grid_header import MAX_VOXELS, check_length, check_sizes, check_transform
from vfix_engine.imaging.itk import decode
from vfix_engine.imaging.volume import AIR_HU, Volume, to_hu, volume_of

Floats = npt.NDArray[np.float64]

_TAGS = [
    "Modality",
    "SeriesInstanceUID",
    "NumberOfFrames",
    "SamplesPerPixel",
    "PhotometricInterpretation",
    "Rows",
    "Columns",
    "BitsAllocated",
    "BitsStored",
    "HighBit",
    "PixelRepresentation",
    "PixelSpacing",
    "ImagePositionPatient",
    "ImageOrientationPatient",
    "RescaleSlope",
    "RescaleIntercept",
    "PixelPaddingValue",
    "PixelPaddingRangeLimit",
    "PixelData",
]
_DEFLATED = b"1.2.840.10008.1.2.1.99"
_MAX_SIDE = 4096  # [pixel]
_POSITION_ROUNDING = 0.02  # [mm] positions are written with two decimals by some scanners
_GAP_TOLERANCE = 0.01  # of the spacing
_SAME_DIRECTION = 1e-4


@dataclass(frozen=True)
class Slice:
    """One slice. series: identity of its series; hu: (rows, columns) int16; the rest is geometry in LPS mm.

    pixel_mm: (2,) distance between columns and between rows. axes: (3, 2) unit directions along a row and a column.
    """

    series: str
    hu: npt.NDArray[np.int16]
    position: Floats
    axes: Floats
    pixel_mm: Floats


def read_series(path: Path) -> Volume:
    """The one CT series in a folder or zip. Raises ImageError with the figures when it is not one regular stack."""
    if path.name.lower().endswith(".dcm"):
        raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")
    slices: list[Slice] = []
    voxels = 0
    for number, data in enumerate(contents(path), start=1):
        slices.append(_read_slice(data, number))
        voxels += slices[-1].hu.size
        if voxels > MAX_VOXELS:
            raise ImageError(f"the series holds more than {MAX_VOXELS:,} voxels.")
    return stack(slices)


def stack(slices: list[Slice]) -> Volume:
    """Stack the slices along their normal. Raises ImageError when they are not one series on one regular grid."""
    _check_one_series(slices)
    first = slices[0]
    for one in slices:
        if one.hu.shape != first.hu.shape or np.abs(one.pixel_mm - first.pixel_mm).max() > 1e-4:
            raise ImageError("the slices differ in their number of pixels or in their pixel size.")
        if np.abs(one.axes - first.axes).max() > _SAME_DIRECTION:
            raise ImageError("the slices differ in orientation; a scout view, perhaps: name one series only.")
    normal = np.cross(first.axes[:, 0], first.axes[:, 1])
    ordered = sorted(slices, key=lambda one: float(one.position @ normal))
    step = _regular_step(np.array([one.position for one in ordered]), normal)
    transform = np.eye(4)
    transform[:3, :2] = first.axes * first.pixel_mm
    transform[:3, 2] = step
    transform[:3, 3] = ordered[0].position
    check_sizes([first.hu.shape[1], first.hu.shape[0], len(ordered)])
    return volume_of(np.stack([one.hu for one in ordered]), check_transform(transform, 1.0))


def _check_one_series(slices: list[Slice]) -> None:
    series = Counter(one.series for one in slices)
    if len(series) != 1:
        counts = ", ".join(str(count) for count in sorted(series.values(), reverse=True))
        raise ImageError(f"there are {len(series)} series in it ({counts} slices); name the folder or zip of one.")
    if len(slices) < 2:
        raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")


def _regular_step(positions: Floats, normal: Floats) -> Floats:
    """(3,) the vector from slice to slice, exactly along the normal; positions (n, 3) are in order."""
    along = positions @ normal
    gaps = np.diff(along)
    if gaps.min() < 1e-3:
        raise ImageError("two slices lie at the same position; the series is doubled or mixed.")
    sideways = positions - positions[0] - np.outer(along - along[0], normal)
    shear = np.linalg.norm(np.diff(sideways, axis=0), axis=1)
    spacing = float(along[-1] - along[0]) / len(gaps)
    tolerance = max(_POSITION_ROUNDING, _GAP_TOLERANCE * spacing)
    faults = []
    if np.abs(gaps - spacing).max() > tolerance:
        values, counts = np.unique(np.round(gaps, 2), return_counts=True)
        shown = ", ".join(f"{value:.2f} mm ({count}x)" for value, count in zip(values[:6], counts[:6], strict=True))
        faults.append(f"the slices are not evenly spaced: gaps of {shown}; a slice is missing or two scans are mixed")
    if shear.max() > tolerance:
        tilt = np.degrees(np.arctan2(np.linalg.norm(sideways[-1]), along[-1] - along[0]))
        faults.append(f"the slices are shifted against each other by a gantry tilt of {tilt:.1f} degrees")
    if faults:
        raise ImageError(f"the series is not a regular grid: {'; '.join(faults)}. Export it resampled to even slices.")
    return normal * spacing


def _read_slice(data: bytes, number: int) -> Slice:
    import pydicom  # imported here: slow to load, and only needed for this format

    if data[128:132] != b"DICM":
        raise ImageError(f"file {number} of the series is not DICOM.")
    if _DEFLATED in data[:4096]:
        raise ImageError(f"file {number} of the series is deflated as a whole, which is not read.")
    with _pydicom_silenced():
        try:
            dataset = pydicom.dcmread(io.BytesIO(data), specific_tags=list(_TAGS))
            return _checked_slice(dataset, data, number)
        except ImageError:
            raise
        # Whatever a damaged file provokes inside the decoder ends here, without its words: they quote the patient.
        except Exception as error:
            raise ImageError(f"file {number} of the series cannot be read ({type(error).__name__}).") from None


@contextmanager
def _pydicom_silenced() -> Iterator[None]:
    """Its warnings and log lines quote what they complain about."""
    logger = logging.getLogger("pydicom")
    before = logger.disabled
    logger.disabled = True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.disabled = before


def _checked_slice(dataset: Any, data: bytes, number: int) -> Slice:
    if dataset.get("Modality") != "CT":
        raise ImageError(f"file {number} of the series is not a CT image.")
    if int(dataset.get("NumberOfFrames") or 1) != 1 or int(dataset.get("SamplesPerPixel") or 1) != 1:
        raise ImageError(f"file {number} of the series is not a single grey image.")
    for keyword in ("SeriesInstanceUID", "ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        if not dataset.get(keyword):
            raise ImageError(f"file {number} of the series has no {keyword}; it cannot be placed in the patient.")
    for keyword in ("RescaleSlope", "RescaleIntercept"):
        if dataset.get(keyword) is None:
            raise ImageError(f"file {number} of the series has no {keyword}; its values are not Hounsfield units.")
    axes = _numbers(dataset.ImageOrientationPatient, 6).reshape(2, 3).T
    if np.abs(axes.T @ axes - np.eye(2)).max() > 1e-3:
        raise ImageError(f"the row and column directions of file {number} are not at right angles.")
    rotation, upper = np.linalg.qr(axes)  # takes off the rounding of the stored cosines
    axes = rotation * np.sign(np.diag(upper))
    row_mm, column_mm = _numbers(dataset.PixelSpacing, 2)
    rows, columns = int(dataset.Rows), int(dataset.Columns)
    if not (1 < rows <= _MAX_SIDE and 1 < columns <= _MAX_SIDE):
        raise ImageError(f"file {number} of the series claims {rows} x {columns} pixels.")
    hu = _hounsfield(dataset, data, number)
    position = _numbers(dataset.ImagePositionPatient, 3)
    return Slice(str(dataset.SeriesInstanceUID), hu, position, axes, np.array([column_mm, row_mm]))


def _hounsfield(dataset: Any, data: bytes, number: int) -> npt.NDArray[np.int16]:
    slope, intercept = _numbers([dataset.RescaleSlope, dataset.RescaleIntercept], 2)
    if slope == 0.0:
        raise ImageError(f"the rescale slope of file {number} is zero.")
    if dataset.file_meta.TransferSyntaxUID.is_compressed:
        stored = np.rint((_decoded_by_gdcm(data) - intercept) / slope)
    else:
        claimed = int(dataset.Rows) * int(dataset.Columns) * (int(dataset.BitsAllocated) // 8)
        check_length(len(dataset.PixelData), claimed, where=f"file number {number} of the series", padding=claimed % 2)
        stored = dataset.pixel_array
    if stored.shape != (int(dataset.Rows), int(dataset.Columns)):
        raise ImageError(f"file {number} of the series holds another number of pixels than it claims.")
    hu = to_hu(stored * slope + intercept)
    hu[_padding(dataset, stored)] = AIR_HU
    return hu


def _padding(dataset: Any, stored: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Pixels outside the scanner's circle, by the stored value or range of values that marks them."""
    value = dataset.get("PixelPaddingValue")
    if value is None:
        return np.zeros(stored.shape, dtype=np.bool_)
    limit = dataset.get("PixelPaddingRangeLimit")
    low, high = sorted((int(value), int(value if limit is None else limit)))
    return (stored >= low) & (stored <= high)


def _decoded_by_gdcm(data: bytes) -> Floats:
    """(rows, columns) rescaled values of a compressed slice. GDCM reads files only: one of our own naming, deleted."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "slice.dcm"
        file.write_bytes(data)
        values: Floats = decode(file, "GDCMImageIO")[1][0].astype(np.float64)
    return values


def _numbers(values: Any, count: int) -> Floats:
    numbers = np.array([float(value) for value in values])
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ImageError("a position, direction, spacing or rescale of the series is not made of finite numbers.")
    return numbers
