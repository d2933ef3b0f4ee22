"""Plans of every case, dry runs of a plan, and the nearest point clear of bone."""

import math
from typing import Annotated

from fastapi import APIRouter, Query

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.plan_models import EvaluationPublic, SnapPublic, SnapRequest, SoftTissuePublic
from app.plans.public import PlanPublic

router = APIRouter(tags=["plans"], responses=ERRORS)

Deleted = Annotated[bool, Query()]


@router.get("/plans")
def list_plans(
    services: ServicesDep, case_id: Annotated[str | None, Query(max_length=64)] = None, include_deleted: Deleted = False
) -> list[PlanPublic]:
    """Plans of a case, or of all, oldest first."""
    return [PlanPublic.of(plan) for plan in services.plans.list(case_id, include_deleted)]


@router.post("/cases/{case_id}/snap")
def snap(case_id: Identifier, body: SnapRequest, services: ServicesDep) -> SnapPublic:
    """The nearest point clear of bone, and what surrounds it."""
    return SnapPublic.model_validate(
        services.planning.snap(services.cases.get(case_id), body.position), from_attributes=True
    )


@router.post("/plans/{plan_id}/evaluation", status_code=202)
def start_evaluation(plan_id: Identifier, services: ServicesDep) -> JobPublic:
    """Start a dry run of the plan as a job; afterwards the evaluation is available at once."""
    return JobPublic.of(
        services.dry_runs.start(services.plans.get(plan_id), services.rehearsal_options.of(plan_id).in_force)
    )


@router.get("/plans/{plan_id}/evaluation")
def evaluate(plan_id: Identifier, services: ServicesDep) -> EvaluationPublic:
    """Dry run of the plan; takes seconds the first time."""
    plan = services.plans.get(plan_id)
    result = services.dry_runs.evaluate(plan, services.rehearsal_options.of(plan_id).in_force)
    clearance = [None if math.isnan(value) else value for value in result.clearance.tolist()]
    return EvaluationPublic(
        revision=plan.revision,
        verdict=result.verdict.level,
        word=result.verdict.word,
        short=result.verdict.short,
        words=result.verdict.words,
        s_mm=result.s.tolist(),
        positions=result.positions.tolist(),
        clearance_mm=clearance,
        min_clearance_mm=result.min_clearance_mm,
        bone_clearance_mm=clearance,
        min_bone_clearance_mm=result.min_clearance_mm,
        soft_tissue=SoftTissuePublic.model_validate(result.soft_tissue, from_attributes=True),
        completed=result.completed,
        reason=result.reason,
        reached_mm=result.reached_mm,
        length_mm=result.length_mm,
        degree=result.degree,
        transform_base_to_patient=None if result.placement is None else result.placement.tolist(),
        transform_base_to_image=result.base.tolist(),
        q_start=result.q_start.tolist(),
        removed_mm3=result.removed_mm3,
    )
