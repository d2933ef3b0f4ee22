"""Jobs: how far an import or a dry run is, cancelling it, and the answer to what an import's file does not say."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel

from app.api.dependencies import ERRORS, ErrorWords, Identifier, ServicesDep, Wish
from app.error_shape import error_code, error_details
from app.services.jobs import ENDED, Job, JobKind, JobState

router = APIRouter(prefix="/jobs", tags=["jobs"], responses=ERRORS)


class JobPublic(BaseModel):
    """A job; `result` is the id of what it made, `error` is why it failed or was cancelled.

    case_id: of the case that it works on, null for an import. subject: what it works on, for people.
    """

    id: str
    kind: JobKind
    case_id: str | None
    subject: str
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
    """What runs and waits, and what ended lately, oldest first; of a case, or all."""
    return [JobPublic.of(job) for job in services.jobs.list(case_id)]


@router.get("/{job_id}")
def show_job(job_id: Identifier, services: ServicesDep) -> JobPublic:
    """How far a job is."""
    return JobPublic.of(services.jobs.get(job_id))


@router.delete("/{job_id}")
def cancel_job(job_id: Identifier, services: ServicesDep) -> JobPublic:
    """Cancel a job that waits or runs; take one that has ended off the list, with what is kept for it."""
    job = services.jobs.get(job_id)
    if job.state not in ENDED:
        return JobPublic.of(services.jobs.cancel(job_id))
    services.import_jobs.forget(job_id)
    return JobPublic.of(job)


class ImportAnswer(Wish):
    """Frame and unit of a file that does not name them."""

    frame: Literal["LPS", "RAS"] | None = None
    units: Literal["mm", "m"] | None = None


@router.post("/{job_id}/answer", status_code=202)
def answer_job(job_id: Identifier, answer: ImportAnswer, services: ServicesDep) -> JobPublic:
    """Repeat an import that failed with `frame_error` on the file that is kept here; the answer is a new job."""
    return JobPublic.of(services.import_jobs.answer(job_id, answer.frame, answer.units))


@router.delete("/{job_id}/upload", status_code=204, response_class=Response)
def discard_upload(job_id: Identifier, services: ServicesDep) -> None:
    """Delete the file that is kept for the answer."""
    services.import_jobs.discard(job_id)
