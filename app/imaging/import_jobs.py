"""Imports as jobs. The file of an import that needs more information is kept, so that it need not be uploaded again.

The missing information is the frame or unit, the choice between several series, or the case of a segmentation.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from app.imaging.importing import ImportRequest, ImportService, OverlayRequest
from app.kit.errors import AnswerUnusable
from app.kit.jobs import Job, JobKind, Jobs, Progress
from vfix_engine.anatomy.labels.reading import SegmentationRequest
from vfix_engine.errors import InputError

Request = ImportRequest | SegmentationRequest | OverlayRequest

KEPT = 2  # files kept until their question is answered; each may take gigabytes


@dataclass(frozen=True)
class _Started:
    """A started import. remove: deletes its file."""

    request: Request
    remove: Callable[[], None]
    case_id: str | None = None  # the case that a segmentation or a second volume is imported into
    before: _Started | None = None  # the earlier start whose question this one answers
    question: list[InputError] = field(default_factory=list)  # the error that states the missing information, if any
    asks: threading.Event = field(default_factory=threading.Event)  # it ended with a question, and its file is kept
    ended: threading.Event = field(default_factory=threading.Event)


@dataclass(frozen=True)
class Answer:
    """Information missing in a file. series: number of the series, from 1. into: id of the case of a segmentation."""

    frame: str | None = None
    unit: str | None = None
    series: int | None = None
    into: str | None = None


class ImportJobs:
    """Starts imports. Thread-safe."""

    def __init__(self, jobs: Jobs, importing: ImportService) -> None:
        self._jobs, self._importing = jobs, importing
        self._lock = threading.Lock()
        self._started: dict[str, _Started] = {}  # oldest first

    def start(self, request: ImportRequest, remove: Callable[[], None]) -> Job:
        """Import a head as a job. remove: called once the file is no longer needed."""
        return self._start(_Started(request, remove))

    def start_structures(self, case_id: str, request: SegmentationRequest, remove: Callable[[], None]) -> Job:
        """Import a segmentation into a case as a job, whose result is the id of the case. remove: as in `start`."""
        return self._start(_Started(request, remove, case_id))

    def start_overlay(self, case_id: str, request: OverlayRequest, remove: Callable[[], None]) -> Job:
        """Import an overlay volume into a case as a job, whose result is the id of the case. remove: as in `start`."""
        return self._start(_Started(request, remove, case_id))

    def start_lumen(self, case_id: str, seed: tuple[float, float, float], air_hu: float) -> Job:
        """Make a case of another lumen of a case's CT as a job, whose result is its id. Raises NotFound."""
        self._importing.check_case(case_id)

        def work(progress: Progress) -> str:
            cancellation = self._importing.cancellation()
            progress.on_cancel(cancellation.cancel)
            return self._importing.lumen_at(case_id, seed, air_hu, progress, cancellation).id

        return self._jobs.submit(work, kind="import", lane="import", case_id=case_id, subject="Lumen")

    def _run(self, started: _Started, progress: Progress) -> str:
        """Import and return the id of the new case, or of the case that structures or an overlay are added to."""
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
                progress.check()  # raises if the job was cancelled, in which case the error is not due to the file
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

    def answer(self, job_id: str, answer: Answer) -> Job:
        """Repeat an import with the missing information.

        Raises NotFound or InputError; the file is kept in these cases.
        """
        started = self._look(job_id)
        if isinstance(started.question[0], AnswerUnusable) and started.before is not None:
            started = started.before  # repeat from before the unusable answer
        request = started.request
        answered = replace(request, frame=answer.frame or request.frame, unit=answer.unit or request.unit)
        case_id = started.case_id
        if answer.series is not None:
            if isinstance(answered, SegmentationRequest):
                raise InputError("a series is chosen of a CT, and this is a segmentation.")
            answered = replace(answered, series=answer.series)
        if answer.into is not None and isinstance(answered, OverlayRequest):
            raise InputError("a second volume belongs to the head that it was sent to.")
        if answer.into is not None:
            self._importing.check_case(answer.into)
            answered, case_id = _as_segmentation(answered), answer.into
        if not isinstance(answered, ImportRequest) and case_id is None:
            raise InputError("this is a segmentation; say the case that it is imported into.")
        self._take(job_id)
        if getattr(self._jobs.get(job_id).error, "series", ()):
            self._jobs.forget(job_id)  # its error quotes series descriptions of the file
        return self._start(_Started(answered, started.remove, case_id, started))

    def discard(self, job_id: str) -> None:
        """Delete the file of an import that needs an answer. Raises NotFound or InputError."""
        self._take(job_id).remove()

    def forget(self, job_id: str) -> None:
        """Remove a finished job from the list, and its file if one is kept. Raises NotFound."""
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
        """Drop finished imports except for the newest ones that need an answer."""
        with self._lock:
            waiting = [job_id for job_id, started in self._started.items() if started.asks.is_set()]
            done = [job_id for job_id, started in self._started.items() if started.ended.is_set()]
            for job_id in waiting[:-KEPT]:
                self._started.pop(job_id).remove()
            for job_id in set(done) - set(waiting):
                del self._started[job_id]


def _question(error: InputError, before: _Started | None) -> InputError | None:
    """Return the error that asks for information: a new question, or the earlier one after an unusable answer."""
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
    """Return the name of the job: the requested name, or the kind of import; '' for a name that is not allowed."""
    if isinstance(request, SegmentationRequest):
        return "Segmentation"
    try:
        request.wanted.check()
    except InputError:
        return ""
    if request.name is not None:
        return request.name.strip()
    return request.sort if isinstance(request, ImportRequest) else "Second volume"
