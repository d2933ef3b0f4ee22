"""Imports: a new case from a CT or a surface, and structures or overlay volumes of an existing case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from app.cases.import_names import Sort, WantedName
from app.cases.model import Case, CaseFrame, Overlay
from app.cases.overlays import Overlays
from app.cases.segments import CaseStructures
from app.cases.service import CaseService
from app.cases.structures import BONE, LUMEN, CaseKind, Structure
from app.store.errors import StorageError
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.head_import import (
    ControlHead,
    HeadRequest,
    control_head,
    extract_bone,
    read_head,
)
from vfix_engine.anatomy.labels.reading import SegmentationRequest, read_segmentation
from vfix_engine.anatomy.overlay import read_overlay
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import is_mesh
from vfix_engine.files.sandbox.isolated import Cancellation
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback, no_progress

DISPLAY = "display"


@dataclass(frozen=True, kw_only=True)
class ImportRequest(HeadRequest):
    """A file to import as a case.

    name: of the case; None for a generic one, or with use_description for the series description of the file, if it has
    one (HAZ-33). names: a table of label names, kept for the case that the file is a segmentation.
    kind: of case; a lumen is made of a surface, its wall, which is used as it is.
    """

    name: str | None = None
    use_description: bool = False
    names: Path | None = None
    kind: CaseKind = "head"

    @property
    def wanted(self) -> WantedName:
        """The requested name."""
        return WantedName(self.name, self.use_description, "case")

    @property
    def sort(self) -> Sort:
        """Generic name of a head from this file."""
        return "Surface" if is_mesh(self.path) else "CT"


@dataclass(frozen=True)
class _Parts:
    """Surfaces of a new case by name, what making them cost, and doubts about them."""

    surfaces: Mapping[str, TriangleMesh]
    reports: Mapping[str, SurfaceReport] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class OverlayRequest(HeadRequest):
    """A file to import as an overlay volume. name, use_description: of the volume, as in `ImportRequest`."""

    name: str | None = None
    use_description: bool = False

    @property
    def wanted(self) -> WantedName:
        """The requested name."""
        return WantedName(self.name, self.use_description, "volume")


class ImportService:
    """Imports files. A call takes seconds and may run in any thread."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._structures, self._overlays = CaseStructures(cases), Overlays(cases)
        self._cancellation = Cancellation()

    def cancel(self) -> None:
        """Cancel all running imports that are not being stored yet, and refuse new ones."""
        self._cancellation.cancel()

    def cancellation(self) -> Cancellation:
        """Return an object that cancels one import, for `run`."""
        return Cancellation(within=self._cancellation)

    def run(
        self, request: ImportRequest, progress: ProgressCallback = no_progress, cancellation: Cancellation | None = None
    ) -> Case:
        """Import a file and store the case.

        cancellation: ends the worker of this import from another thread.
        Raises FrameError, which names what is missing, if neither the file nor the request states the frame or unit,
        and another InputError if the file cannot be used.
        """
        request.wanted.check()
        if request.kind == "lumen" and not is_mesh(request.path):
            raise InputError("a lumen is made of a surface of its wall.")
        ends = cancellation or self._cancellation
        with self._storage_errors():
            folder = self._cases.scratch.open()  # for the decoded data of the worker
            read = read_head(request, progress, cancellation=ends, folder=folder)
            parts = _Parts({LUMEN: read.surface}) if request.kind == "lumen" and read.surface is not None else None
            if parts is None:
                bone = extract_bone(read, _part(progress, 0.3, 0.95), cancellation=ends, folder=folder)
                parts = _Parts(
                    {BONE: bone.control, DISPLAY: bone.display},
                    {BONE: bone.control_report, DISPLAY: bone.display_report},
                    tuple(bone.notes),
                )
        progress("Storing the case", 0.95)
        frame = CaseFrame(read.frame.name, read.frame.assumed)
        taken = {case.name for case in self._cases.list(include_deleted=True)}
        name, name_notes = request.wanted.among(taken, request.sort, read.frame.description)
        notes = (*read.notes, *parts.notes, *name_notes)
        return self._cases.create(
            name, frame=frame, surfaces=parts.surfaces, volume=read.volume, notes=notes, reports=parts.reports,
            kind=request.kind,
        )  # fmt: skip

    def check_case(self, case_id: str) -> None:
        """Raise NotFound if there is no such case."""
        self._cases.get(case_id)

    def add_structures(
        self,
        case_id: str,
        request: SegmentationRequest,
        progress: ProgressCallback = no_progress,
        cancellation: Cancellation | None = None,
    ) -> tuple[Structure, ...]:
        """Import a segmentation into a case and return the new structures.

        Raises NotFound, FrameError as `run`, and another InputError if the file cannot be used.
        """
        ends = cancellation or self._cancellation
        with self._storage_errors():
            progress("Comparing it with the case", 0.0)
            place = self._structures.place(case_id)
            part = _part(progress, 0.1, 0.9)
            folder = self._cases.scratch.open()
            found = read_segmentation(request, place, part, cancellation=ends, folder=folder)
        progress("Storing the structures", 0.9)
        return self._structures.add(case_id, found)

    def add_overlay(
        self,
        case_id: str,
        request: OverlayRequest,
        progress: ProgressCallback = no_progress,
        cancellation: Cancellation | None = None,
    ) -> Overlay:
        """Import an overlay volume into a case: DICOM of CT or MR, or an image file.

        Raises NotFound, FrameError as `run`, and another InputError if the file cannot be used.
        """
        request.wanted.check()
        ends = cancellation or self._cancellation
        self._overlays.check_room(case_id)
        with self._storage_errors():
            found, notes = read_overlay(request, progress, cancellation=ends, folder=self._cases.scratch.open())
        progress("Storing the volume", 0.9)
        with self._storage_errors():
            return self._overlays.add(case_id, request.wanted, found, notes)

    def control_head(self, request: HeadRequest) -> ControlHead:
        """Return the head as a case of this file would use it for control; nothing is stored."""
        with self._storage_errors():
            return control_head(request, cancellation=self._cancellation, folder=self._cases.scratch.open())

    @contextmanager
    def _storage_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise StorageError(f"the import could not be written down: {error.strerror or error}.") from error


def _part(progress: ProgressCallback, start: float, end: float) -> ProgressCallback:
    """Return a callback that maps the progress of a part to the range start to end of the whole."""
    return lambda stage, fraction: progress(stage, start + (end - start) * fraction)
