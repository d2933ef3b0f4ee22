"""Importing a head: a file of anybody's making is read and checked in one worker process, its bone made in another.

The page, the command line and the library all import through this module, so every head meets the same checks.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from ..errors import FrameError, InputError
from ..geometry.kernel_cache import cache_root
from ..geometry.mesh import TriangleMesh
from .bone import BoneSurfaces, bone_of_surface, bone_of_volume
from .frame_report import MM_PER_UNIT, FrameReport
from .head_files import read_ct_of_head, read_surface_of_head
from .isolated import Cancellation, run_isolated
from .mesh_files import MESH_SUFFIXES, is_mesh
from .readers import VOLUME_SUFFIXES, is_volume
from .surface_uncertainty import SurfaceUncertainty
from .volume import Volume

READ_SECONDS = 30.0
EXTRACT_SECONDS = 300.0

# Name of a stage, and how much of the whole is done.
Progress = Callable[[str, float], None]
Result = TypeVar("Result")


@dataclass(frozen=True)
class HeadRequest:
    """Which file to read, and what the user says of it.

    path: a CT file, a folder or zip of one DICOM series, or a surface.
    frame, unit: what the user says where the file does not ('LPS' or 'RAS', 'mm' or 'm').
    assume: take LPS mm where nobody says, and report that it was assumed, instead of raising FrameError.
    series: which one of several DICOM series, counted from 1; an error lists them.
    """

    path: Path
    _: KW_ONLY
    frame: str | None = None
    unit: str | None = None
    assume: bool = False
    series: int | None = None


@dataclass(frozen=True, eq=False)
class ReadHead:
    """A file's head, read and checked, LPS mm: its CT or its surface.

    frame: frame of the file, and whether it was assumed. notes: what is doubtful about the file, in sentences.
    """

    volume: Volume | None
    surface: TriangleMesh | None
    frame: FrameReport
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ControlHead:
    """A head to drive in: its bone, its CT where it has one, how far bone may lie off the surface, and the notes."""

    mesh: TriangleMesh
    scan: Volume | None
    uncertainty: SurfaceUncertainty
    notes: tuple[str, ...]


def no_progress(stage: str, fraction: float) -> None:
    """Report nothing."""


def is_head(path: Path) -> bool:
    """Whether there is a file or folder at the path whose name says that it may be a head."""
    return (is_mesh(path) or is_volume(path)) and path.exists()


def read_head(
    request: HeadRequest,
    progress: Progress = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> ReadHead:
    """What a file holds.

    Args:
        cancellation: ends the worker from another thread.
        folder: where the worker keeps its temporary files; the system's folder for such where there is none.

    Raises:
        FrameError: the file does not say its frame or unit and neither does the request; `missing` names them.
        InputError: the file cannot be used for another reason.
        OSError: the worker's files could not be written.
    """
    if not request.path.exists():
        raise InputError("there is no such file or folder.")
    isolate = partial(run_isolated, seconds=READ_SECONDS, cancellation=cancellation, folder=folder)
    told = request.path, request.frame, request.unit, request.assume, request.series
    if is_mesh(request.path):
        progress("Reading the surface", 0.0)
        mesh, report, notes = isolate(_read_surface, *told)
        return ReadHead(None, mesh, report, notes)
    if is_volume(request.path):
        progress("Reading the CT", 0.0)
        volume, report, notes = isolate(_read_volume, *told)
        return ReadHead(volume, None, report, notes)
    known = ", ".join((*VOLUME_SUFFIXES, *MESH_SUFFIXES))
    raise InputError(f"a case is made of {known}, or of a folder of DICOM files.")


def extract_bone(
    head: ReadHead,
    progress: Progress = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> BoneSurfaces:
    """Bone surfaces of a head that was read; arguments and OSError as in `read_head`.

    No decoder runs in this worker, so it alone may keep the kernels that it compiles.

    Raises:
        ImageError: there is no bone in the CT.
        MeshError: the surface cannot be used.
    """
    function, of = (bone_of_volume, head.volume) if head.surface is None else (bone_of_surface, head.surface)
    return run_isolated(
        function, of, seconds=EXTRACT_SECONDS, progress=progress, cancellation=cancellation, folder=folder,
        writable=_kernel_folders(),
    )  # fmt: skip


def control_head(
    request: HeadRequest, *, cancellation: Cancellation | None = None, folder: Path | None = None
) -> ControlHead:
    """The head that a case made of the file would be driven in; arguments and errors as in `read_head`."""
    head = read_head(request, cancellation=cancellation, folder=folder)
    if head.volume is None:
        assert head.surface is not None
        return ControlHead(head.surface, None, SurfaceUncertainty(0.0, 0.0), head.notes)
    bone = extract_bone(head, cancellation=cancellation, folder=folder)
    off = SurfaceUncertainty(bone.control_report.max_deviation_mm, head.volume.resolution_mm)
    return ControlHead(bone.control, head.volume, off, head.notes)


def _kernel_folders() -> list[Path]:
    return [cache_root(), *(Path(named) for named in [os.environ.get("NUMBA_CACHE_DIR")] if named)]


def _read_surface(
    path: Path, frame: str | None, unit: str | None, assume: bool, series: int | None
) -> tuple[TriangleMesh, FrameReport, tuple[str, ...]]:
    if series is not None:
        raise InputError("a series is chosen among those of a DICOM folder or zip, which this file is not.")
    return _read_or_ask(read_surface_of_head, path, frame, unit, assume)


def _read_volume(
    path: Path, frame: str | None, unit: str | None, assume: bool, series: int | None
) -> tuple[Volume, FrameReport, tuple[str, ...]]:
    return _read_or_ask(partial(read_ct_of_head, series=series), path, frame, unit, assume)


def _read_or_ask(read: Callable[..., Result], path: Path, frame: str | None, unit: str | None, assume: bool) -> Result:
    """Read a file. The frame or unit is asked for only where some answer would make the file readable."""
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
