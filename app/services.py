"""What both the page and the API do: cases, plans, planning, import and export, over one store.

The services are imported when they are built: what reads the files of plans is used without the store's libraries too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from app.cases.overlays import Overlays
    from app.cases.purge import Purge
    from app.cases.segments import CaseStructures
    from app.cases.service import CaseService
    from app.documents import Documents
    from app.drives.recordings import Recordings
    from app.drives.runs import RunService
    from app.exchange.archive import ArchiveReader, ArchiveWriter
    from app.exchange.robot_frame import BaseExport
    from app.exchange.slicer import SlicerExport
    from app.imaging.import_jobs import ImportJobs
    from app.imaging.importing import ImportService
    from app.imaging.island_previews import IslandPreviews
    from app.imaging.labels import PaintedLabels
    from app.imaging.segmenting import Segmenting
    from app.kit.admission import AdmissionQueue
    from app.kit.jobs import Jobs
    from app.link import TrackerClient
    from app.live import LiveBoard
    from app.planning.distance_fields import DistanceFields
    from app.planning.dry_runs import DryRunJobs
    from app.planning.evaluation import Planning
    from app.planning.path_evaluations import PathEvaluations
    from app.planning.previews import Previews
    from app.planning.rehearsal_options import SwitchBoard
    from app.planning.removed_volumes import RemovedVolumeService
    from app.planning.suggestions import Suggestions
    from app.plans.instruments import Instruments
    from app.plans.service import PlanService
    from app.plans.versions import PlanVersions
    from app.registration.document import RegistrationContent
    from app.registration.refining import Refining
    from app.registration.service import Registering
    from app.registration.tracing import Tracing
    from app.settings import Settings
    from app.store import Store

__all__ = ["Services", "build_services"]


@dataclass(frozen=True)
class Services:
    """Every service of one planner; plain objects that may be used from any thread."""

    settings: Settings
    store: Store
    cases: CaseService
    structures: CaseStructures
    overlays: Overlays
    purge: Purge
    plans: PlanService
    versions: PlanVersions
    instruments: Instruments
    registrations: Documents[RegistrationContent]
    registering: Registering
    refining: Refining
    tracing: Tracing
    distance_fields: DistanceFields
    planning: Planning
    importing: ImportService
    jobs: Jobs
    import_jobs: ImportJobs
    dry_runs: DryRunJobs
    previews: Previews
    path_evaluations: PathEvaluations
    removed_volumes: RemovedVolumeService
    suggestions: Suggestions
    runs: RunService
    recordings: Recordings
    switches: SwitchBoard
    segmenting: Segmenting
    labels: PaintedLabels
    islands: IslandPreviews
    slicer: SlicerExport
    base_export: BaseExport
    archive_writer: ArchiveWriter
    archive_reader: ArchiveReader
    archive_line: AdmissionQueue
    live: LiveBoard
    tracker: TrackerClient | None

    def sweep(self) -> None:
        """Remove what planners that ended without doing so have left."""
        self.store.sweep()
        self.runs.sweep()
        self.purge.finish()
        self.purge.drop_forgotten()

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
    from app.cases.overlays import Overlays
    from app.cases.purge import Purge
    from app.cases.segments import CaseStructures
    from app.cases.service import CaseService
    from app.documents import Documents
    from app.drives.recordings import Recordings
    from app.drives.runs import RunService
    from app.exchange.archive import ArchiveReader, ArchiveWriter
    from app.exchange.robot_frame import BaseExport
    from app.exchange.slicer import SlicerExport
    from app.imaging.import_jobs import ImportJobs
    from app.imaging.importing import ImportService
    from app.imaging.island_previews import IslandPreviews
    from app.imaging.labels import PaintedLabels
    from app.imaging.segmenting import Segmenting
    from app.kit.admission import AdmissionQueue
    from app.kit.jobs import Jobs
    from app.live import LiveBoard
    from app.planning.distance_fields import DistanceFields
    from app.planning.dry_runs import DryRunJobs
    from app.planning.evaluation import Planning
    from app.planning.path_evaluations import PathEvaluations
    from app.planning.previews import Previews
    from app.planning.rehearsal_options import SwitchBoard
    from app.planning.removed_volumes import RemovedVolumeService
    from app.planning.suggestions import Suggestions
    from app.plans.instruments import Instruments
    from app.plans.service import PlanService
    from app.plans.shipped_head import ensure_head_phantom
    from app.plans.versions import PlanVersions
    from app.registration.driven import driven_registration
    from app.registration.kind import REGISTRATION
    from app.registration.refining import Refining
    from app.registration.service import Registering
    from app.registration.tracing import Tracing
    from app.store import Store

    store = Store(settings)
    cases, plans = CaseService(store), PlanService(store)
    ensure_head_phantom(store, cases, plans)
    instruments, distance_fields = Instruments(store.files), DistanceFields(cases)
    importing, jobs, registrations = ImportService(cases), Jobs(), Documents(store, REGISTRATION)
    tracker = _tracker(settings)
    registering = Registering(registrations, cases, plans, jobs, tracker)
    planning = Planning(
        cases, instruments, distance_fields, lambda plan: driven_registration(registering.registration_of(plan))
    )
    runs, dry_runs, switches = RunService(store), DryRunJobs(jobs, planning), SwitchBoard()
    removed_volumes = RemovedVolumeService(cases)
    import_jobs = ImportJobs(jobs, importing)
    return Services(
        settings=settings,
        store=store,
        cases=cases,
        structures=CaseStructures(cases),
        overlays=Overlays(cases),
        purge=Purge(store),
        plans=plans,
        versions=PlanVersions(store, plans),
        instruments=instruments,
        registrations=registrations,
        registering=registering,
        refining=Refining(cases, registering, jobs, tracker),
        tracing=Tracing(cases, plans, registering, tracker),
        distance_fields=distance_fields,
        planning=planning,
        importing=importing,
        jobs=jobs,
        import_jobs=import_jobs,
        dry_runs=dry_runs,
        previews=Previews(cases, planning),
        path_evaluations=PathEvaluations(planning, dry_runs, removed_volumes, switches),
        removed_volumes=removed_volumes,
        suggestions=Suggestions(jobs, cases, instruments, distance_fields, planning, switches),
        runs=runs,
        recordings=Recordings(jobs, runs, planning.ways),
        switches=switches,
        segmenting=Segmenting(cases, jobs),
        labels=PaintedLabels(store, cases, jobs),
        islands=IslandPreviews(cases, jobs),
        slicer=SlicerExport(cases, planning, registrations),
        base_export=BaseExport(planning, registrations),
        archive_writer=ArchiveWriter(store, cases, plans, instruments, runs),
        archive_reader=ArchiveReader(store, cases),
        archive_line=AdmissionQueue("archives", at_once=1, most=8),
        live=LiveBoard(),
        tracker=tracker,
    )


def _tracker(settings: Settings) -> TrackerClient | None:
    if settings.tracker is None:
        return None
    from app.link import TrackerClient

    client = TrackerClient(settings.tracker.host, settings.tracker.port, settings.tracker.name)
    client.start()
    return client
