"""Dry runs of plans as jobs: one at a time per case; equal requests share one job."""

from __future__ import annotations

from collections.abc import Callable

from app.kit.jobs import Job, Jobs, Progress
from app.planning.evaluation import Planning
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.plans.model import Plan
from app.registration.driven import AS_STORED, AsStored, Through


class DryRunJobs:
    """Starts dry runs. Thread-safe."""

    def __init__(self, jobs: Jobs, planning: Planning) -> None:
        self._jobs, self._planning = jobs, planning

    def start(self, plan: Plan, options: RehearsalOptions = NO_OPTIONS, through: Through = AS_STORED) -> Job:
        """Start the dry run of a plan as a job, or return the job that runs the same; its result is the plan's id.

        options: of the rehearsal, whose fixtures also act in the dry run. through: as in `Planning.evaluate`.
        """

        def work(progress: Progress) -> str:
            self._planning.evaluate(plan, progress, options, through)
            return plan.id

        same = f"dry_run {self._planning.content_key(plan, options, through)}"
        lane = f"dry_run {plan.case_id}"
        return self._jobs.submit(
            work, kind="dry_run", lane=lane, case_id=plan.case_id, subject=plan.name, document_id=plan.id, same=same
        )

    def evaluate(
        self,
        plan: Plan,
        options: RehearsalOptions = NO_OPTIONS,
        began: Callable[[str], object] = bool,
        through: Through = AS_STORED,
    ) -> PlanEvaluation:
        """Wait for the dry run of a plan and return its evaluation.

        began: called with the id of the job, if one has to be awaited. through: as in `Planning.evaluate`.
        Raises the error of the run, or JobCancelled if the job is cancelled.
        """
        if isinstance(through, AsStored):
            through = self._planning.registration(plan)  # read once: the job and the answer use the same registration
        if not self._planning.is_evaluated(plan, options, through):
            job_id = self.start(plan, options, through).id
            began(job_id)
            job = self._jobs.wait(job_id)
            if job.error is not None:
                raise job.error
        return self._planning.evaluate(plan, options=options, through=through)
