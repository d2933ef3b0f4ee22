"""Parts of plans: paths, structures to spare, bone to be removed, the shaft's direction at a point, notes."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query
from pydantic import Field

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, Number, ServicesDep, Wish
from app.api.plan_models import Name, Revision
from app.plans.model import Plan
from app.plans.paths import EntrySide, PlanPath
from app.plans.public import PlanPublic
from app.plans.zones import PlanZone, RemovedBone
from vfix_engine.errors import PlanError

router = APIRouter(tags=["plan parts"], responses=ERRORS)

Seen = Annotated[int | None, Query(ge=0)]
Direction = tuple[Number, Number, Number]


class PathCreate(Wish):
    """A new path, which is chosen: empty with the chosen path's tool, or a copy of another one."""

    name: Name | None = None
    copy_of: Annotated[str | None, Field(max_length=64)] = None
    revision: Revision = None


class PathUpdate(Wish):
    """One per request: rename, say where the path enters, or choose it."""

    name: Name | None = None
    entry_side: EntrySide | None = None
    chosen: Literal[True] | None = None
    revision: Revision = None


class ShaftWish(Wish):
    """The shaft's direction at a path point, LPS from the tip towards the tail, and its roll; null leaves both open."""

    direction: Direction | None
    roll_deg: Number | None = None
    revision: Revision = None


@router.get("/plans/{plan_id}/zones")
def list_zones(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanZone]:
    """Structures to spare of a plan."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.content.zones)


@router.get("/plans/{plan_id}/removed-bone")
def list_removed_bone(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[RemovedBone]:
    """Regions of a plan in which bone will be removed."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.content.removed_bone)


@router.get("/plans/{plan_id}/paths")
def list_paths(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanPath]:
    """Paths of a plan; the plan's `path_id` says which is chosen."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.content.paths)


@router.post("/plans/{plan_id}/paths", status_code=201)
def add_path(plan_id: Identifier, wish: PathCreate, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """Add a path and choose it."""
    expected = condition.expected(wish.revision)
    paths = services.plans.editor(plan_id).paths
    return _told(condition, paths.add(wish.name, copy_of=wish.copy_of, expected_revision=expected)[1])


@router.patch("/plans/{plan_id}/paths/{path_id}")
def change_path(
    plan_id: Identifier, path_id: Identifier, change: PathUpdate, services: ServicesDep, condition: ConditionDep
) -> PlanPublic:
    """Rename a path, say where it enters, or choose it: one per request. Points are those of the chosen path."""
    if len(change.model_dump(exclude={"revision"}, exclude_none=True)) != 1:
        raise PlanError("give one of name, entry_side and chosen.")
    paths, expected = services.plans.editor(plan_id).paths, condition.expected(change.revision)
    if change.name is not None:
        plan = paths.rename(path_id, change.name, expected_revision=expected)
    elif change.entry_side is not None:
        plan = paths.set_entry_side(path_id, change.entry_side, expected_revision=expected)
    else:
        plan = paths.choose(path_id, expected_revision=expected)
    return _told(condition, plan)


@router.delete("/plans/{plan_id}/paths/{path_id}")
def delete_path(
    plan_id: Identifier, path_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> PlanPublic:
    """Delete a path; a plan keeps one at least."""
    expected = condition.expected(revision)
    return _told(condition, services.plans.editor(plan_id).paths.delete(path_id, expected_revision=expected))


@router.put("/plans/{plan_id}/points/{point_id}/shaft")
def set_shaft(
    plan_id: Identifier, point_id: Identifier, wish: ShaftWish, services: ServicesDep, condition: ConditionDep
) -> PlanPublic:
    """Set the shaft's direction and roll at a point of the chosen path."""
    paths, expected = services.plans.editor(plan_id).paths, condition.expected(wish.revision)
    return _told(condition, paths.set_shaft(point_id, wish.direction, wish.roll_deg, expected_revision=expected))


def _told(condition: Condition, plan: Plan) -> PlanPublic:
    condition.tell(plan.revision)
    return PlanPublic.of(plan)
