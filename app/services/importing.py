"""A new case out of a CT or a surface: read in a worker, bone extracted, cleaned and thinned there, then stored."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from app.services.case_model import BONE, Case, CaseFrame
from app.services.cases import CaseService
from app.services.names import MAX_NAME, check_name
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.bone import BoneSurfaces, bone_of_surface, bone_of_volume
from vfix_engine.imaging.frame_report import FrameReport
from vfix_engine.imaging.isolated import Cancellation, run_isolated
from vfix_engine.imaging.mesh_files import MESH_SUFFIXES, is_mesh, read_mesh
from vfix_engine.imaging.readers import VOLUME_SUFFIXES, is_dicom, is_volume, read_volume
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
    """

    path: Path
    name: str | None = None
    frame: str | None = None
    unit: str | None = None
    assume: bool = False


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
        if not request.path.exists():
            raise InputError("there is no such file or folder.")
        if is_mesh(request.path):
            volume, bone, frame = self._surface(request, progress)
        elif is_volume(request.path):
            volume, bone, frame = self._volume(request, progress)
        else:
            known = ", ".join((*VOLUME_SUFFIXES, *MESH_SUFFIXES))
            raise InputError(f"a case is made of {known}, or of a folder of DICOM files.")
        progress("Storing the case", 0.95)
        surfaces: dict[str, TriangleMesh] = {BONE: bone.control, DISPLAY: bone.display}
        reports = {BONE: bone.control_report, DISPLAY: bone.display_report}
        case = self._cases.create(name, frame=frame, surfaces=surfaces, volume=volume, reports=reports)
        progress("Done", 1.0)
        return case

    def _surface(self, request: ImportRequest, progress: Progress) -> tuple[None, BoneSurfaces, CaseFrame]:
        progress("Reading the surface", 0.0)
        mesh, report = self._isolated(_read_surface, *_told(request), seconds=READ_SECONDS)
        bone = self._isolated(bone_of_surface, mesh, seconds=EXTRACT_SECONDS, progress=_part(progress, 0.3, 0.95))
        return None, bone, CaseFrame(report.name, report.assumed)

    def _volume(self, request: ImportRequest, progress: Progress) -> tuple[Volume, BoneSurfaces, CaseFrame]:
        progress("Reading the CT", 0.0)
        volume, report = self._isolated(_read_volume, *_told(request), seconds=READ_SECONDS)
        bone = self._isolated(bone_of_volume, volume, seconds=EXTRACT_SECONDS, progress=_part(progress, 0.3, 0.95))
        return volume, bone, CaseFrame(report.name, report.assumed)

    def _isolated(
        self, function: Callable[..., Result], *args: Any, seconds: float, progress: Progress | None = None
    ) -> Result:
        return run_isolated(function, *args, seconds=seconds, progress=progress, cancellation=self._cancellation)


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


def _told(request: ImportRequest) -> tuple[Path, str | None, str | None, bool]:
    """What a reader is told."""
    return request.path, request.frame, request.unit, request.assume


def _read_surface(path: Path, frame: str | None, unit: str | None, assume: bool) -> tuple[TriangleMesh, FrameReport]:
    return read_mesh(path, frame, unit, assume=assume)


def _read_volume(path: Path, frame: str | None, unit: str | None, assume: bool) -> tuple[Volume, FrameReport]:
    return read_volume(path, frame, unit, assume=assume)


def _part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a part of the whole."""
    return lambda stage, fraction: progress(stage, start + (end - start) * fraction)
