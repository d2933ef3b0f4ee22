"""Parts of a plan: its paths, its structures to spare, the bone to be removed."""

from __future__ import annotations

from fastapi import APIRouter

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.plans.paths import PlanPath
from app.plans.zones import PlanZone, RemovedBone

router = APIRouter(tags=["plan parts"], responses=ERRORS)


@router.get("/plans/{plan_id}/zones")
def list_zones(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanZone]:
    """Structures to spare of a plan."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.zones)


@router.get("/plans/{plan_id}/removed-bone")
def list_removed_bone(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[RemovedBone]:
    """Regions of a plan in which bone will be removed."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.removed_bone)


@router.get("/plans/{plan_id}/paths")
def list_paths(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanPath]:
    """Paths of a plan; the plan's `path_id` says which is chosen."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.paths)
