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
        from app.cases.overlays import Overlays
        from app.cases.purge import Purge
        from app.cases.segments import CaseStructures
        from app.cases.service import CaseService
        from app.documents.documents import Documents
        from app.drives.recordings import Recordings
        from app.drives.runs import RunService
        from app.exchange.archive import ArchiveReader, ArchiveWriter
        from app.exchange.report import PlanReports
        from app.exchange.robot_frame import BaseExport
        from app.exchange.slicer import SlicerExport
        from app.exchange.way_pictures import WayPictures
        from app.imaging.endoscope import EndoscopeSurfaces
        from app.imaging.import_jobs import ImportJobs
        from app.imaging.importing import ImportService
        from app.imaging.island_previews import IslandPreviews
        from app.imaging.labels import PaintedLabels
        from app.imaging.openings import Openings
        from app.imaging.segmenting import Segmenting
        from app.imaging.skins import Skins
        from app.kit.admission import AdmissionQueue
        from app.kit.jobs import Jobs
        from app.live import LiveBoard
        from app.planning.distance_fields import DistanceFields
        from app.planning.dry_runs import DryRunJobs
        from app.planning.evaluation import Planning
        from app.planning.path_evaluations import PathEvaluations
        from app.planning.previews import Previews
        from app.planning.rehearsal_options import OptionsByPlan
        from app.planning.removed_volumes import RemovedVolumeService
        from app.planning.suggestions import Suggestions
        from app.plans.service import PlanService
        from app.plans.shipped_head import ensure_head_phantom
        from app.registration.driven import driven_registration
        from app.registration.kind import REGISTRATION
        from app.registration.service import Registering
        from app.registration.tracing import Tracing
        from app.store import Store

        self.settings = settings
        self.store = store = Store(settings)
        self.cases = cases = CaseService(store)
        self.plans = plans = PlanService(store)
        ensure_head_phantom(store, cases, plans)
        self.jobs = jobs = Jobs()
        self.tracker = tracker = _tracker(settings)

        self.structures = CaseStructures(cases)
        self.overlays = overlays = Overlays(cases)
        self.versions = plans.versions
        self.instruments = instruments = plans.instruments
        self.importing = ImportService(cases)
        self.import_jobs = ImportJobs(jobs, self.importing)
        self.segmenting = Segmenting(cases, jobs)
        self.labels = PaintedLabels(store, cases, jobs)
        self.islands = IslandPreviews(cases, jobs)
        self.skins = Skins(store, cases, jobs)
        self.openings = Openings(store, cases, jobs)
        self.endoscope = EndoscopeSurfaces(store, cases, jobs)
        self.purge = Purge(store, self.skins.forget, self.openings.forget, self.endoscope.forget)

        self.registrations = registrations = Documents(store, REGISTRATION)
        self.registering = registering = Registering(registrations, cases, plans, jobs, tracker)
        self.refining = registering.refining
        self.tracing = Tracing(cases, plans, registering, tracker)

        self.distance_fields = distance_fields = DistanceFields(cases)
        self.planning = planning = Planning(
            cases, instruments, distance_fields, lambda plan: driven_registration(registering.registration_of(plan))
        )
        plans.connect(cases, planning, registering, overlays)
        self.dry_runs = DryRunJobs(jobs, planning)
        self.previews = Previews(cases, planning)
        self.rehearsal_options = options = OptionsByPlan()
        self.removed_volumes = RemovedVolumeService(cases)
        self.path_evaluations = PathEvaluations(planning, self.dry_runs, self.removed_volumes, options)
        self.suggestions = Suggestions(jobs, cases, instruments, distance_fields, planning, options)
        self.runs = runs = RunService(store)
        self.recordings = Recordings(jobs, runs)

        self.plan_reports = PlanReports(
            cases, instruments, planning, self.dry_runs, self.path_evaluations, options, registering
        )
        self.way_pictures = WayPictures(jobs, planning, plans)
        self.slicer = SlicerExport(cases, planning, registrations)
        self.base_export = BaseExport(planning, registrations)
        self.archive_writer = ArchiveWriter(store, cases, plans, instruments, runs)
        self.archive_reader = ArchiveReader(store, cases)
        self.archive_line = AdmissionQueue("archives", at_once=1, most=8)
        self.live = LiveBoard()
        self._other_documents: dict[str, Documents[Any]] = {}

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
