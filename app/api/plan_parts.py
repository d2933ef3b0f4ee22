"""Parts of plans: paths, protected structures, bone removal. Changes of them are operations."""

from __future__ import annotations

from fastapi import APIRouter

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, ServicesDep
from app.plans.paths import PlanPath
from app.plans.service import Plan
from app.plans.zones import PlanZone, RemovedBone

router = APIRouter(tags=["plan parts"], responses=ERRORS)


@router.get("/plans/{plan_id}/zones")
def list_zones(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanZone]:
    """Protected structures of a plan."""
    return list(_plan(plan_id, services, condition).content.zones)


@router.get("/plans/{plan_id}/removed-bone")
def list_removed_bone(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[RemovedBone]:
    """Regions of bone removal of a plan."""
    return list(_plan(plan_id, services, condition).content.removed_bone)


@router.get("/plans/{plan_id}/paths")
def list_paths(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanPath]:
    """Paths of a plan; the plan's `path_id` says which is chosen."""
    return list(_plan(plan_id, services, condition).content.paths)


def _plan(plan_id: str, services: ServicesDep, condition: Condition) -> Plan:
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return plan
