"""What both the page and the API do: cases, plans, planning, import and export, over one store.

The services are imported when they are built: what reads the files of plans is used without the store's libraries too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from app.link import TrackerClient
    from app.services.archive import ArchiveReader, ArchiveWriter
    from app.services.case_structures import CaseStructures
    from app.services.cases import CaseService
    from app.services.documents import Documents
    from app.services.dry_runs import DryRuns
    from app.services.exchange_base import BaseExport
    from app.services.fields import Fields
    from app.services.import_jobs import ImportJobs
    from app.services.importing import ImportService
    from app.services.instruments import Instruments
    from app.services.island_previews import IslandPreviews
    from app.services.jobs import Jobs
    from app.services.labels import Labels
    from app.services.line import Line
    from app.services.live_link import LiveBoard
    from app.services.overlays import Overlays
    from app.services.path_reports import PathReports
    from app.services.plan_versions import PlanVersions
    from app.services.planning import Planning
    from app.services.plans import PlanService
    from app.services.prospects import Prospects
    from app.services.purge import Purge
    from app.services.recordings import Recordings
    from app.services.registration.document import RegistrationContent
    from app.services.registration.refining import Refining
    from app.services.registration.service import Registering
    from app.services.registration.tracing import Tracing
    from app.services.removed_bone import RemovedVolumeService
    from app.services.runs import RunService
    from app.services.segmenting import Segmenting
    from app.services.slicer import SlicerExport
    from app.services.suggestions import Suggestions
    from app.services.switches import SwitchBoard
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
    fields: Fields
    planning: Planning
    importing: ImportService
    jobs: Jobs
    import_jobs: ImportJobs
    dry_runs: DryRuns
    prospects: Prospects
    path_reports: PathReports
    removed_volumes: RemovedVolumeService
    suggestions: Suggestions
    runs: RunService
    recordings: Recordings
    switches: SwitchBoard
    segmenting: Segmenting
    labels: Labels
    islands: IslandPreviews
    slicer: SlicerExport
    base_export: BaseExport
    archive_writer: ArchiveWriter
    archive_reader: ArchiveReader
    archive_line: Line
    live: LiveBoard
    tracker: TrackerClient | None

    def sweep(self) -> None:
        """Remove what planners that ended without doing so have left."""
        self.store.sweep()
        self.runs.sweep()
        self.purge.finish()
        self.purge.drop_forgotten()

    def end(self) -> None:
        """End what takes long, before anybody waits for it: the running import, and dry runs."""
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
    from app.services.archive import ArchiveReader, ArchiveWriter
    from app.services.case_structures import CaseStructures
    from app.services.cases import CaseService
    from app.services.documents import Documents
    from app.services.dry_runs import DryRuns
    from app.services.embedded import ensure_head_phantom
    from app.services.exchange_base import BaseExport
    from app.services.fields import Fields
    from app.services.import_jobs import ImportJobs
    from app.services.importing import ImportService
    from app.services.instruments import Instruments
    from app.services.island_previews import IslandPreviews
    from app.services.jobs import Jobs
    from app.services.labels import Labels
    from app.services.line import Line
    from app.services.live_link import LiveBoard
    from app.services.overlays import Overlays
    from app.services.path_reports import PathReports
    from app.services.plan_versions import PlanVersions
    from app.services.planning import Planning
    from app.services.plans import PlanService
    from app.services.prospects import Prospects
    from app.services.purge import Purge
    from app.services.recordings import Recordings
    from app.services.registration.driven import driven_registration
    from app.services.registration.kind import REGISTRATION
    from app.services.registration.refining import Refining
    from app.services.registration.service import Registering
    from app.services.registration.tracing import Tracing
    from app.services.removed_bone import RemovedVolumeService
    from app.services.runs import RunService
    from app.services.segmenting import Segmenting
    from app.services.slicer import SlicerExport
    from app.services.suggestions import Suggestions
    from app.services.switches import SwitchBoard
    from app.store import Store

    store = Store(settings)
    cases, plans = CaseService(store), PlanService(store)
    ensure_head_phantom(store, cases, plans)
    instruments, fields = Instruments(store.files), Fields(cases)
    importing, jobs, registrations = ImportService(cases), Jobs(), Documents(store, REGISTRATION)
    tracker = _tracker(settings)
    registering = Registering(registrations, cases, plans, jobs, tracker)
    planning = Planning(cases, instruments, fields, lambda plan: driven_registration(registering.registration_of(plan)))
    runs, dry_runs, switches = RunService(store), DryRuns(jobs, planning), SwitchBoard()
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
        fields=fields,
        planning=planning,
        importing=importing,
        jobs=jobs,
        import_jobs=import_jobs,
        dry_runs=dry_runs,
        prospects=Prospects(cases, planning),
        path_reports=PathReports(planning, dry_runs, removed_volumes, switches),
        removed_volumes=removed_volumes,
        suggestions=Suggestions(jobs, cases, instruments, fields, planning, switches),
        runs=runs,
        recordings=Recordings(jobs, runs, planning.ways),
        switches=switches,
        segmenting=Segmenting(cases, jobs),
        labels=Labels(store, cases, jobs),
        islands=IslandPreviews(cases, jobs),
        slicer=SlicerExport(cases, planning, registrations),
        base_export=BaseExport(planning, registrations),
        archive_writer=ArchiveWriter(store, cases, plans, instruments, runs),
        archive_reader=ArchiveReader(store, cases),
        archive_line=Line("archives", at_once=1, most=8),
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
