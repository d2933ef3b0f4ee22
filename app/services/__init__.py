"""What both the page and the API do: cases, plans, planning, import and export, over one store.

The services are imported when they are built: what reads the files of plans is used without the store's libraries too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from app.services.cases import CaseService
    from app.services.documents import Documents
    from app.services.dry_runs import DryRuns
    from app.services.import_jobs import ImportJobs
    from app.services.importing import ImportService
    from app.services.instruments import Instruments
    from app.services.jobs import Jobs
    from app.services.planning import Planning
    from app.services.plans import PlanService
    from app.services.recordings import Recordings
    from app.services.registration import RegistrationContent
    from app.services.runs import RunService
    from app.settings import Settings
    from app.store import Store

__all__ = ["Services", "build_services"]


@dataclass(frozen=True)
class Services:
    """Every service of one planner; plain objects that may be used from any thread."""

    settings: Settings
    store: Store
    cases: CaseService
    plans: PlanService
    instruments: Instruments
    registrations: Documents[RegistrationContent]
    planning: Planning
    importing: ImportService
    jobs: Jobs
    import_jobs: ImportJobs
    dry_runs: DryRuns
    runs: RunService
    recordings: Recordings

    def sweep(self) -> None:
        """Remove what planners that ended without doing so have left."""
        self.store.sweep()
        self.runs.sweep()

    def end(self) -> None:
        """End what takes long, before anybody waits for it: the running import, and dry runs."""
        self.importing.cancel()
        self.planning.end()

    def close(self) -> None:
        """End what runs, remove what is temporary, and let go of the database."""
        self.end()
        self.jobs.close()
        self.store.close()


def build_services(settings: Settings) -> Services:
    """Open the store of a home folder, migrated, with the embedded case in it."""
    from app.services.cases import CaseService
    from app.services.documents import Documents
    from app.services.dry_runs import DryRuns
    from app.services.embedded import ensure_head_phantom
    from app.services.import_jobs import ImportJobs
    from app.services.importing import ImportService
    from app.services.instruments import Instruments
    from app.services.jobs import Jobs
    from app.services.planning import Planning
    from app.services.plans import PlanService
    from app.services.recordings import Recordings
    from app.services.registration import REGISTRATION
    from app.services.runs import RunService
    from app.store import Store

    store = Store(settings)
    cases, plans = CaseService(store), PlanService(store)
    ensure_head_phantom(store, cases, plans)
    instruments = Instruments(store.files)
    planning, importing, jobs = Planning(cases, plans, instruments), ImportService(cases), Jobs()
    runs = RunService(store)
    registrations, import_jobs = Documents(store, REGISTRATION), ImportJobs(jobs, importing)
    return Services(
        settings=settings,
        store=store,
        cases=cases,
        plans=plans,
        instruments=instruments,
        registrations=registrations,
        planning=planning,
        importing=importing,
        jobs=jobs,
        import_jobs=import_jobs,
        dry_runs=DryRuns(jobs, planning),
        runs=runs,
        recordings=Recordings(jobs, runs),
    )
