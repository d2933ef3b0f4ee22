"""Jobs: how far an import is, and the answer to what its file does not say."""

from typing import Literal

from fastapi import APIRouter, Response
from pydantic import BaseModel

from app.api.dependencies import ERRORS, ErrorWords, Identifier, ServicesDep, Wish
from app.error_shape import error_code, error_details
from app.services.jobs import Job, JobState

router = APIRouter(prefix="/jobs", tags=["jobs"], responses=ERRORS)


class JobPublic(BaseModel):
    """A job; `result` is the id of what it made, `error` is why it failed."""

    id: str
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
        return cls(id=job.id, state=job.state, stage=job.stage, fraction=job.fraction, result=job.result, error=error)


@router.get("/{job_id}")
def show_job(job_id: Identifier, services: ServicesDep) -> JobPublic:
    """How far a job is."""
    return JobPublic.of(services.jobs.get(job_id))


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
