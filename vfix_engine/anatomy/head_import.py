"""Import of a head: one worker process reads and checks an untrusted file, another extracts the bone.

Page, command line and library import through this module, so that every head passes the same checks.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from ..errors import FrameError, InputError
from ..files.detached import files_of, is_header
from ..files.frame_report import MM_PER_UNIT, FrameReport
from ..files.mesh_files import is_mesh, mesh_suffixes
from ..files.readers import VOLUME_SUFFIXES, is_volume
from ..files.sandbox.isolated import Cancellation, run_isolated
from ..files.volume import Volume
from ..geometry.mesh import TriangleMesh
from ..kernels.kernel_cache import cache_root
from ..progress import ProgressCallback, no_progress
from .bone import BoneSurfaces, bone_of_surface, bone_of_volume
from .head_files import read_ct_of_head, read_surface_of_head
from .surface_uncertainty import SurfaceUncertainty, uncertainty_of

READ_SECONDS = 30.0
EXTRACT_SECONDS = 300.0

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class HeadRequest:
    """The file to read, and what the user states about it.

    path: a CT file, a folder or zip of one DICOM series, or a surface.
    frame, unit: 'LPS' or 'RAS', 'mm' or 'm', if the file does not state them.
    assume: if neither states them, assume LPS mm and report it instead of raising FrameError.
    series: number of one of several DICOM series, from 1; an error lists them.
    """

    path: Path
    _: KW_ONLY
    frame: str | None = None
    unit: str | None = None
    assume: bool = False
    series: int | None = None


@dataclass(frozen=True, eq=False)
class ReadHead:
    """A head that was read and checked, in LPS mm: its CT or its surface.

    frame: frame and unit of the file. notes: sentences on doubts about the file.
    """

    volume: Volume | None
    surface: TriangleMesh | None
    frame: FrameReport
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ControlHead:
    """A head for control: bone surface, CT if there is one, uncertainty of the surface, and notes."""

    mesh: TriangleMesh
    scan: Volume | None
    uncertainty: SurfaceUncertainty
    notes: tuple[str, ...]


def is_head(path: Path) -> bool:
    """Whether the path exists and its name is that of a volume or a mesh."""
    return (is_mesh(path) or is_volume(path)) and path.exists()


def read_head(
    request: HeadRequest,
    progress: ProgressCallback = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> ReadHead:
    """Read and check a head in a worker process.

    Args:
        request: the file and what the user states about it.
        progress: called with a stage and the completed fraction.
        cancellation: ends the worker from another thread.
        folder: for temporary files of the worker; None selects the system's.

    Raises:
        FrameError: neither file nor request names frame or unit; `missing` lists them.
        InputError: the file cannot be used for another reason.
        OSError: the worker's files could not be written.
    """
    if not request.path.exists():
        raise InputError("there is no such file or folder.")
    isolate = partial(run_isolated, seconds=READ_SECONDS, cancellation=cancellation, folder=folder)
    options = request.path, request.frame, request.unit, request.assume, request.series
    if is_mesh(request.path):
        progress("Reading the surface", 0.0)
        mesh, report, notes = isolate(_read_surface, *options)
        return ReadHead(None, mesh, report, notes)
    if is_volume(request.path):
        progress("Reading the CT", 0.0)
        files = files_of(request.path) if is_header(request.path) else ()
        volume, report, notes = isolate(_read_volume, *options, files)
        return ReadHead(volume, None, report, notes)
    known = ", ".join((*VOLUME_SUFFIXES, *mesh_suffixes()))
    raise InputError(f"a case is made of {known}, or of a folder of DICOM files.")


def extract_bone(
    head: ReadHead,
    progress: ProgressCallback = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> BoneSurfaces:
    """Extract the bone surfaces of a head that was read; arguments and OSError as in `read_head`.

    No decoder runs in this worker, so it may write to the cache of compiled kernels.

    Raises:
        ImageError: there is no bone in the CT.
        MeshError: the surface cannot be used.
    """
    function, of = (bone_of_volume, head.volume) if head.surface is None else (bone_of_surface, head.surface)
    return run_isolated(
        function, of, seconds=EXTRACT_SECONDS, progress=progress, cancellation=cancellation, folder=folder,
        writable=kernel_folders(),
    )  # fmt: skip


def control_head(
    request: HeadRequest, *, cancellation: Cancellation | None = None, folder: Path | None = None
) -> ControlHead:
    """Read a file and extract the head for control; arguments and errors as in `read_head` and `extract_bone`."""
    head = read_head(request, cancellation=cancellation, folder=folder)
    if head.volume is None:
        assert head.surface is not None
        return ControlHead(head.surface, None, SurfaceUncertainty(0.0, 0.0), head.notes)
    bone = extract_bone(head, cancellation=cancellation, folder=folder)
    off = uncertainty_of(bone.control_report, head.volume.resolution_mm)
    return ControlHead(bone.control, head.volume, off, (*head.notes, *bone.notes))


def kernel_folders() -> list[Path]:
    """Folders that a worker may write to besides its own, in which no decoder runs."""
    return [cache_root(), *(Path(named) for named in [os.environ.get("NUMBA_CACHE_DIR")] if named)]


def _read_surface(
    path: Path, frame: str | None, unit: str | None, assume: bool, series: int | None
) -> tuple[TriangleMesh, FrameReport, tuple[str, ...]]:
    if series is not None:
        raise InputError("a series is chosen among those of a DICOM folder or zip, which this file is not.")
    return read_or_ask(read_surface_of_head, path, frame, unit, assume)


def _read_volume(
    path: Path,
    frame: str | None,
    unit: str | None,
    assume: bool,
    series: int | None,
    files: tuple[Path, ...] = (),
) -> tuple[Volume, FrameReport, tuple[str, ...]]:
    return read_or_ask(partial(read_ct_of_head, series=series, files=files), path, frame, unit, assume)


def read_or_ask(read: Callable[..., _Result], path: Path, frame: str | None, unit: str | None, assume: bool) -> _Result:
    """Read a file. A missing frame or unit is reported only if some answer would make the file readable."""
    try:
        return read(path, frame, unit, assume=assume)
    except FrameError as question:
        if not question.missing:
            raise
        refusals = []
        for tried in MM_PER_UNIT if "unit" in question.missing else (unit,):
            try:
                read(path, frame, tried, assume=True)
            except InputError as refusal:
                refusals.append(refusal)
            else:
                raise question from None
        raise refusals[0] from None
