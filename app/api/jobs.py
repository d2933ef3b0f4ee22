"""Jobs: progress and cancellation of imports and dry runs, and missing frame or unit of an import."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, ErrorWords, Identifier, RequestBody, ServicesDep
from app.error_shape import error_code, error_details
from app.imaging.import_jobs import Answer
from app.kit.jobs import ENDED, Job, JobKind, JobState

router = APIRouter(prefix="/jobs", tags=["jobs"], responses=ERRORS)


class JobPublic(BaseModel):
    """A job; `result` is the id of its result, `error` the reason of a failure or cancellation.

    case_id: null for an import of a head. subject: name of what it works on, for display. document_id: the plan,
    registration or label that it works on, null without one.
    """

    id: str
    kind: JobKind
    case_id: str | None
    subject: str
    document_id: str | None
    created: str
    state: JobState
    stage: str
    fraction: float
    result: str | None
    error: ErrorWords | None

    @classmethod
    def of(cls, job: Job) -> "JobPublic":
        error = None
        if job.error is not None:
            words, details = str(job.error), error_details(job.error)
            error = ErrorWords(code=error_code(job.error), message=words, details=details)
        return cls.model_validate({**vars(job), "error": error})


@router.get("")
def list_jobs(services: ServicesDep, case_id: Annotated[str | None, Query(max_length=64)] = None) -> list[JobPublic]:
    """Running, waiting and recently ended jobs, oldest first; of a case, or all."""
    return [JobPublic.of(job) for job in services.jobs.list(case_id)]


@router.get("/{job_id}")
def show_job(job_id: Identifier, services: ServicesDep) -> JobPublic:
    """State of a job."""
    return JobPublic.of(services.jobs.get(job_id))


@router.delete("/{job_id}")
def cancel_job(job_id: Identifier, services: ServicesDep) -> JobPublic:
    """Cancel a waiting or running job; remove an ended one from the list, with its upload."""
    job = services.jobs.get(job_id)
    if job.state not in ENDED:
        return JobPublic.of(services.jobs.cancel(job_id))
    services.import_jobs.forget(job_id)
    return JobPublic.of(job)


class ImportAnswer(RequestBody):
    """What a file leaves open: frame, unit, one of several series, the case of a segmentation."""

    frame: Literal["LPS", "RAS"] | None = None
    units: Literal["mm", "m", "um"] | None = None
    series: Annotated[int, Field(ge=1, le=100_000)] | None = None
    into: Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.\-]+$")] | None = None


@router.post("/{job_id}/answer", status_code=202)
def answer_job(job_id: Identifier, answer: ImportAnswer, services: ServicesDep) -> JobPublic:
    """Repeat an import that left something open on its stored upload; the response is a new job."""
    given = Answer(answer.frame, answer.units, answer.series, answer.into)
    return JobPublic.of(services.import_jobs.answer(job_id, given))


@router.delete("/{job_id}/upload", status_code=204, response_class=Response)
def discard_upload(job_id: Identifier, services: ServicesDep) -> None:
    """Delete the stored upload of a failed import."""
    services.import_jobs.discard(job_id)
