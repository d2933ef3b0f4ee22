"""Work that takes longer than a request: started, watched and remembered for a while."""

from __future__ import annotations

import logging
import secrets
import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Literal

from app.services.errors import NotFound, PlannerEnds
from vfix_engine.errors import VfixError

Progress = Callable[[str, float], None]
JobState = Literal["queued", "running", "done", "failed"]

_KEPT = 100
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """How far a job is: stage in words, fraction 0 … 1; result: id of what was made; error: why it failed."""

    id: str
    state: JobState = "queued"
    stage: str = "waiting"
    fraction: float = 0.0
    result: str | None = None
    error: VfixError | None = None


class Jobs:
    """One job runs at a time: each may take a gigabyte."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="vfix-job")

    def submit(self, work: Callable[[Progress], str], clean_up: Callable[[], None] = lambda: None) -> Job:
        """Queue a piece of work that reports progress and returns the id of what it made.

        clean_up: called when the work has ended, and also when it is never begun.
        """
        job = Job(f"job-{secrets.token_hex(6)}")
        with self._lock:
            self._jobs[job.id] = job
            while len(self._jobs) > _KEPT:
                self._jobs.popitem(last=False)
        try:
            self._pool.submit(self._run, job.id, work).add_done_callback(lambda _: clean_up())
        except RuntimeError:  # the pool was closed
            clean_up()
            raise PlannerEnds from None
        return job

    def get(self, job_id: str) -> Job:
        """How far a job is. Raises NotFound."""
        with self._lock:
            if job_id not in self._jobs:
                raise NotFound(f"there is no job {job_id!r:.80}.")
            return self._jobs[job_id]

    def close(self) -> None:
        """Start no further job, and wait for the one that runs."""
        self._pool.shutdown(cancel_futures=True)

    def _run(self, job_id: str, work: Callable[[Progress], str]) -> None:
        self._set(job_id, state="running", stage="starting")
        try:
            result = work(lambda stage, fraction: self._set(job_id, stage=stage, fraction=min(max(fraction, 0.0), 1.0)))
            self._set(job_id, state="done", stage="done", fraction=1.0, result=result)
        except VfixError as error:
            self._set(job_id, state="failed", stage="failed", error=error)
        except Exception as error:
            # Neither the log nor the answer may quote what was in the file (HAZ-33).
            _LOG.error("a job met an unexpected %s", type(error).__name__)
            self._set(job_id, state="failed", stage="failed", error=VfixError("The planner met an unexpected error."))

    def _set(self, job_id: str, **changes: object) -> None:
        with self._lock:
            if job_id in self._jobs:
                self._jobs[job_id] = replace(self._jobs[job_id], **changes)  # type: ignore[arg-type]
