"""Jobs: how far an import is."""

from fastapi import APIRouter
from pydantic import BaseModel

from app.api.dependencies import ERRORS, ErrorWords, Identifier, ServicesDep
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
