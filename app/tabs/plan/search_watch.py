"""What the searches for a path of the open plan have come to, while somebody looks at it."""

from __future__ import annotations

from app.kit.jobs import ENDED, Job
from app.plans.model import Plan
from app.services import Services
from app.tabs.plan.hints import SearchState


class SearchWatch:
    """Follows the jobs of one client's plan. Owned by the session's thread."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._version = -1  # of the jobs
        self._followed: Job | None = None  # that runs
        self._none: tuple[str, int] | None = None  # the plan and its revision that no way was found in

    def state(self, plan: Plan) -> SearchState:
        """'runs', 'none' where no way was found in the plan as it is, else ''."""
        if self._followed is not None and self._followed.document_id == plan.id:
            return "runs"
        return "none" if self._none == (plan.id, plan.revision) else ""

    def changed(self, plan: Plan | None) -> bool:
        """Look at the jobs; whether a search in the plan has begun or ended since."""
        version, jobs = self._services.jobs.going_on()
        if version == self._version:
            return False
        self._version, before = version, self._followed
        wanted = (job for job in jobs if plan is not None and (job.kind, job.document_id) == ("suggestion", plan.id))
        self._followed = next(wanted, None)
        if (before and before.id) == (self._followed and self._followed.id):
            return False
        self._none = None
        if before is not None and plan is not None and before.document_id == plan.id and self._found_none(before.id):
            self._none = plan.id, plan.revision
        return True

    def _found_none(self, job_id: str) -> bool:
        job = next((job for job in self._services.jobs.list() if job.id == job_id and job.state in ENDED), None)
        if job is None or job.result is None:
            return False
        return not self._services.suggestions.paths(job.result).found.alternatives
