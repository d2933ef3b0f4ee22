"""Recordings of drives on the page: where each is written, and what becomes of it when the drive ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from app.services.errors import PlannerEnds
from app.services.jobs import Jobs, Progress
from app.services.plan_model import Plan
from app.services.runs import RunService, has_ticks
from vfix_engine.imaging.piercing import Ways


@dataclass(frozen=True)
class Recording:
    """One drive's recording. folder: that its run is written to; not there before. ways: round tissue, of a plan."""

    folder: Path
    plan: Plan
    runs: RunService
    jobs: Jobs
    ways: Callable[[Plan], Ways | None]

    def keep(self) -> None:
        """The drive has ended: its run is stored by a job; a drive without a step leaves none."""
        if not has_ticks(self.folder):
            self._remove()
            return
        try:
            self.jobs.submit(
                self._store,
                self._remove,
                kind="run",
                lane=f"run {self.folder}",
                case_id=self.plan.case_id,
                subject=self.plan.name,
            )
        except PlannerEnds:
            return  # a drive that ends after the planner: its folder is gone by then

    def _store(self, progress: Progress) -> str:
        progress("Looking for ways round tissue", 0.1)
        ways, plan = self.ways(self.plan), self.plan
        progress("Storing the run", 0.5)
        return self.runs.keep(self.folder, origin="page", case_id=plan.case_id, plan_id=plan.id, ways=ways).id

    def _remove(self) -> None:
        self.runs.discard(self.folder)


class Recordings:
    """Makes recordings; may be used from any thread."""

    def __init__(self, jobs: Jobs, runs: RunService, ways: Callable[[Plan], Ways | None]) -> None:
        self._jobs, self._runs, self._ways = jobs, runs, ways

    def new(self, plan: Plan) -> Recording:
        """A recording of a drive of a stored plan. Raises StorageError where the data folder takes nothing."""
        folder = self._runs.new_folder("page", case_id=plan.case_id, plan_id=plan.id)
        return Recording(folder, plan, self._runs, self._jobs, self._ways)
