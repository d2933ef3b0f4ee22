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
from app.cases.structures import BONE, LUMEN, CaseKind, Provenance, Structure
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
from vfix_engine.anatomy.lumen_import import AIR_HU, LumenRequest, ReadLumen, lumen_of_volume, read_lumen
from vfix_engine.anatomy.overlay import read_overlay
from vfix_engine.errors import InputError
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.mesh_files import is_mesh
from vfix_engine.files.sandbox.isolated import Cancellation
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback, no_progress

DISPLAY = "display"


@dataclass(frozen=True, kw_only=True)
class ImportRequest(HeadRequest):
    """A file to import as a case.

    name: of the case; None for a generic one, or with use_description for the series description of the file, if it has
    one (HAZ-33). names: a table of label names, kept for the case that the file is a segmentation.
    kind: of case. label, seed, air_hu: of a lumen, as in `LumenRequest`.
    """

    name: str | None = None
    use_description: bool = False
    names: Path | None = None
    kind: CaseKind = "head"
    label: int | None = None
    seed: tuple[float, float, float] | None = None
    air_hu: float = AIR_HU

    @property
    def wanted(self) -> WantedName:
        """The requested name."""
        return WantedName(self.name, self.use_description, "case")

    @property
    def lumen(self) -> LumenRequest:
        """What is read of a lumen. Raises InputError where this is a head."""
        if self.kind != "lumen":
            raise InputError("label, seed and air are said of a lumen; say that it is one.")
        told = {"frame": self.frame, "unit": self.unit, "assume": self.assume, "series": self.series}
        return LumenRequest(self.path, **told, label=self.label, seed=self.seed, air_hu=self.air_hu)  # type: ignore[arg-type]

    @property
    def of_lumen(self) -> bool:
        """Whether anything is said that only a lumen has."""
        return self.label is not None or self.seed is not None or self.air_hu != AIR_HU

    @property
    def sort(self) -> Sort:
        """Generic name of a head from this file."""
        return "Surface" if is_mesh(self.path) else "CT"


@dataclass(frozen=True)
class _Parts:
    """Surfaces of a new case by name, what making them cost, doubts about them, its CT, and where they come from."""

    surfaces: Mapping[str, TriangleMesh]
    reports: Mapping[str, SurfaceReport] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    volume: Volume | None = None
    made_from: Provenance | None = None


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
        ends = cancellation or self._cancellation
        with self._storage_errors():
            folder = self._cases.scratch.open()  # for the decoded data of the worker
            if request.kind == "lumen" or request.of_lumen:
                found = read_lumen(request.lumen, progress, cancellation=ends, folder=folder)
                return self._stored(request.wanted, request.sort, found.frame, _lumen_parts(found, request), progress)
            read = read_head(request, progress, cancellation=ends, folder=folder)
            bone = extract_bone(read, _part(progress, 0.3, 0.95), cancellation=ends, folder=folder)
        parts = _Parts(
            {BONE: bone.control, DISPLAY: bone.display},
            {BONE: bone.control_report, DISPLAY: bone.display_report},
            (*read.notes, *bone.notes),
            read.volume,
        )
        return self._stored(request.wanted, request.sort, read.frame, parts, progress)

    def _stored(
        self, wanted: WantedName, sort: Sort, frame: FrameReport, parts: _Parts, progress: ProgressCallback
    ) -> Case:
        """The case of what was read."""
        progress("Storing the case", 0.95)
        taken = {case.name for case in self._cases.list(include_deleted=True)}
        name, name_notes = wanted.among(taken, sort, frame.description)
        return self._cases.create(
            name,
            frame=CaseFrame(frame.name, frame.assumed),
            surfaces=parts.surfaces,
            volume=parts.volume,
            notes=(*parts.notes, *name_notes),
            reports=parts.reports,
            kind="lumen" if LUMEN in parts.surfaces else "head",
            made_from=parts.made_from,
        )

    def lumen_at(
        self,
        case_id: str,
        seed: tuple[float, float, float],
        air_hu: float = AIR_HU,
        progress: ProgressCallback = no_progress,
        cancellation: Cancellation | None = None,
    ) -> Case:
        """Make a case of another lumen of a case's CT: the air at a seed, LPS mm.

        Raises NotFound, InputError for a case without a CT, and ImageError where there is no such air.
        """
        case = self._cases.get(case_id)
        volume = self._cases.volume(case)
        if volume is None:
            raise InputError("this case was made of a surface; a lumen is found in a CT.")
        with self._storage_errors():
            folder = self._cases.scratch.open()
            found = lumen_of_volume(volume, seed, air_hu, progress, cancellation=cancellation or self._cancellation,
                                    folder=folder)  # fmt: skip
        report = FrameReport(case.frame.name, assumed=case.frame.assumed)
        parts = _Parts(
            {LUMEN: found.wall}, {LUMEN: found.report}, found.notes, volume, Provenance("ct", threshold_hu=air_hu)
        )
        return self._stored(WantedName(None, False, "case"), "CT", report, parts, progress)

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


def _lumen_parts(found: ReadLumen, request: ImportRequest) -> _Parts:
    made_from = {
        "surface": Provenance("surface"),
        "labels": Provenance("segmentation", label=request.label, voxel_mm=found.voxel_mm),
        "ct": Provenance("ct", threshold_hu=request.air_hu),
    }[found.source]
    return _Parts({LUMEN: found.wall}, {LUMEN: found.report}, found.notes, found.volume, made_from)


def _part(progress: ProgressCallback, start: float, end: float) -> ProgressCallback:
    """Return a callback that maps the progress of a part to the range start to end of the whole."""
    return lambda stage, fraction: progress(stage, start + (end - start) * fraction)
