"""One DICOM CT series from a folder or a zip: read slice by slice, checked to be one regular stack, in LPS mm.

Only the few tags named here are read, and no value of any of them but geometry ever leaves this module: messages count
and measure, they do not quote.
"""

from __future__ import annotations

import io
import logging
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError
from vfix_engine.imaging.dicom_files import contents
from vfix_engine.imaging.grid_header import MAX_VOXELS, PLAUSIBLE_SPACING, check_length, check_sizes, check_transform
from vfix_engine.imaging.itk import decode
from vfix_engine.imaging.volume import AIR_HU, Volume, to_hu, volume_of

Floats = npt.NDArray[np.float64]

_TAGS = [
    "SOPClassUID",
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
    "SliceThickness",
    "RescaleSlope",
    "RescaleIntercept",
    "PixelPaddingValue",
    "PixelPaddingRangeLimit",
    "PixelData",
]
# What a scanner or an archive puts beside the slices and is not an image, by the beginning of its SOP class: the
# directory of the medium, presentation states, waveforms, raw data, reports, documents, and structures and plans of
# radiotherapy.
_NO_IMAGE = (
    "1.2.840.10008.1.3.10",
    "1.2.840.10008.5.1.4.1.1.9.",
    "1.2.840.10008.5.1.4.1.1.11.",
    "1.2.840.10008.5.1.4.1.1.66",
    "1.2.840.10008.5.1.4.1.1.88.",
    "1.2.840.10008.5.1.4.1.1.104.",
    "1.2.840.10008.5.1.4.1.1.481.3",
    "1.2.840.10008.5.1.4.1.1.481.5",
)
_DEFLATED = b"1.2.840.10008.1.2.1.99"
_MAX_SIDE = 4096  # [pixel]
_POSITION_ROUNDING = 0.02  # [mm] positions are written with two decimals by some scanners
_GAP_TOLERANCE = 0.01  # of the spacing
_SAME_DIRECTION = 1e-4


@dataclass(frozen=True)
class Slice:
    """One slice. hu: (rows, columns) int16; the rest is geometry in LPS mm.

    pixel_mm: (2,) distance between columns and between rows. axes: (3, 2) unit directions along a row and a column.
    thickness_mm: None where the file does not say it.
    """

    hu: npt.NDArray[np.int16]
    position: Floats
    axes: Floats
    pixel_mm: Floats
    thickness_mm: float | None


@dataclass
class _Series:
    """What may be told of a series, which is nothing that a person wrote."""

    is_ct: bool
    pixels: tuple[int, int]
    files: int = 0

    def __str__(self) -> str:
        images = f"{self.files} image{'s' * (self.files > 1)} of {self.pixels[0]} x {self.pixels[1]}"
        return images if self.is_ct else f"{images}, not CT"


def read_series(path: Path, series: int | None = None) -> Volume:
    """The CT series in a folder or zip.

    series: which one, counted from 1 in the order of the files' names; None where there is only one.

    Raises ImageError, which names the series or the file that is wrong, when it is not one regular stack.
    """
    if path.name.lower().endswith(".dcm"):
        raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")
    found: dict[str, _Series] = {}
    slices: list[Slice] = []
    voxels = 0
    fault: ImageError | None = None
    for name, data in contents(path):
        where = f"the file {name!r:.80}"
        with _pydicom_silenced():
            with _fault_named(where):
                dataset = _dataset(data, where)
                number = _count(dataset, found)
            if fault is not None or number != (series or 1):
                continue
            try:
                with _fault_named(where):
                    slices.append(_checked_slice(dataset, data, where))
            except ImageError as error:
                fault = error  # of several series this may be one that nobody wants
        voxels += slices[-1].hu.size if fault is None else 0
        if voxels > MAX_VOXELS:
            raise ImageError(f"the series holds more than {MAX_VOXELS:,} voxels.")
    _check_choice(list(found.values()), series)
    if fault is not None:
        raise fault
    return stack(slices)


def _count(dataset: Any, found: dict[str, _Series]) -> int:
    """Count an image to its series; the number of that series, from 1, or 0 for what is not an image."""
    kind = dataset.get("SOPClassUID") or dataset.file_meta.get("MediaStorageSOPClassUID")
    if str(kind).startswith(_NO_IMAGE):
        return 0
    identity = str(dataset.get("SeriesInstanceUID"))
    pixels = int(dataset.get("Columns") or 0), int(dataset.get("Rows") or 0)
    known = found.setdefault(identity, _Series(dataset.get("Modality") == "CT", pixels))
    known.files += 1
    return list(found).index(identity) + 1


def _check_choice(found: list[_Series], series: int | None) -> None:
    if not found:
        raise ImageError("there is no DICOM image in it.")
    listed = "; ".join(f"{number}: {one}" for number, one in enumerate(found[:20], start=1))
    if series is None and len(found) > 1:
        raise ImageError(
            f"there are {len(found)} series in it ({listed}). Say which one with --series on the command line, "
            "or name the folder or zip of one."
        )
    if series is not None and not 1 <= series <= len(found):
        raise ImageError(f"there is no series {series} in it; there are {len(found)} ({listed}).")


def stack(slices: list[Slice]) -> Volume:
    """Stack the slices along their normal. Raises ImageError when they are not on one regular grid."""
    if len(slices) < 2:
        raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")
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
    thickness = max((one.thickness_mm for one in slices if one.thickness_mm is not None), default=None)
    return volume_of(np.stack([one.hu for one in ordered]), check_transform(transform, 1.0), thickness)


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


def _dataset(data: bytes, where: str) -> Any:
    """The few tags of a file that are needed. Raises ImageError."""
    import pydicom  # imported here: slow to load, and only needed for this format

    if data[128:132] != b"DICM":
        raise ImageError(f"{where} is not DICOM.")
    if _DEFLATED in data[:4096]:
        raise ImageError(f"{where} is deflated as a whole, which is not read.")
    return pydicom.dcmread(io.BytesIO(data), specific_tags=list(_TAGS))


@contextmanager
def _fault_named(where: str) -> Iterator[None]:
    """Whatever a damaged file provokes inside the decoder ends here, without its words: they quote the patient."""
    try:
        yield
    except ImageError:
        raise
    except RecursionError:
        raise ImageError(f"{where} is nested too deeply.") from None
    except Exception as error:
        raise ImageError(f"{where} cannot be read ({type(error).__name__}); it is damaged.") from None


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


def _checked_slice(dataset: Any, data: bytes, where: str) -> Slice:
    if dataset.get("Modality") != "CT":
        raise ImageError(f"{where} is not a CT image.")
    if int(dataset.get("NumberOfFrames") or 1) != 1 or int(dataset.get("SamplesPerPixel") or 1) != 1:
        raise ImageError(f"{where} is not a single grey image.")
    for keyword in ("SeriesInstanceUID", "ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        if not dataset.get(keyword):
            raise ImageError(f"{where} has no {keyword}; it cannot be placed in the patient.")
    for keyword in ("RescaleSlope", "RescaleIntercept"):
        if dataset.get(keyword) is None:
            raise ImageError(f"{where} has no {keyword}; its values are not Hounsfield units.")
    axes = _numbers(dataset.ImageOrientationPatient, 6, where).reshape(2, 3).T
    if np.abs(axes.T @ axes - np.eye(2)).max() > 1e-3:
        raise ImageError(f"the row and column directions of {where} are not at right angles.")
    rotation, upper = np.linalg.qr(axes)  # takes off the rounding of the stored cosines
    axes = rotation * np.sign(np.diag(upper))
    row_mm, column_mm = _numbers(dataset.PixelSpacing, 2, where)
    rows, columns = int(dataset.Rows), int(dataset.Columns)
    if not (1 < rows <= _MAX_SIDE and 1 < columns <= _MAX_SIDE):
        raise ImageError(f"{where} claims {rows} x {columns} pixels.")
    hu = _hounsfield(dataset, data, where)
    position = _numbers(dataset.ImagePositionPatient, 3, where)
    thickness = float(dataset.get("SliceThickness") or 0.0)
    told = thickness if 0.0 < thickness <= PLAUSIBLE_SPACING[1] else None
    return Slice(hu, position, axes, np.array([column_mm, row_mm]), told)


def _hounsfield(dataset: Any, data: bytes, where: str) -> npt.NDArray[np.int16]:
    slope, intercept = _numbers([dataset.RescaleSlope, dataset.RescaleIntercept], 2, where)
    if slope == 0.0:
        raise ImageError(f"the rescale slope of {where} is zero.")
    if dataset.file_meta.TransferSyntaxUID.is_compressed:
        stored = np.rint((_decoded_by_gdcm(data) - intercept) / slope)
    else:
        claimed = int(dataset.Rows) * int(dataset.Columns) * (int(dataset.BitsAllocated) // 8)
        check_length(len(dataset.PixelData), claimed, where=where.removeprefix("the "), padding=claimed % 2)
        stored = dataset.pixel_array
    if stored.shape != (int(dataset.Rows), int(dataset.Columns)):
        raise ImageError(f"{where} holds another number of pixels than it claims.")
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


def _numbers(values: Any, count: int, where: str) -> Floats:
    numbers = np.array([float(value) for value in values])
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ImageError(f"a position, direction, spacing or rescale of {where} is not made of finite numbers.")
    return numbers
