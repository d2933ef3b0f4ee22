"""Reader of a volume that is overlaid on a head, an MR or another CT, for display only."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.head_files import assumption, check_size
from vfix_engine.anatomy.head_import import READ_SECONDS, HeadRequest, read_or_ask
from vfix_engine.errors import ImageError
from vfix_engine.files.detached import files_of, is_header
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.readers import VOLUME_SUFFIXES, is_volume, read_volume
from vfix_engine.files.sandbox.isolated import Cancellation, run_isolated
from vfix_engine.files.volume import Volume, check_finite
from vfix_engine.progress import ProgressCallback, no_progress

_SHADES = 4000  # number of grey levels of scaled values
_FEW = 500  # values with a smaller range are scaled, since rounding would lose their fractions
_SHARES = (0.02, 0.995)  # quantiles of the voxels that the initial window maps to black and white
_MOST = 2_000_000  # largest number of voxels from which the window is computed


@dataclass(frozen=True, eq=False)
class OverlayVolume:
    """A volume for display. window, level: range of values from black to white, and the value in the middle.

    modality, description: as in `FrameReport`.
    """

    volume: Volume
    window: float
    level: float
    modality: str = ""
    description: str = ""


def read_overlay(
    request: HeadRequest,
    progress: ProgressCallback = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> tuple[OverlayVolume, tuple[str, ...]]:
    """Read a volume in a worker process, and list doubts about its file.

    DICOM of the modalities CT and MR, NRRD, NIfTI and MetaImage; arguments and errors as in `head_import.read_head`.
    """
    if not request.path.exists():
        raise ImageError("there is no such file or folder.")
    if not is_volume(request.path):
        raise ImageError(f"a volume is read from {', '.join(VOLUME_SUFFIXES)} or a folder of DICOM files.")
    progress("Reading the volume", 0.0)
    files = files_of(request.path) if is_header(request.path) else ()
    options = request.path, request.frame, request.unit, request.assume, request.series, files
    volume, report, notes = run_isolated(
        _read, *options, seconds=READ_SECONDS, cancellation=cancellation, folder=folder
    )
    return OverlayVolume(volume, *first_window(volume.hu), report.modality, report.description), notes


def _read(
    path: Path, frame: str | None, unit: str | None, assume: bool, series: int | None, files: tuple[Path, ...]
) -> tuple[Volume, FrameReport, tuple[str, ...]]:
    return read_or_ask(partial(_read_and_check, series=series, files=files), path, frame, unit, assume)


def _read_and_check(
    path: Path, frame: str | None, unit: str | None, *, assume: bool, series: int | None, files: tuple[Path, ...]
) -> tuple[Volume, FrameReport, tuple[str, ...]]:
    scaled: list[str] = []
    convert = partial(to_shades, notes=scaled)
    report: FrameReport
    volume, report = read_volume(
        path, frame, unit, assume=assume, series=series, files=files, modalities=("CT", "MR"), convert=convert
    )
    return volume, report, (*assumption(report), *check_size(volume, report), *scaled)


def to_shades(values: npt.NDArray[Any], notes: list[str]) -> npt.NDArray[np.int16]:
    """Convert values to int16: unchanged if lossless, else scaled, which is stated by a sentence in `notes`."""
    check_finite(values)
    low, high = float(values.min()), float(values.max())
    if low == high:
        raise ImageError("all voxels have one value; there is nothing to see in it.")
    limits = np.iinfo(np.int16)
    whole = np.issubdtype(values.dtype, np.integer)
    if limits.min < low and high <= limits.max and (whole or high - low >= _FEW):
        kept: npt.NDArray[np.int16] = np.rint(values).astype(np.int16)
        return kept
    notes.append(f"Its values from {low:g} to {high:g} are shown as 0 to {_SHADES}.")
    scaled: npt.NDArray[np.int16] = np.rint((values - low) * (_SHADES / (high - low))).astype(np.int16)
    return scaled


def first_window(values: npt.NDArray[np.int16]) -> tuple[float, float]:
    """Window and level that display nearly all values."""
    sample = values.reshape(-1)[:: max(1, values.size // _MOST)]
    low, high = (float(value) for value in np.quantile(sample, _SHARES))
    return max(high - low, 1.0), (low + high) / 2.0
