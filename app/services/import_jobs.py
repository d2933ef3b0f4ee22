"""Imports as jobs; a file that does not say its frame or unit is kept, so that the answer alone repeats the import."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from app.services.importing import ImportRequest, ImportService, case_name
from app.services.jobs import Job, Jobs, Progress
from vfix_engine.errors import FrameError, InputError

KEPT = 2  # files that wait for an answer; each may take gigabytes


@dataclass(frozen=True)
class _Started:
    """What a job was started with; remove: deletes its file."""

    request: ImportRequest
    remove: Callable[[], None]
    asks: threading.Event = field(default_factory=threading.Event)  # it has ended, and its file is kept for an answer
    ended: threading.Event = field(default_factory=threading.Event)


class ImportJobs:
    """Starts imports; may be used from any thread."""

    def __init__(self, jobs: Jobs, importing: ImportService) -> None:
        self._jobs, self._importing = jobs, importing
        self._lock = threading.Lock()
        self._started: dict[str, _Started] = {}  # oldest first

    def start(self, request: ImportRequest, remove: Callable[[], None]) -> Job:
        """Import a file as a job; `remove` is called once the file is not needed any more."""
        started = _Started(request, remove)

        def work(progress: Progress) -> str:
            cancellation = self._importing.cancellation()
            progress.on_cancel(cancellation.cancel)
            try:
                return self._importing.run(request, progress, cancellation).id
            except InputError as error:
                progress.check()  # then the file is not what is wrong
                if isinstance(error, FrameError) and error.missing:
                    started.asks.set()
                raise

        def ended() -> None:
            if not started.asks.is_set():
                remove()
            started.ended.set()
            self._forget_old()

        job = self._jobs.submit(work, ended, kind="import", lane="import", subject=_subject(request))
        with self._lock:
            self._started[job.id] = started
        self._forget_old()
        return job

    def answer(self, job_id: str, frame: str | None, unit: str | None) -> Job:
        """Repeat an import with the frame and unit that were missing. Raises NotFound or InputError."""
        started = self._take(job_id)
        request = started.request
        return self.start(replace(request, frame=frame or request.frame, unit=unit or request.unit), started.remove)

    def discard(self, job_id: str) -> None:
        """Delete the file of an import that waits for an answer. Raises NotFound or InputError."""
        self._take(job_id).remove()

    def forget(self, job_id: str) -> None:
        """Take a job that has ended off the list, with the file that may be kept for it. Raises NotFound."""
        with self._lock:
            started = self._started.get(job_id)
            waits = started is not None and started.asks.is_set() and started.ended.is_set()
        if waits:
            self.discard(job_id)
        self._jobs.forget(job_id)

    def _take(self, job_id: str) -> _Started:
        self._jobs.get(job_id)
        with self._lock:
            started = self._started.get(job_id)
            if started is None or not started.asks.is_set():
                raise InputError("this import does not wait for an answer; upload the file anew.")
            return self._started.pop(job_id)

    def _forget_old(self) -> None:
        """Of the imports that have ended, keep the newest ones that wait for an answer."""
        with self._lock:
            waiting = [job_id for job_id, started in self._started.items() if started.asks.is_set()]
            done = [job_id for job_id, started in self._started.items() if started.ended.is_set()]
            for job_id in waiting[:-KEPT]:
                self._started.pop(job_id).remove()
            for job_id in set(done) - set(waiting):
                del self._started[job_id]


def _subject(request: ImportRequest) -> str:
    """What the case will be called; '' for a name that cannot be used, which the import refuses."""
    try:
        return case_name(request)
    except InputError:
        return ""
