"""Jobs: work that takes longer than a request, with progress, cancellation and a list of recent jobs."""

from __future__ import annotations

import logging
import secrets
import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Literal

from app.clock import utc_now
from app.kit.errors import JobCancelled, NotFound, PlannerEnds
from vfix_engine.error_places import error_places
from vfix_engine.errors import VfixError

JobKind = Literal[
    "import", "structures", "dry_run", "run", "suggestion", "tools", "segmentation", "islands", "overlay", "beads",
    "refinement", "skin", "openings", "pictures", "endoscope", "swept",
    "route", "viewable",
]  # fmt: skip
JobState = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: frozenset[JobState] = frozenset({"done", "failed", "cancelled"})

THREADS = 2  # of each of the two thread pools
PROMPT: frozenset[JobKind] = frozenset({"dry_run", "run"})  # kinds whose results a user waits for
_KEPT = 100
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """State of a job.

    kind: kind of work. case_id: id of the case that it works on, None if it creates one. subject: display name of the
    work, such as a file's name. document_id: id of the plan, registration or label that it works on, None without.
    stage: description of the current stage. fraction: progress of the whole, 0 to 1.
    result: id of what was made. error: why it failed or was cancelled.
    """

    id: str
    kind: JobKind
    case_id: str | None = None
    subject: str = ""
    document_id: str | None = None
    state: JobState = "queued"
    stage: str = "waiting"
    fraction: float = 0.0
    result: str | None = None
    error: VfixError | None = None
    created: str = field(default_factory=utc_now)


class Progress:
    """Progress callback of a job's work: called with the stage in words and the fraction of the whole that is done.

    A call raises JobCancelled if the job was cancelled, so work that reports often ends soon.
    """

    def __init__(self, report: Callable[[str, float], None]) -> None:
        self._report = report
        self._reported: tuple[str, float] | None = None
        self._cancelled = threading.Event()
        self._on_cancel: Callable[[], None] = lambda: None
        self._lock = threading.Lock()

    def __call__(self, stage: str, fraction: float) -> None:
        self.check()
        if self._reported != (stage, fraction):  # a run may report at every step
            self._reported = (stage, fraction)
            self._report(stage, fraction)

    def check(self) -> None:
        """Raise JobCancelled if the job was cancelled."""
        if self._cancelled.is_set():
            raise JobCancelled

    def on_cancel(self, act: Callable[[], None]) -> None:
        """Set a callback that ends the work from another thread on cancellation; called now if already cancelled."""
        with self._lock:
            self._on_cancel = act
            already_cancelled = self._cancelled.is_set()
        if already_cancelled:
            act()

    def cancel(self) -> None:
        """Cancel the job."""
        with self._lock:
            self._cancelled.set()
            act = self._on_cancel
        act()


Work = Callable[[Progress], str]


@dataclass(frozen=True)
class _Entry:
    """A job that has not ended. done: set when none of its work runs any more."""

    work: Work
    clean_up: Callable[[], None]
    progress: Progress
    lane: str
    same: str = ""
    done: threading.Event = field(default_factory=threading.Event)


class Jobs:
    """Runs jobs; those of one lane run one after another. Thread-safe.

    Two jobs of the `PROMPT` kinds run at a time, and two others besides them, so that an import or a path search,
    which may take minutes, does not delay a dry run. A lane, too, is of prompt jobs or of others.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: OrderedDict[str, Job] = OrderedDict()  # oldest first
        self._entries: dict[str, _Entry] = {}
        self._lanes: dict[str, deque[str]] = {}  # ids of waiting jobs by lane; a lane exists while it is busy
        self._closed = False
        self._version = 0
        self._prompt = ThreadPoolExecutor(THREADS, thread_name_prefix="vfix-prompt-job")
        self._others = ThreadPoolExecutor(THREADS, thread_name_prefix="vfix-job")

    def submit(
        self,
        work: Work,
        clean_up: Callable[[], None] = lambda: None,
        *,
        kind: JobKind,
        lane: str,
        case_id: str | None = None,
        subject: str = "",
        document_id: str | None = None,
        same: str = "",
    ) -> Job:
        """Queue work that reports progress and returns the id of what it made.

        clean_up: called when the work has ended, and also if it never begins.
        lane: jobs of one lane run one at a time, in order, such as imports, which may take a gigabyte each, or the dry
            runs of one case.
        same: equal for jobs with the same result. If such a job waits or runs already, it is returned, and `clean_up`
            is called immediately; '' equals no other job.
        Raises PlannerEnds after `close`.
        """
        job = Job(f"job-{secrets.token_hex(6)}", kind, case_id, subject, document_id)
        entry = _Entry(work, clean_up, Progress(lambda *progress: self._report(job.id, *progress)), lane, same)
        with self._lock:
            closed = self._closed
            equal = (job_id for job_id, other in self._entries.items() if same and other.same == same)
            known = self._jobs.get(next(equal, ""))
            if not closed and known is None:
                self._jobs[job.id], self._entries[job.id] = job, entry
                self._version += 1
                self._forget_old()
                if lane in self._lanes:
                    self._lanes[lane].append(job.id)
                else:
                    self._lanes[lane] = deque()
                    self._begin(job.id, entry)
        if closed or known is not None:
            clean_up()
        if closed:
            raise PlannerEnds
        return known or job

    @property
    def version(self) -> int:
        """Number of changes so far: of jobs that were queued, have reported, or have ended."""
        return self._version

    def going_on(self) -> tuple[int, tuple[Job, ...]]:
        """Return the version, and the jobs that wait or run in it, oldest first."""
        with self._lock:
            return self._version, tuple(job for job in self._jobs.values() if job.state not in ENDED)

    def get(self, job_id: str) -> Job:
        """Return the state of a job. Raises NotFound."""
        with self._lock:
            return self._find(job_id)

    def list(self, case_id: str | None = None) -> tuple[Job, ...]:
        """Return the known jobs of a case or all, oldest first: waiting, running and recently ended ones."""
        with self._lock:
            return tuple(job for job in self._jobs.values() if case_id in (None, job.case_id))

    def wait(self, job_id: str, seconds: float | None = None) -> Job:
        """Wait until a job has ended, at most the given time in s, and return its state. Raises NotFound."""
        with self._lock:
            self._find(job_id)
            entry = self._entries.get(job_id)
        if entry is not None:
            entry.done.wait(seconds)
        return self.get(job_id)

    def cancel(self, job_id: str) -> Job:
        """Cancel a waiting or running job; one that can no longer be cancelled continues, and an ended one stays so.

        A running job is reported as running until its work has ended. Raises NotFound.
        """
        with self._lock:
            job, entry = self._find(job_id), self._entries.get(job_id)
            waited = entry is not None and job_id in self._lanes.get(entry.lane, ())
            if waited and entry is not None:
                self._lanes[entry.lane].remove(job_id)
        if entry is None:
            return job
        entry.progress.cancel()
        if waited:
            self._end(job_id, entry, state="cancelled", error=JobCancelled())
        return self.get(job_id)

    def forget(self, job_id: str) -> None:
        """Remove a job from the list if it has ended. Raises NotFound."""
        with self._lock:
            if self._find(job_id).state in ENDED:
                del self._jobs[job_id]

    def close(self) -> None:
        """Cancel waiting jobs, start no further ones, and wait for the running ones."""
        with self._lock:
            self._closed = True
            waiting = [job_id for lane in self._lanes.values() for job_id in lane]
        for job_id in waiting:
            self.cancel(job_id)
        for pool in (self._prompt, self._others):
            pool.shutdown()

    def _begin(self, job_id: str, entry: _Entry) -> None:
        pool = self._prompt if self._jobs[job_id].kind in PROMPT else self._others
        pool.submit(self._run, job_id, entry)

    def _run(self, job_id: str, entry: _Entry) -> None:
        self._set(job_id, state="running", stage="starting")
        try:
            entry.progress.check()
            result = entry.work(entry.progress)
            self._end(job_id, entry, state="done", fraction=1.0, result=result)
        except VfixError as error:
            cancelled = isinstance(error, JobCancelled)
            self._end(job_id, entry, state="cancelled" if cancelled else "failed", error=error)
        except Exception as error:
            # Neither the log nor the response may quote the content of a file (HAZ-33).
            _LOG.error("a job met an unexpected %s", error_places(error))
            self._end(job_id, entry, state="failed", error=VfixError("The planner met an unexpected error."))
        finally:
            self._next(entry.lane)

    def _next(self, lane: str) -> None:
        """Start the next waiting job of a lane."""
        with self._lock:
            if not self._lanes[lane]:
                del self._lanes[lane]
                return
            job_id = self._lanes[lane].popleft()
            entry = self._entries[job_id]
            if not self._closed:
                self._begin(job_id, entry)
                return
        self._end(job_id, entry, state="cancelled", error=JobCancelled())  # `close` has begun, but not cancelled it yet
        self._next(lane)

    def _end(self, job_id: str, entry: _Entry, *, state: JobState, **changes: object) -> None:
        try:
            entry.clean_up()
        finally:
            self._set(job_id, state=state, stage=state, **changes)
            with self._lock:
                self._entries.pop(job_id, None)
            entry.done.set()

    def _report(self, job_id: str, stage: str, fraction: float) -> None:
        self._set(job_id, stage=stage, fraction=min(max(fraction, 0.0), 1.0))

    def _set(self, job_id: str, **changes: object) -> None:
        with self._lock:
            if job_id in self._jobs:
                self._jobs[job_id] = replace(self._jobs[job_id], **changes)  # type: ignore[arg-type]
                self._version += 1

    def _find(self, job_id: str) -> Job:
        if job_id not in self._jobs:
            raise NotFound(f"there is no job {job_id!r:.80}.")
        return self._jobs[job_id]

    def _forget_old(self) -> None:
        """Drop the oldest ended jobs."""
        ended = [job_id for job_id, job in self._jobs.items() if job.state in ENDED]
        for job_id in ended[: max(0, len(self._jobs) - _KEPT)]:
            del self._jobs[job_id]
