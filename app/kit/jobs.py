"""Work that takes longer than a request: started, watched, cancelled, listed, and remembered for a while."""

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
    "refinement",
]  # fmt: skip
JobState = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: frozenset[JobState] = frozenset({"done", "failed", "cancelled"})

THREADS = 2  # for each of the two sorts of work
PROMPT: frozenset[JobKind] = frozenset({"dry_run", "run"})  # somebody looks at what it is about, and waits
_KEPT = 100
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """How far a job is.

    kind: what is done. case_id: of the case that it works on, None where it makes one. subject: what a person calls
    the work, such as a file's name. stage: what it does now, in words; fraction: 0 … 1 of the whole.
    result: id of what was made. error: why it failed, or was cancelled.
    """

    id: str
    kind: JobKind
    case_id: str | None = None
    subject: str = ""
    state: JobState = "queued"
    stage: str = "waiting"
    fraction: float = 0.0
    result: str | None = None
    error: VfixError | None = None
    created: str = field(default_factory=utc_now)


class Progress:
    """What the work of a job reports to: called with the stage in words and the fraction of the whole that is done.

    It raises JobCancelled where the job was cancelled, so work that reports often ends soon.
    """

    def __init__(self, tell: Callable[[str, float], None]) -> None:
        self._tell = tell
        self._told: tuple[str, float] | None = None
        self._cancelled = threading.Event()
        self._on_cancel: Callable[[], None] = lambda: None
        self._lock = threading.Lock()

    def __call__(self, stage: str, fraction: float) -> None:
        self.check()
        if self._told != (stage, fraction):  # a run may report at every step
            self._told = (stage, fraction)
            self._tell(stage, fraction)

    def check(self) -> None:
        """Raises JobCancelled once the job was cancelled."""
        if self._cancelled.is_set():
            raise JobCancelled

    def on_cancel(self, act: Callable[[], None]) -> None:
        """What ends the work from another thread when the job is cancelled; it is called at once where that was."""
        with self._lock:
            self._on_cancel = act
            late = self._cancelled.is_set()
        if late:
            act()

    def cancel(self) -> None:
        """The job is to end."""
        with self._lock:
            self._cancelled.set()
            act = self._on_cancel
        act()


Work = Callable[[Progress], str]


@dataclass(frozen=True)
class _Entry:
    """A job that has not ended; done: set when nothing of it runs any more."""

    work: Work
    clean_up: Callable[[], None]
    progress: Progress
    lane: str
    same: str = ""
    done: threading.Event = field(default_factory=threading.Event)


class Jobs:
    """Jobs of one lane run one after another; may be used from any thread.

    Of those that somebody waits for, `PROMPT`, two run at a time, and two of all others beside them: no import or
    suggestion, which may take minutes, keeps a dry run waiting.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: OrderedDict[str, Job] = OrderedDict()  # oldest first
        self._entries: dict[str, _Entry] = {}
        self._lanes: dict[str, deque[str]] = {}  # what waits in a lane that is busy
        self._closed = False
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
        same: str = "",
    ) -> Job:
        """Queue a piece of work that reports progress and returns the id of what it made.

        clean_up: called when the work has ended, and also when it is never begun.
        lane: of the jobs of one lane one runs at a time, in their order: imports, which may take a gigabyte each, or
            the dry runs of one case.
        same: equal for jobs that make the same. Whoever asks for what waits or runs already gets that job, and
            `clean_up` is called at once; '' is like no other.
        """
        job = Job(f"job-{secrets.token_hex(6)}", kind, case_id, subject)
        entry = _Entry(work, clean_up, Progress(lambda *progress: self._tell(job.id, *progress)), lane, same)
        with self._lock:
            closed = self._closed
            goes_on = (job_id for job_id, other in self._entries.items() if same and other.same == same)
            known = self._jobs.get(next(goes_on, ""))
            if not closed and known is None:
                self._jobs[job.id], self._entries[job.id] = job, entry
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

    def get(self, job_id: str) -> Job:
        """How far a job is. Raises NotFound."""
        with self._lock:
            return self._find(job_id)

    def list(self, case_id: str | None = None) -> tuple[Job, ...]:
        """The jobs that are remembered, of a case or all, oldest first: what runs and waits, and what ended lately."""
        with self._lock:
            return tuple(job for job in self._jobs.values() if case_id in (None, job.case_id))

    def wait(self, job_id: str, seconds: float | None = None) -> Job:
        """The job when it has ended, or as it is after so many seconds. Raises NotFound."""
        with self._lock:
            self._find(job_id)
            entry = self._entries.get(job_id)
        if entry is not None:
            entry.done.wait(seconds)
        return self.get(job_id)

    def cancel(self, job_id: str) -> Job:
        """End a job that waits or runs; one that is past being ended goes on, and one that has ended stays as it is.

        A job that runs is still reported as running until its work has ended. Raises NotFound.
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
        """Take a job that has ended off the list. Raises NotFound, and leaves one that has not ended."""
        with self._lock:
            if self._find(job_id).state in ENDED:
                del self._jobs[job_id]

    def close(self) -> None:
        """Start no further job, and wait for those that run."""
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
            # Neither the log nor the answer may quote what was in the file (HAZ-33).
            _LOG.error("a job met an unexpected %s", error_places(error))
            self._end(job_id, entry, state="failed", error=VfixError("The planner met an unexpected error."))
        finally:
            self._next(entry.lane)

    def _next(self, lane: str) -> None:
        """Start what waits in a lane."""
        with self._lock:
            if not self._lanes[lane]:
                del self._lanes[lane]
                return
            job_id = self._lanes[lane].popleft()
            entry = self._entries[job_id]
            if not self._closed:
                self._begin(job_id, entry)
                return
        self._end(job_id, entry, state="cancelled", error=JobCancelled())  # between the planner's end and its asking
        self._next(lane)

    def _end(self, job_id: str, entry: _Entry, *, state: JobState, **changes: object) -> None:
        try:
            entry.clean_up()
        finally:
            self._set(job_id, state=state, stage=state, **changes)
            with self._lock:
                self._entries.pop(job_id, None)
            entry.done.set()

    def _tell(self, job_id: str, stage: str, fraction: float) -> None:
        self._set(job_id, stage=stage, fraction=min(max(fraction, 0.0), 1.0))

    def _set(self, job_id: str, **changes: object) -> None:
        with self._lock:
            if job_id in self._jobs:
                self._jobs[job_id] = replace(self._jobs[job_id], **changes)  # type: ignore[arg-type]

    def _find(self, job_id: str) -> Job:
        if job_id not in self._jobs:
            raise NotFound(f"there is no job {job_id!r:.80}.")
        return self._jobs[job_id]

    def _forget_old(self) -> None:
        """Of the jobs that have ended, remember the newest."""
        ended = [job_id for job_id, job in self._jobs.items() if job.state in ENDED]
        for job_id in ended[: max(0, len(self._jobs) - _KEPT)]:
            del self._jobs[job_id]
