"""Recordings of drives on the page: where each is written, and how it is stored when the drive ends."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from app.clock import utc_now
from app.drives.live_comments import LiveComments
from app.drives.run_scores import RunScores
from app.drives.runs import Measure, RunService, has_ticks
from app.kit.errors import PlannerEnds
from app.kit.jobs import Jobs, Progress
from app.store.errors import StorageError
from vfix_engine.error_places import error_places
from vfix_engine.errors import VfixError

_LOG = logging.getLogger(__name__)

MeasureBy = Callable[[Progress], Measure | None]


def nothing_measured(progress: Progress) -> None:
    """The run is stored as it was written."""


@dataclass(frozen=True)
class Recording:
    """One drive's recording.

    folder: of its run, created by the drive. case_id, document_id: what is driven; subject: its name.
    comments: those written during the drive. plan_sha256: `driven_hash` of the plan, or the key of
    a route's way. began: when the recording was made.
    measure_by: called when the drive has ended; returns measurements of the run before it is stored.
    scores: compute its score once it is stored, so that lists have it; None: when somebody asks.
    unstored: recordings that could not be stored, such as on a full disk; they stay until they can be.
    """

    folder: Path
    case_id: str
    document_id: str | None
    subject: str
    runs: RunService
    jobs: Jobs
    measure_by: MeasureBy
    comments: LiveComments
    scores: RunScores | None = None
    plan_sha256: str | None = None
    began: str = ""
    unstored: list[Recording] = field(default_factory=list, compare=False)

    def keep(self) -> None:
        """The drive has ended: its run is stored by a job; a drive without a step leaves none."""
        self.comments.close()
        if not has_ticks(self.folder):
            self._remove()
            return
        try:
            self.jobs.submit(
                self._store,
                self._remove,
                kind="run",
                lane=f"run {self.folder}",
                case_id=self.case_id,
                subject=self.subject,
                document_id=self.document_id,
            )
        except PlannerEnds:
            return  # a drive that ends after the planner has no folder any more

    def _store(self, progress: Progress) -> str:
        measure = self.measure_by(progress)
        progress("Storing the run", 0.5)
        ids = {"case_id": self.case_id, "plan_id": self.document_id, "plan_sha256": self.plan_sha256}
        try:
            run = self.runs.keep(self.folder, origin="page", began=self.began, measure=measure, **ids)
        except StorageError as error:
            self.unstored.append(self)
            raise StorageError(
                f"{str(error).rstrip('.')}; it is kept, and stored when the next drive begins."
            ) from error
        if self.scores is not None and (run.mode is not None or run.arm is not None):
            progress("Scoring the run", 0.7)
            try:
                self.scores.of(run.id)
            except (VfixError, ValueError) as error:  # the run is stored: whoever opens it asks for the score again
                _LOG.warning("a run was stored and could not be scored: %s", error_places(error))
        return run.id

    def _remove(self) -> None:
        if self not in self.unstored:
            self.runs.discard(self.folder)


class Recordings:
    """Makes recordings; may be used from any thread."""

    def __init__(self, jobs: Jobs, runs: RunService, scores: RunScores | None = None) -> None:
        self._jobs, self._runs, self._scores = jobs, runs, scores
        self._unstored: list[Recording] = []

    def new(
        self,
        case_id: str,
        document_id: str | None,
        subject: str,
        measure_by: MeasureBy = nothing_measured,
        plan_sha256: str | None = None,
    ) -> Recording:
        """A recording of a drive of a stored case or document, see `Recording`.

        Raises StorageError where the data folder is not writable.
        """
        earlier, self._unstored[:] = tuple(self._unstored), ()
        for one in earlier:
            one.keep()
        began, ids = utc_now(), {"case_id": case_id, "plan_id": document_id, "plan_sha256": plan_sha256}
        folder = self._runs.new_folder("page", began=began, **ids)
        drive = folder, case_id, document_id, subject, self._runs, self._jobs
        return Recording(*drive, measure_by, LiveComments(folder), self._scores, plan_sha256, began, self._unstored)

    def attempt(
        self,
        case_id: str,
        document_id: str | None,
        subject: str,
        measure_by: MeasureBy = nothing_measured,
        plan_sha256: str | None = None,
    ) -> tuple[Recording | None, str]:
        """A recording as from :meth:`new`, and why there is none, '' where there is one."""
        try:
            return self.new(case_id, document_id, subject, measure_by, plan_sha256), ""
        except StorageError as error:
            return None, str(error)
