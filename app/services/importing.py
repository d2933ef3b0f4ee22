"""A new case out of a CT or a surface: read in a worker, bone extracted, cleaned and thinned there, then stored."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from app.services.case_model import Case, CaseFrame
from app.services.cases import CaseService
from app.services.names import MAX_NAME, check_name
from app.services.structures import BONE
from app.services.surface_uncertainty import SurfaceUncertainty
from app.store.errors import StorageError
from vfix_engine.errors import FrameError, InputError
from vfix_engine.geometry.kernel_cache import cache_root
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.bone import BoneSurfaces, bone_of_surface, bone_of_volume
from vfix_engine.imaging.frame_report import MM_PER_UNIT, FrameReport
from vfix_engine.imaging.head_files import read_ct_of_head, read_surface_of_head
from vfix_engine.imaging.isolated import Cancellation, run_isolated
from vfix_engine.imaging.mesh_files import MESH_SUFFIXES, is_mesh
from vfix_engine.imaging.readers import VOLUME_SUFFIXES, is_dicom, is_volume
from vfix_engine.imaging.volume import Volume

DISPLAY = "display"
DICOM_NAME = "CT series"
READ_SECONDS = 30.0
EXTRACT_SECONDS = 300.0

# Name of a stage, and how much of the whole is done.
Progress = Callable[[str, float], None]
Result = TypeVar("Result")


@dataclass(frozen=True)
class ImportRequest:
    """What to make a case of.

    path: a CT file, a folder or zip of one DICOM series, or a surface.
    name: of the case; None takes the file's.
    frame, unit: what the user says where the file does not ('LPS' or 'RAS', 'mm' or 'm').
    assume: take LPS mm where nobody says, and report that it was assumed, instead of asking.
    series: which one of several DICOM series, counted from 1; an error lists them.
    """

    path: Path
    name: str | None = None
    frame: str | None = None
    unit: str | None = None
    assume: bool = False
    series: int | None = None


@dataclass(frozen=True, eq=False)
class ReadHead:
    """A file's head, read and checked: its CT or its surface. notes: what is doubtful about it, in sentences."""

    volume: Volume | None
    surface: TriangleMesh | None
    frame: CaseFrame
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ControlHead:
    """A head to drive in: its bone, its CT where it has one, how far bone may lie off the surface, and the notes."""

    mesh: TriangleMesh
    scan: Volume | None
    uncertainty: SurfaceUncertainty
    notes: tuple[str, ...]


class ImportService:
    """Makes cases; a call takes seconds and may run in any thread."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._cancellation = Cancellation()

    def cancel(self) -> None:
        """End the import that runs, and take no other one; it fails unless it is being stored already."""
        self._cancellation.cancel()

    def run(self, request: ImportRequest, progress: Progress = lambda stage, fraction: None) -> Case:
        """Import and store.

        Raises FrameError, naming what is missing, when the file does not say its frame or unit and neither does the
        request; another InputError when the file cannot be used.
        """
        name = case_name(request)
        head = self.read(request, progress)
        bone = self._bone(head, progress)
        progress("Storing the case", 0.95)
        surfaces: dict[str, TriangleMesh] = {BONE: bone.control, DISPLAY: bone.display}
        reports = {BONE: bone.control_report, DISPLAY: bone.display_report}
        case = self._cases.create(
            name, frame=head.frame, surfaces=surfaces, volume=head.volume, notes=head.notes, reports=reports
        )
        progress("Done", 1.0)
        return case

    def read(self, request: ImportRequest, progress: Progress = lambda stage, fraction: None) -> ReadHead:
        """What a file holds. Every head comes in here, stored or not, and meets the same checks; raises as `run`."""
        if not request.path.exists():
            raise InputError("there is no such file or folder.")
        if is_mesh(request.path):
            progress("Reading the surface", 0.0)
            mesh, report, notes = self._decoded(_read_surface, request)
            return ReadHead(None, mesh, CaseFrame(report.name, report.assumed), notes)
        if is_volume(request.path):
            progress("Reading the CT", 0.0)
            volume, report, notes = self._decoded(_read_volume, request)
            return ReadHead(volume, None, CaseFrame(report.name, report.assumed), notes)
        known = ", ".join((*VOLUME_SUFFIXES, *MESH_SUFFIXES))
        raise InputError(f"a case is made of {known}, or of a folder of DICOM files.")

    def control_head(self, request: ImportRequest) -> ControlHead:
        """The head that a case made of the file would be driven in; nothing is stored."""
        head = self.read(request)
        if head.volume is None:
            assert head.surface is not None
            return ControlHead(head.surface, None, SurfaceUncertainty(0.0, 0.0), head.notes)
        bone = self._bone(head, lambda stage, fraction: None)
        off = SurfaceUncertainty(bone.control_report.max_deviation_mm, head.volume.resolution_mm)
        return ControlHead(bone.control, head.volume, off, head.notes)

    def _bone(self, head: ReadHead, progress: Progress) -> BoneSurfaces:
        """Bone out of checked arrays; no decoder runs here, so this worker alone may keep what it compiles."""
        part = _part(progress, 0.3, 0.95)
        extract, of = (bone_of_volume, head.volume) if head.surface is None else (bone_of_surface, head.surface)
        return self._isolated(extract, of, seconds=EXTRACT_SECONDS, progress=part, writable=_kernels())

    def _decoded(self, function: Callable[..., Result], request: ImportRequest) -> Result:
        """Decode a file of anybody's making."""
        told = request.path, request.frame, request.unit, request.assume, request.series
        return self._isolated(function, *told, seconds=READ_SECONDS)

    def _isolated(self, function: Callable[..., Result], *args: Any, **options: Any) -> Result:
        folder = self._cases.scratch.open()  # for what the worker decodes
        try:
            return run_isolated(function, *args, cancellation=self._cancellation, folder=folder, **options)
        except OSError as error:
            raise StorageError(f"the import could not be written down: {error.strerror or error}.") from error


def _kernels() -> list[Path]:
    """Folders of compiled kernels."""
    return [cache_root(), *(Path(named) for named in [os.environ.get("NUMBA_CACHE_DIR")] if named)]


def case_name(request: ImportRequest) -> str:
    """Name of the new case: the one asked for, or the file's stem without what a name may not hold.

    A DICOM series is never named after its file: hospitals put the patient's name there.
    """
    if request.name is not None:
        return check_name(request.name.strip(), "case's name")
    if is_dicom(request.path):
        return DICOM_NAME
    stem = re.sub(r"(?i)\.(nii\.gz|[a-z0-9]+)$", "", request.path.name)
    return re.sub(r"[^\w.()+-]+", " ", stem).strip()[:MAX_NAME] or "Imported case"


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
    """Read a file. Nobody is asked for the frame or unit of one that no answer would make readable."""
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


def _part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a part of the whole."""
    return lambda stage, fraction: progress(stage, start + (end - start) * fraction)
