"""A new case out of a CT or a surface: read and its bone made by the engine's import, then stored."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from app.services.case_model import Case, CaseFrame
from app.services.cases import CaseService
from app.services.names import MAX_NAME, check_name
from app.services.structures import BONE
from app.store.errors import StorageError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.head_import import (
    ControlHead,
    HeadRequest,
    Progress,
    control_head,
    extract_bone,
    no_progress,
    read_head,
)
from vfix_engine.imaging.isolated import Cancellation
from vfix_engine.imaging.readers import is_dicom

DISPLAY = "display"
DICOM_NAME = "CT series"


@dataclass(frozen=True, kw_only=True)
class ImportRequest(HeadRequest):
    """What to make a case of. name: of the case; None takes the file's."""

    name: str | None = None


class ImportService:
    """Makes cases; a call takes seconds and may run in any thread."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._cancellation = Cancellation()

    def cancel(self) -> None:
        """End every import that runs, and take no other one; it fails unless it is being stored already."""
        self._cancellation.cancel()

    def cancellation(self) -> Cancellation:
        """What ends one import, for `run`."""
        return Cancellation(within=self._cancellation)

    def run(
        self, request: ImportRequest, progress: Progress = no_progress, cancellation: Cancellation | None = None
    ) -> Case:
        """Import and store.

        cancellation: ends the worker of this import from another thread.
        Raises FrameError, naming what is missing, when the file does not say its frame or unit and neither does the
        request; another InputError when the file cannot be used.
        """
        name, ends = case_name(request), cancellation or self._cancellation
        with self._storage_errors():
            folder = self._cases.scratch.open()  # for what the worker decodes
            head = read_head(request, progress, cancellation=ends, folder=folder)
            part = _part(progress, 0.3, 0.95)
            bone = extract_bone(head, part, cancellation=ends, folder=folder)
        progress("Storing the case", 0.95)
        surfaces: dict[str, TriangleMesh] = {BONE: bone.control, DISPLAY: bone.display}
        reports = {BONE: bone.control_report, DISPLAY: bone.display_report}
        frame = CaseFrame(head.frame.name, head.frame.assumed)
        return self._cases.create(
            name, frame=frame, surfaces=surfaces, volume=head.volume, notes=head.notes, reports=reports
        )

    def control_head(self, request: HeadRequest) -> ControlHead:
        """The head that a case made of the file would be driven in; nothing is stored."""
        with self._storage_errors():
            return control_head(request, cancellation=self._cancellation, folder=self._cases.scratch.open())

    @contextmanager
    def _storage_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise StorageError(f"the import could not be written down: {error.strerror or error}.") from error


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


def _part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a part of the whole."""
    return lambda stage, fraction: progress(stage, start + (end - start) * fraction)
