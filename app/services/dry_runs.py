"""Dry runs of plans as jobs: one at a time per case, and one for all who ask for the same."""

from __future__ import annotations

import threading

from app.services.jobs import ENDED, Job, Jobs, Progress
from app.services.plan_model import Plan
from app.services.planning import PlanEvaluation, Planning


class DryRuns:
    """Starts dry runs; may be used from any thread."""

    def __init__(self, jobs: Jobs, planning: Planning) -> None:
        self._jobs, self._planning = jobs, planning
        self._lock = threading.RLock()  # a job that is refused is cleaned up by who starts it
        self._started: dict[str, str] = {}  # job by what is driven

    def start(self, plan: Plan) -> Job:
        """Drive a plan as a job, whose result is the plan's id; the job that drives it already, where there is one."""
        key = self._planning.content_key(plan)

        def work(progress: Progress) -> str:
            self._planning.evaluate(plan, progress)
            return plan.id

        with self._lock:
            known = self._started.get(key)
            if known is not None and (job := self._jobs.get(known)).state not in ENDED:
                return job
            lane = f"dry_run {plan.case_id}"
            job = self._jobs.submit(
                work, lambda: self._ended(key), kind="dry_run", lane=lane, case_id=plan.case_id, subject=plan.name
            )
            self._started[key] = job.id
            return job

    def evaluate(self, plan: Plan) -> PlanEvaluation:
        """The answer, awaited. Raises what the run fails with, JobCancelled where somebody cancels it."""
        if not self._planning.is_evaluated(plan):
            job = self._jobs.wait(self.start(plan).id)
            if job.error is not None:
                raise job.error
        return self._planning.evaluate(plan)

    def _ended(self, key: str) -> None:
        with self._lock:
            self._started.pop(key, None)
