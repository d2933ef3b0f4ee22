"""Reader of a volume that is laid over a head: an MR or another CT. Its values are only looked at."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError
from vfix_engine.imaging.detached import files_of, is_header
from vfix_engine.imaging.frame_report import FrameReport
from vfix_engine.imaging.head_files import assumption, check_size
from vfix_engine.imaging.head_import import READ_SECONDS, HeadRequest, read_or_ask
from vfix_engine.imaging.isolated import Cancellation, run_isolated
from vfix_engine.imaging.readers import VOLUME_SUFFIXES, is_volume, read_volume
from vfix_engine.imaging.volume import Volume, check_finite
from vfix_engine.progress import ProgressCallback, no_progress

_SHADES = 4000  # of values that are scaled
_FEW = 500  # values over a smaller range are scaled: fractions would be lost
_SHARES = (0.02, 0.995)  # of the voxels, that the first window leaves black and white
_MOST = 2_000_000  # voxels that the window is found from


@dataclass(frozen=True, eq=False)
class OverlayVolume:
    """A volume to look at. window, level: its values from black to white, and the value in their middle.

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
    """Read a volume in a worker process, with sentences on what is doubtful about its file.

    DICOM of the modalities CT and MR, NRRD, NIfTI and MetaImage; arguments and errors as of `head_import.read_head`.
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
    """Values as int16: as they are where that loses nothing, else scaled, which a sentence in `notes` says."""
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
    """Window and level that show nearly all of the values."""
    sample = values.reshape(-1)[:: max(1, values.size // _MOST)]
    low, high = (float(value) for value in np.quantile(sample, _SHARES))
    return max(high - low, 1.0), (low + high) / 2.0
