"""Reader of one DICOM CT series from a folder or a zip: slices are checked to form one regular stack; LPS mm.

Only the tags listed here are read. Apart from geometry and voxels no value of a file leaves this module: messages
contain counts and measures, never text from a file.
"""

from __future__ import annotations

import io
import logging
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError, SegmentationFound
from vfix_engine.imaging.dicom_enhanced import GROUPS, frames_of, is_enhanced
from vfix_engine.imaging.dicom_files import MAX_FILE_BYTES, contents
from vfix_engine.imaging.dicom_series import SeriesList
from vfix_engine.imaging.grid_header import MAX_VOXELS, PLAUSIBLE_SPACING, check_length, check_sizes, check_transform
from vfix_engine.imaging.itk import decode
from vfix_engine.imaging.nrrd import INTO_A_CASE
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
    "WindowCenter",
    "WindowWidth",
    "PixelPaddingValue",
    "PixelPaddingRangeLimit",
    "PixelData",
    "SeriesDescription",  # shown where one of several series is chosen, and kept nowhere
    *GROUPS,
]
# Prefixes of SOP classes that are not images but lie beside the slices: the
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
CT_ONLY = ("CT",)
SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66."  # the beginning of the SOP classes of segmentations
_DEFLATED = b"1.2.840.10008.1.2.1.99"
# Whose packed frames pydicom decodes with what vfix installs; one slice is decoded by GDCM.
_FRAMES_UNPACKED = ("1.2.840.10008.1.2.5", "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81")
WINDOW_HU, LEVEL_HU = (1.0, 10_000.0), (-2000.0, 4000.0)  # of a window that is taken over
_MAX_SIDE = 4096  # [pixel]
_POSITION_ROUNDING = 0.02  # [mm] positions are written with two decimals by some scanners
_GAP_TOLERANCE = 0.01  # of the spacing
_SAME_DIRECTION = 1e-4


@dataclass(frozen=True)
class Slice:
    """One slice. hu: (rows, columns) int16; the rest is geometry in LPS mm.

    pixel_mm: (2,) distance between columns and between rows. axes: (3, 2) unit directions along a row and a column.
    thickness_mm: None where the file does not say it. window: width and centre that the file suggests; None for none.
    """

    hu: npt.NDArray[np.int16]
    position: Floats
    axes: Floats
    pixel_mm: Floats
    thickness_mm: float | None
    window: tuple[float, float] | None = None


def read_series(path: Path, series: int | None = None, modalities: tuple[str, ...] = CT_ONLY) -> Volume:
    """The CT series in a folder or zip.

    series: which one, counted from 1 in the order of the files' names; None where there is only one.
    modalities: those that are taken; an MR series comes with its values as they are, and its enhanced form is not read.

    Raises:
        ImageError: the series is not one regular stack, or the choice of a series is missing or wrong.
    """
    if path.is_file() and not path.name.lower().endswith(".zip"):
        return _read_one_file(path)
    found = SeriesList(modalities)
    slices: list[Slice] = []
    voxels = 0
    fault: ImageError | None = None
    for name, data in contents(path):
        where = f"the file {name!r:.80}"
        with pydicom_silenced():
            with fault_named(where):
                dataset = _dataset(data, where)
                number = _count(dataset, found)
            if fault is not None or number != (series or 1):
                continue
            try:
                with fault_named(where):
                    more = _slices_of(dataset, data, where, modalities)
            except ImageError as error:
                fault = error  # this may be another series than the chosen one
                continue
        slices += more
        voxels += sum(one.hu.size for one in more)
        if voxels > MAX_VOXELS:
            raise ImageError(f"the series holds more than {MAX_VOXELS:,} voxels.")
    found.check_choice(series)
    if fault is not None:
        raise fault
    return stack(slices)


def _read_one_file(path: Path) -> Volume:
    """The volume in one file of enhanced CT. Raises ImageError, with the reason that another one is no head."""
    if path.stat().st_size > MAX_FILE_BYTES:
        raise ImageError(f"the file is larger than {MAX_FILE_BYTES >> 20} MiB.")
    data, where = path.read_bytes(), "the file"
    with pydicom_silenced(), fault_named(where):
        dataset = _dataset(data, where)
        if str(dataset.get("SOPClassUID")).startswith(SEGMENTATION):
            raise SegmentationFound(f"the file is a DICOM segmentation, not a CT. {INTO_A_CASE}")
        if not is_enhanced(dataset):
            raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")
        slices = _slices_of(dataset, data, where)
    return stack(slices)


def _slices_of(dataset: Any, data: bytes, where: str, modalities: tuple[str, ...] = CT_ONLY) -> list[Slice]:
    """The slice of a file, or the slices of one with several frames."""
    if not is_enhanced(dataset):
        _check_modality(dataset, where, modalities)
        return [_checked_slice(dataset, where, lambda: _stored(dataset, data, where))]
    _check_modality(dataset, where, CT_ONLY)
    count, size = int(dataset.get("NumberOfFrames") or 1), int(dataset.Rows) * int(dataset.Columns)
    if count * size > MAX_VOXELS:
        raise ImageError(f"{where} claims more than {MAX_VOXELS:,} voxels.")
    frames = frames_of(dataset, where)
    stored = _stored_frames(dataset, where).reshape(count, int(dataset.Rows), int(dataset.Columns))
    return [_checked_slice(frame, where, lambda n=number: stored[n]) for number, frame in enumerate(frames)]  # type: ignore[misc]


def _stored_frames(dataset: Any, where: str) -> npt.NDArray[Any]:
    """The stored values of all frames. Raises ImageError where they are packed in a way that is not read."""
    syntax = dataset.file_meta.TransferSyntaxUID
    if syntax.is_compressed and syntax not in _FRAMES_UNPACKED:
        raise ImageError(
            f"the frames of {where} are packed as {syntax.name}, which is not read for enhanced CT; export it "
            "unpacked, or as JPEG-LS or RLE."
        )
    if not syntax.is_compressed:
        _check_stored_length(dataset, int(dataset.get("NumberOfFrames") or 1), where)
    values: npt.NDArray[Any] = dataset.pixel_array
    return values


def _stored(dataset: Any, data: bytes, where: str) -> npt.NDArray[Any]:
    """The stored values of a file of one slice."""
    if dataset.file_meta.TransferSyntaxUID.is_compressed:
        slope, intercept = _numbers([dataset.RescaleSlope, dataset.RescaleIntercept], 2, where)
        unpacked: npt.NDArray[Any] = np.rint((_decoded_by_gdcm(data) - intercept) / slope)
        return unpacked
    _check_stored_length(dataset, 1, where)
    values: npt.NDArray[Any] = dataset.pixel_array
    return values


def _check_stored_length(dataset: Any, frames: int, where: str) -> None:
    claimed = frames * int(dataset.Rows) * int(dataset.Columns) * (int(dataset.BitsAllocated) // 8)
    check_length(len(dataset.PixelData), claimed, where=where.removeprefix("the "), padding=claimed % 2)


def _count(dataset: Any, found: SeriesList) -> int:
    """Count an image to its series; returns the number of the series, from 1, or 0 for a file that is no image."""
    kind = dataset.get("SOPClassUID") or dataset.file_meta.get("MediaStorageSOPClassUID")
    return 0 if str(kind).startswith(_NO_IMAGE) else found.count(dataset)


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
    windows = [one.window for one in slices if one.window is not None]
    window = tuple(np.median(windows, axis=0).tolist()) if windows else None
    return volume_of(np.stack([one.hu for one in ordered]), check_transform(transform, 1.0), thickness, window)


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
    """The listed tags of a file. Raises ImageError."""
    import pydicom  # imported here: slow to load, and only needed for this format

    if data[128:132] != b"DICM":
        raise ImageError(f"{where} is not DICOM.")
    if _DEFLATED in data[:4096]:
        raise ImageError(f"{where} is deflated as a whole, which is not read.")
    return pydicom.dcmread(io.BytesIO(data), specific_tags=list(_TAGS))


@contextmanager
def fault_named(where: str) -> Iterator[None]:
    """Turn any error of the decoder into an ImageError without its message, which may quote patient data."""
    try:
        yield
    except ImageError:
        raise
    except RecursionError:
        raise ImageError(f"{where} is nested too deeply.") from None
    except Exception as error:
        raise ImageError(f"{where} cannot be read ({type(error).__name__}); it is damaged.") from None


@contextmanager
def pydicom_silenced() -> Iterator[None]:
    """Silence pydicom's warnings and log lines, which quote the file."""
    logger = logging.getLogger("pydicom")
    before = logger.disabled
    logger.disabled = True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.disabled = before


def _check_modality(dataset: Any, where: str, modalities: tuple[str, ...]) -> None:
    """Raise ImageError for another modality; an MR image without a rescale has its values as they are."""
    modality = dataset.get("Modality")
    if modality not in modalities:
        raise ImageError(f"{where} is not a{' CT' if modalities == CT_ONLY else ' CT or an MR'} image.")
    if modality == "MR":
        dataset.RescaleSlope = 1.0 if dataset.get("RescaleSlope") is None else dataset.RescaleSlope
        dataset.RescaleIntercept = 0.0 if dataset.get("RescaleIntercept") is None else dataset.RescaleIntercept


def _checked_slice(dataset: Any, where: str, stored: Callable[[], npt.NDArray[Any]]) -> Slice:
    """A slice out of its tags; stored: gives its stored values, once the tags are checked."""
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
    hu = _hounsfield(dataset, stored, where)
    position = _numbers(dataset.ImagePositionPatient, 3, where)
    thickness = float(dataset.get("SliceThickness") or 0.0)
    thick = thickness if 0.0 < thickness <= PLAUSIBLE_SPACING[1] else None
    return Slice(hu, position, axes, np.array([column_mm, row_mm]), thick, _window(dataset))


def _window(dataset: Any) -> tuple[float, float] | None:
    """Width and centre of the first window that a file suggests; None where there is none that can be drawn."""
    found = []
    for keyword in ("WindowWidth", "WindowCenter"):
        value = dataset.get(keyword)
        first = value[0] if isinstance(value, (list, tuple)) or (hasattr(value, "__len__") and value) else value
        try:
            found.append(float(first))
        except (TypeError, ValueError):
            return None
    width, centre = found
    fits = WINDOW_HU[0] <= width <= WINDOW_HU[1] and LEVEL_HU[0] <= centre <= LEVEL_HU[1]
    return (width, centre) if fits else None


def _hounsfield(dataset: Any, values: Callable[[], npt.NDArray[Any]], where: str) -> npt.NDArray[np.int16]:
    slope, intercept = _numbers([dataset.RescaleSlope, dataset.RescaleIntercept], 2, where)
    if slope == 0.0:
        raise ImageError(f"the rescale slope of {where} is zero.")
    stored = values()
    if stored.shape != (int(dataset.Rows), int(dataset.Columns)):
        raise ImageError(f"{where} holds another number of pixels than it claims.")
    hu = to_hu(stored * slope + intercept)
    hu[_padding(dataset, stored)] = AIR_HU
    return hu


def _padding(dataset: Any, stored: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Mask of padding pixels outside the scanner's field of view, by their stored value or range."""
    value = dataset.get("PixelPaddingValue")
    if value is None:
        return np.zeros(stored.shape, dtype=np.bool_)
    limit = dataset.get("PixelPaddingRangeLimit")
    low, high = sorted((int(value), int(value if limit is None else limit)))
    return (stored >= low) & (stored <= high)


def _decoded_by_gdcm(data: bytes) -> Floats:
    """(rows, columns) rescaled values of a compressed slice, through a temporary file, since GDCM reads files only."""
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
