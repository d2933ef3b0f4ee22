"""Imports as jobs; a file that leaves something open is kept, so that the answer alone repeats the import.

That is its frame or unit, which of several series is meant, or the case of a segmentation.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from app.services.errors import AnswerUnusable
from app.services.importing import ImportRequest, ImportService, OverlayRequest
from app.services.jobs import Job, JobKind, Jobs, Progress
from vfix_engine.errors import InputError
from vfix_engine.imaging.labels.reading import SegmentationRequest

Request = ImportRequest | SegmentationRequest | OverlayRequest

KEPT = 2  # files that wait for an answer; each may take gigabytes


@dataclass(frozen=True)
class _Started:
    """What a job was started with; remove: deletes its file."""

    request: Request
    remove: Callable[[], None]
    case_id: str | None = None  # that a segmentation or a second volume is imported into
    before: _Started | None = None  # the start that left a question open, which this one answers
    question: list[InputError] = field(default_factory=list)  # what it left open, once that is known
    asks: threading.Event = field(default_factory=threading.Event)  # it has ended, and its file is kept for an answer
    ended: threading.Event = field(default_factory=threading.Event)


@dataclass(frozen=True)
class Answer:
    """What a file leaves open. series: number of one of several, from 1; into: the case of a segmentation."""

    frame: str | None = None
    unit: str | None = None
    series: int | None = None
    into: str | None = None


class ImportJobs:
    """Starts imports; may be used from any thread."""

    def __init__(self, jobs: Jobs, importing: ImportService) -> None:
        self._jobs, self._importing = jobs, importing
        self._lock = threading.Lock()
        self._started: dict[str, _Started] = {}  # oldest first

    def start(self, request: ImportRequest, remove: Callable[[], None]) -> Job:
        """Import a head as a job; `remove` is called once the file is not needed any more."""
        return self._start(_Started(request, remove))

    def start_structures(self, case_id: str, request: SegmentationRequest, remove: Callable[[], None]) -> Job:
        """Import a segmentation into a case as a job, whose result is the case; `remove` as in `start`."""
        return self._start(_Started(request, remove, case_id))

    def start_overlay(self, case_id: str, request: OverlayRequest, remove: Callable[[], None]) -> Job:
        """Lay a volume over a case as a job, whose result is the case; `remove` as in `start`."""
        return self._start(_Started(request, remove, case_id))

    def _run(self, started: _Started, progress: Progress) -> str:
        """Import; returns the id of the new case, or of that which the structures are added to."""
        request, cancellation = started.request, self._importing.cancellation()
        progress.on_cancel(cancellation.cancel)
        if isinstance(request, ImportRequest):
            return self._importing.run(request, progress, cancellation).id
        assert started.case_id is not None
        if isinstance(request, OverlayRequest):
            self._importing.add_overlay(started.case_id, request, progress, cancellation)
            return started.case_id
        self._importing.add_structures(started.case_id, request, progress, cancellation)
        return started.case_id

    def _start(self, started: _Started) -> Job:
        def work(progress: Progress) -> str:
            try:
                return self._run(started, progress)
            except InputError as error:
                progress.check()  # then the file is not what is wrong
                asked = _question(error, started.before)
                if asked is not None:
                    started.question.append(asked)
                    started.asks.set()
                    raise asked from error
                raise

        def ended() -> None:
            if not started.asks.is_set():
                started.remove()
            started.ended.set()
            self._forget_old()

        kind: JobKind = "import" if started.case_id is None else "structures"
        if isinstance(started.request, OverlayRequest):
            kind = "overlay"
        subject = _subject(started.request)
        job = self._jobs.submit(work, ended, kind=kind, lane="import", case_id=started.case_id, subject=subject)
        with self._lock:
            self._started[job.id] = started
        self._forget_old()
        return job

    def answer(self, job_id: str, given: Answer) -> Job:
        """Repeat an import with what was missing. Raises NotFound or InputError; the file is kept then."""
        started = self._look(job_id)
        if isinstance(started.question[0], AnswerUnusable) and started.before is not None:
            started = started.before  # its answer is taken back with it
        request = started.request
        answered = replace(request, frame=given.frame or request.frame, unit=given.unit or request.unit)
        case_id = started.case_id
        if given.series is not None:
            if isinstance(answered, SegmentationRequest):
                raise InputError("a series is chosen of a head, and this is a segmentation.")
            answered = replace(answered, series=given.series)
        if given.into is not None and isinstance(answered, OverlayRequest):
            raise InputError("a second volume is laid over the head that it was sent to.")
        if given.into is not None:
            self._importing.check_case(given.into)
            answered, case_id = _as_segmentation(answered), given.into
        if not isinstance(answered, ImportRequest) and case_id is None:
            raise InputError("this is a segmentation; say the case that it is imported into.")
        self._take(job_id)
        if getattr(self._jobs.get(job_id).error, "series", ()):
            self._jobs.forget(job_id)  # it quotes descriptions of the file
        return self._start(_Started(answered, started.remove, case_id, started))

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

    def _look(self, job_id: str) -> _Started:
        self._jobs.get(job_id)
        with self._lock:
            return self._waiting(job_id)

    def _take(self, job_id: str) -> _Started:
        self._jobs.get(job_id)
        with self._lock:
            self._waiting(job_id)
            return self._started.pop(job_id)

    def _waiting(self, job_id: str) -> _Started:
        started = self._started.get(job_id)
        if started is None or not started.asks.is_set():
            raise InputError("this import does not wait for an answer; upload the file anew.")
        return started

    def _forget_old(self) -> None:
        """Of the imports that have ended, keep the newest ones that wait for an answer."""
        with self._lock:
            waiting = [job_id for job_id, started in self._started.items() if started.asks.is_set()]
            done = [job_id for job_id, started in self._started.items() if started.ended.is_set()]
            for job_id in waiting[:-KEPT]:
                self._started.pop(job_id).remove()
            for job_id in set(done) - set(waiting):
                del self._started[job_id]


def _question(error: InputError, before: _Started | None) -> InputError | None:
    """The error that asks for something: a new question, or the former one after an answer that could not be used."""
    if getattr(error, "missing", ()):
        return error
    if before is None or not before.question:
        return None
    asked = before.question[0]
    return AnswerUnusable(str(error), getattr(asked, "missing", ()), getattr(asked, "series", ()))


def _as_segmentation(request: Request) -> SegmentationRequest:
    if isinstance(request, SegmentationRequest):
        return request
    assert isinstance(request, ImportRequest)
    return SegmentationRequest(request.path, names=request.names, frame=request.frame, unit=request.unit)


def _subject(request: Request) -> str:
    """What the work is called: the name to be, or what it is; '' for a name that the import refuses."""
    if isinstance(request, SegmentationRequest):
        return "Segmentation"
    try:
        request.wanted.check()
    except InputError:
        return ""
    if request.name is not None:
        return request.name.strip()
    return request.sort if isinstance(request, ImportRequest) else "Second volume"
