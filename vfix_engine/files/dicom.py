"""Reader of one DICOM CT series from a folder or a zip, with a check that the slices form one regular stack; LPS mm.

Only the tags listed here are read. Apart from geometry, voxels, modality and the series description no value of a file
leaves this module: messages contain counts and measures, never text from a file.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError, SegmentationFound
from vfix_engine.files.dicom_enhanced import GROUPS, frames_of, is_enhanced
from vfix_engine.files.dicom_files import MAX_FILE_BYTES, OtherFiles, begins_as_dicom, contents, plain_name
from vfix_engine.files.dicom_pixels import (
    PIXEL_TAGS,
    PixelLayout,
    checked_layout,
    hounsfield,
    numbers,
    rescale,
    words_of_frames,
    words_of_slice,
)
from vfix_engine.files.dicom_rescale import unit_of
from vfix_engine.files.dicom_series import SeriesList, is_localizer
from vfix_engine.files.dicom_stack import Slice, left_out_words, stack
from vfix_engine.files.grid_header import MAX_VOXELS, PLAUSIBLE_SPACING
from vfix_engine.files.nrrd import INTO_A_CASE
from vfix_engine.files.volume import Volume

_TAGS = [
    "SOPClassUID",
    "Modality",
    "ImageType",
    "SeriesInstanceUID",
    "FrameOfReferenceUID",
    "NumberOfFrames",
    "PixelSpacing",
    "ImagePositionPatient",
    "ImageOrientationPatient",
    "SliceThickness",
    "WindowCenter",
    "WindowWidth",
    "SeriesDescription",  # displayed for the selection of a series; the name of a case if the user agrees
    *PIXEL_TAGS,
    *GROUPS,
]
# Prefixes of SOP classes that are not images but accompany the slices: the directory of the medium, presentation
# states, waveforms, raw data, reports, documents, and structures and plans of radiotherapy.
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
# CT and MR images, plain, enhanced, and converted from plain ones.
_OF_PIXELS = tuple(f"1.2.840.10008.5.1.4.1.1.{end}" for end in ("2", "2.1", "2.2", "4", "4.1", "4.4"))
CT_ONLY = ("CT",)
SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66."  # prefix of the SOP classes of segmentations
_DEFLATED = b"1.2.840.10008.1.2.1.99"
WINDOW_HU, LEVEL_HU = (1.0, 10_000.0), (-2000.0, 4000.0)  # accepted range of a suggested window


@dataclass(frozen=True, eq=False)
class ReadSeries:
    """A series as a volume. notes: sentences on what was omitted or resampled.

    description: the file's own, which may identify the patient (HAZ-33).
    """

    volume: Volume
    notes: tuple[str, ...]
    modality: str
    description: str


def read_series(path: Path, series: int | None = None, modalities: tuple[str, ...] = CT_ONLY) -> ReadSeries:
    """Read the CT series in a folder or zip.

    series: its number, from 1 in the order of the files' names; None if there is only one.
    modalities: accepted ones; an MR series keeps its values unchanged, and its enhanced form is not supported.

    Raises:
        ImageError: the series is not one regular stack, or the choice of a series is missing or wrong.
    """
    if path.is_file() and not path.name.lower().endswith(".zip"):
        return _read_one_file(path)
    found, others = SeriesList(modalities), OtherFiles()
    slices: list[Slice] = []
    scouts: list[str] = []
    voxels = 0
    fault: ImageError | None = None
    for count, (place, data) in enumerate(contents(path, others), start=1):
        where, told = f"the file {place.name!r:.80}", plain_name(place.name, count)
        if not begins_as_dicom(data):
            others.other(place, data)
            continue
        others.image(place)
        with pydicom_silenced():
            with fault_named(where):
                dataset = _dataset(data, where)
                number = _count(dataset, found, where)
            if fault is not None or number != (series or 1):
                continue
            if is_localizer(dataset):
                scouts.append(told)
                continue
            try:
                with fault_named(where):
                    more, aside = _slices_of(dataset, data, (where, told), modalities)
            except ImageError as error:
                fault = error  # the file may belong to another series than the selected one
                continue
        slices += more
        scouts += aside
        voxels += sum(one.hu.size for one in more)
        if voxels > MAX_VOXELS:
            raise ImageError(f"the series holds more than {MAX_VOXELS:,} voxels.")
    passed = others.check()
    chosen = found.chosen(series)
    if fault is not None:
        raise fault
    volume, notes = _stacked(slices, scouts)
    return ReadSeries(volume, (*passed, *notes), chosen.modality, chosen.description)


def _stacked(slices: list[Slice], scouts: list[str]) -> tuple[Volume, tuple[str, ...]]:
    """Stack the slices, and list what was omitted or resampled."""
    if scouts and not slices:
        raise ImageError("the series holds localizers (scout views) only, which are no slices; choose another one.")
    volume, notes = stack(slices)
    return volume, (*([left_out_words(scouts)] if scouts else []), *notes)


def _read_one_file(path: Path) -> ReadSeries:
    """Read one file of enhanced CT. Raises ImageError with the reason why another file is not a head."""
    if path.stat().st_size > MAX_FILE_BYTES:
        raise ImageError(f"the file is larger than {MAX_FILE_BYTES >> 20} MiB.")
    data, where = path.read_bytes(), "the file"
    with pydicom_silenced(), fault_named(where):
        dataset = _dataset(data, where)
        if str(dataset.get("SOPClassUID")).startswith(SEGMENTATION):
            raise SegmentationFound(f"the file is a DICOM segmentation, not a CT. {INTO_A_CASE}")
        if not is_enhanced(dataset):
            raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")
        found = SeriesList()
        found.count(dataset)
        slices, scouts = _slices_of(dataset, data, (where, where))
    chosen = found.chosen(None)
    return ReadSeries(*_stacked(slices, scouts), chosen.modality, chosen.description)


def _slices_of(
    dataset: Any, data: bytes, names: tuple[str, str], modalities: tuple[str, ...] = CT_ONLY
) -> tuple[list[Slice], list[str]]:
    """Return the slice of a file, or the slices of one with several frames, and the descriptions of its localizers.

    names: `where` and `told` of a slice.
    """
    where, told = names
    if not is_enhanced(dataset):
        _check_modality(dataset, where, modalities)
        _check_place(dataset, where)
        layout = checked_layout(dataset, where)
        return [_slice(dataset, words_of_slice(dataset, data, where), layout, names)], []
    _check_modality(dataset, where, CT_ONLY)
    count, size = int(dataset.get("NumberOfFrames") or 1), int(dataset.Rows) * int(dataset.Columns)
    if count * size > MAX_VOXELS:
        raise ImageError(f"{where} claims more than {MAX_VOXELS:,} voxels.")
    frames = frames_of(dataset, where)
    layout = checked_layout(dataset, where)
    stored = words_of_frames(dataset, where)
    made: list[Slice] = []
    scouts: list[str] = []
    for number, (frame, words) in enumerate(zip(frames, stored, strict=True), start=1):
        called = f"frame {number} of {where}", f"frame {number} of {told}"
        if is_localizer(frame):
            scouts.append(called[1])
            continue
        _check_place(frame, where)
        made.append(_slice(frame, words, layout, called))
    return made, scouts


def _count(dataset: Any, found: SeriesList, where: str) -> int:
    """Add an image to its series; returns the number of the series, from 1, or 0 for a file that is not an image.

    Raises ImageError for a file truncated before its pixels, whose series is then unreliable.
    """
    kind = str(dataset.get("SOPClassUID") or dataset.file_meta.get("MediaStorageSOPClassUID") or "")
    if kind.startswith(_NO_IMAGE):
        return 0
    if "PixelData" not in dataset and (not dataset.get("SeriesInstanceUID") or _has_pixels(kind)):
        raise ImageError(f"{where} begins as DICOM and has no pixels; it is cut off or damaged. Copy it again.")
    return found.count(dataset)


def _has_pixels(kind: str) -> bool:
    """Whether files of an SOP class have pixels, which a truncated file does not show."""
    from pydicom.uid import UID

    return kind in _OF_PIXELS or (kind.startswith("1.2.840.10008.") and not UID(kind).type)


def _dataset(data: bytes, where: str) -> Any:
    """Read the listed tags of a file. Raises ImageError."""
    import pydicom  # imported here: slow to load, and only needed for this format

    if not begins_as_dicom(data):
        raise ImageError(f"{where} is not DICOM.")
    if _DEFLATED in data[:4096]:
        raise ImageError(f"{where} is deflated as a whole, which is not read.")
    return pydicom.dcmread(io.BytesIO(data), specific_tags=list(_TAGS))


@contextmanager
def fault_named(where: str) -> Iterator[None]:
    """Convert any error of the decoder to an ImageError without its message, which may quote patient data."""
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
    """Suppress pydicom's warnings and log messages, which quote the file."""
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
    """Raise ImageError for another modality; an MR image without a rescale has its stored values."""
    modality = dataset.get("Modality")
    if modality not in modalities:
        raise ImageError(f"{where} is not a{' CT' if modalities == CT_ONLY else ' CT or an MR'} image.")
    if modality == "MR":
        dataset.RescaleSlope = 1.0 if dataset.get("RescaleSlope") is None else dataset.RescaleSlope
        dataset.RescaleIntercept = 0.0 if dataset.get("RescaleIntercept") is None else dataset.RescaleIntercept


def _check_place(dataset: Any, where: str) -> None:
    """Raise ImageError if an image is not a single one, or has no position in the patient."""
    if int(dataset.get("NumberOfFrames") or 1) != 1:
        raise ImageError(f"{where} is not a single grey image.")
    for keyword in ("SeriesInstanceUID", "ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        if not dataset.get(keyword):
            raise ImageError(f"{where} has no {keyword}; it cannot be placed in the patient.")
    rescale(dataset, where)


def _slice(dataset: Any, words: npt.NDArray[Any], layout: PixelLayout, names: tuple[str, str]) -> Slice:
    """Create a slice from its tags and its pixels."""
    where, told = names
    axes = numbers(dataset.ImageOrientationPatient, 6, where).reshape(2, 3).T
    if np.abs(axes.T @ axes - np.eye(2)).max() > 1e-3:
        raise ImageError(f"the row and column directions of {where} are not at right angles.")
    rotation, upper = np.linalg.qr(axes)  # removes the rounding of the stored direction cosines
    axes = rotation * np.sign(np.diag(upper))
    row_mm, column_mm = numbers(dataset.PixelSpacing, 2, where)
    if min(row_mm, column_mm) <= 0.0:
        raise ImageError(f"the PixelSpacing of {where} is {row_mm:g} x {column_mm:g} mm; it must be above 0.")
    hu = hounsfield(dataset, words, layout, where)
    position = numbers(dataset.ImagePositionPatient, 3, where)
    thickness = float(dataset.get("SliceThickness") or 0.0)
    thick = thickness if 0.0 < thickness <= PLAUSIBLE_SPACING[1] else None
    pixel_mm, by = np.array([column_mm, row_mm]), rescale(dataset, where)
    reference = str(dataset.get("FrameOfReferenceUID") or "")
    return Slice(hu, position, axes, pixel_mm, thick, _window(dataset), where, told, by, unit_of(dataset), reference)


def _window(dataset: Any) -> tuple[float, float] | None:
    """Width and centre of the first window that a file suggests; None if there is none that can be displayed."""
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
