"""What both the page and the API do: cases, plans, planning, import and export, over one store."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from app.documents import DocumentKind
    from app.documents.documents import Documents
    from app.link import TrackerClient
    from app.settings import Settings

__all__ = ["Services", "build_services"]


class Services:
    """Every service of one planner; plain objects that may be used from any thread.

    They are imported when they are built: what reads the files of plans is used without the store's libraries too.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._other_documents: dict[str, Documents[Any]] = {}
        self._open_store(settings)
        self._add_images()
        self._add_registrations()
        self._add_planning()
        self._add_drives()
        self._add_exchange()

    def _open_store(self, settings: Settings) -> None:
        """The store with cases and plans, jobs, and the tracker."""
        from app.cases.overlays import Overlays
        from app.cases.segments import CaseStructures
        from app.cases.service import CaseService
        from app.kit.jobs import Jobs
        from app.lumen.service import RouteService
        from app.lumen.shipped_lumens import ensure_lumen_phantoms
        from app.plans.service import PlanService
        from app.plans.shipped_head import ensure_head_phantom
        from app.store import Store

        self.store = Store(settings)
        self.cases = CaseService(self.store)
        self.plans = PlanService(self.store)
        ensure_head_phantom(self.store, self.cases, self.plans)
        self.structures = CaseStructures(self.cases)
        self.overlays = Overlays(self.cases)
        self.versions = self.plans.versions
        self.instruments = self.plans.instruments
        self.jobs = Jobs()
        self.lumen_routes = RouteService(self.store, self.cases, self.jobs)
        ensure_lumen_phantoms(self.store, self.cases, self.lumen_routes)
        self.tracker = _tracker(settings)

    def _add_images(self) -> None:
        """What makes cases, and what is made of their scans."""
        from app.cases.purge import Purge
        from app.imaging.endoscope import EndoscopeSurfaces
        from app.imaging.import_jobs import ImportJobs
        from app.imaging.importing import ImportService
        from app.imaging.island_previews import IslandPreviews
        from app.imaging.labels import PaintedLabels
        from app.imaging.lumen_endoscope import LumenEndoscope
        from app.imaging.openings import Openings
        from app.imaging.segmenting import Segmenting
        from app.imaging.skins import Skins

        store, cases, jobs = self.store, self.cases, self.jobs
        self.importing = ImportService(cases)
        self.import_jobs = ImportJobs(jobs, self.importing)
        self.segmenting = Segmenting(cases, jobs)
        self.labels = PaintedLabels(store, cases, jobs)
        self.islands = IslandPreviews(cases, jobs)
        self.skins = Skins(store, cases, jobs)
        self.openings = Openings(store, cases, jobs)
        self.endoscope = EndoscopeSurfaces(store, cases, jobs)
        self.lumen_endoscope = LumenEndoscope(cases, jobs)
        forget = self.skins.forget, self.openings.forget, self.endoscope.forget, self.lumen_endoscope.forget
        self.purge = Purge(store, *forget)

    def _add_registrations(self) -> None:
        from app.documents.documents import Documents
        from app.registration.kind import REGISTRATION
        from app.registration.service import Registering
        from app.registration.tracing import Tracing

        self.registrations = Documents(self.store, REGISTRATION)
        self.registering = Registering(self.registrations, self.cases, self.plans, self.jobs, self.tracker)
        self.refining = self.registering.refining
        self.tracing = Tracing(self.cases, self.plans, self.registering, self.tracker)

    def _add_planning(self) -> None:
        """What judges plans; plans refer to it, to registrations and overlays."""
        from app.planning.distance_fields import DistanceFields
        from app.planning.dry_runs import DryRunJobs
        from app.planning.evaluation import Planning
        from app.planning.path_evaluations import PathEvaluations
        from app.planning.previews import Previews
        from app.planning.rehearsal_options import OptionsByPlan
        from app.planning.removed_volumes import RemovedVolumeService
        from app.planning.suggestions import Suggestions
        from app.registration.driven import driven_registration

        cases, instruments, jobs, registering = self.cases, self.instruments, self.jobs, self.registering
        self.rehearsal_options = options = OptionsByPlan()
        self.distance_fields = DistanceFields(cases)
        self.planning = planning = Planning(
            cases,
            instruments,
            self.distance_fields,
            lambda plan: driven_registration(registering.registration_of(plan)),
            self.openings.known,
        )
        self.plans.connect(cases, planning, registering, self.overlays)
        self.dry_runs = DryRunJobs(jobs, planning)
        self.previews = Previews(cases, planning)
        self.removed_volumes = RemovedVolumeService(cases)
        self.path_evaluations = PathEvaluations(planning, self.dry_runs, self.removed_volumes, options)
        self.suggestions = Suggestions(jobs, cases, instruments, self.distance_fields, planning, options)

    def _add_drives(self) -> None:
        from app.assignments.service import Assignments
        from app.drives.recordings import Recordings
        from app.drives.run_comments import RunComments
        from app.drives.run_scores import RunScores
        from app.drives.runs import RunService
        from app.drives.swept_runs import SweptRuns
        from app.live import LiveBoard
        from app.studies.service import Studies

        self.runs = RunService(self.store)
        self.run_comments = RunComments(self.store, self.runs)
        self.run_scores = RunScores(self.store, self.runs, self.lumen_routes.tasks.known_wall)
        self.swept_runs = SweptRuns(self.store, self.runs, self.jobs)
        self.recordings = Recordings(self.jobs, self.runs, self.run_scores)
        self.live = LiveBoard()
        self.assignments = Assignments(self.store, self.cases, self.plans, self.runs, self.run_scores)
        self.studies = Studies(self.store, self.cases, self.plans, self.runs, self.lumen_routes)

    def _add_exchange(self) -> None:
        """What leaves the planner, and archives that come back."""
        from app.exchange.archive import ArchiveReader, ArchiveWriter
        from app.exchange.report import PlanReports
        from app.exchange.robot_frame import BaseExport
        from app.exchange.slicer import SlicerExport
        from app.exchange.way_pictures import WayPictures
        from app.kit.admission import AdmissionQueue

        cases, instruments, planning = self.cases, self.instruments, self.planning
        self.plan_reports = PlanReports(
            cases,
            instruments,
            planning,
            self.dry_runs,
            self.path_evaluations,
            self.rehearsal_options,
            self.registering,
        )
        self.way_pictures = WayPictures(self.jobs, planning, self.plans)
        self.slicer = SlicerExport(cases, planning, self.registrations)
        self.base_export = BaseExport(planning, self.registrations)
        self.archive_writer = ArchiveWriter(self.store, cases, self.plans, instruments, self.runs)
        self.archive_reader = ArchiveReader(self.store, cases)
        self.archive_line = AdmissionQueue("archives", at_once=1, most=8)

    def documents_of(self, kind: DocumentKind[Any]) -> Documents[Any]:
        """Documents of a kind that has no service of its own; one object a kind."""
        from app.documents.documents import Documents

        return self._other_documents.setdefault(kind.name, Documents(self.store, kind))

    def sweep(self) -> None:
        """Remove what planners that ended without doing so have left."""
        from app.imaging.derived_of_ct import sweep_derived

        self.store.sweep()
        self.runs.sweep()
        self.purge.finish()
        self.purge.drop_forgotten()
        sweep_derived(self.store, self.cases)

    def end(self) -> None:
        """End what takes long, before it is waited for: the running import, and dry runs."""
        self.importing.cancel()
        self.planning.end()

    def close(self) -> None:
        """End what runs, remove what is temporary, and let go of the database."""
        self.end()
        if self.tracker is not None:
            self.tracker.close()
        self.jobs.close()
        self.store.close()


def build_services(settings: Settings) -> Services:
    """Open the store of a home folder, migrated, with the embedded case in it."""
    return Services(settings)


def _tracker(settings: Settings) -> TrackerClient | None:
    if settings.tracker is None:
        return None
    from app.link import TrackerClient

    client = TrackerClient(settings.tracker.host, settings.tracker.port, settings.tracker.name)
    client.start()
    return client
