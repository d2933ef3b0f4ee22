"""Named versions of plans: save, list, compare, go back."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep, Wish
from app.api.plan_models import Name, Revision
from app.plans.public import PlanPublic
from app.plans.versions import PlanVersion

router = APIRouter(tags=["plan versions"], responses=ERRORS)


class VersionPublic(BaseModel):
    """A named version of a plan; revision: the plan's when it was saved."""

    id: str
    name: str
    plan_id: str
    revision: int
    created: str

    @classmethod
    def of(cls, version: PlanVersion) -> "VersionPublic":
        return cls.model_validate(version, from_attributes=True)


class VersionCreate(Wish):
    """Keep the plan as it is now under a name."""

    name: Name
    revision: Revision = None


class VersionUpdate(Wish):
    """Give a version another name."""

    name: Name


class GoBack(Wish):
    """Make the plan what it was in a version."""

    revision: Revision = None


class DifferencesPublic(BaseModel):
    """What changed, in sentences; empty where nothing did."""

    changes: Annotated[list[str], Field(description="in the order of the panel")]


@router.get("/plans/{plan_id}/versions")
def list_versions(plan_id: Identifier, services: ServicesDep) -> list[VersionPublic]:
    """Versions of a plan, oldest first."""
    return [VersionPublic.of(one) for one in services.versions.list(plan_id)]


@router.post("/plans/{plan_id}/versions", status_code=201)
def save_version(
    plan_id: Identifier, wish: VersionCreate, services: ServicesDep, condition: ConditionDep
) -> VersionPublic:
    """Save a version; If-Match refers to the plan."""
    expected = condition.expected(wish.revision)
    return VersionPublic.of(services.versions.save(plan_id, wish.name, expected_revision=expected))


@router.patch("/plans/{plan_id}/versions/{version_id}")
def rename_version(
    plan_id: Identifier, version_id: Identifier, change: VersionUpdate, services: ServicesDep
) -> VersionPublic:
    """Rename a version."""
    return VersionPublic.of(services.versions.rename(plan_id, version_id, change.name))


@router.delete("/plans/{plan_id}/versions/{version_id}")
def delete_version(plan_id: Identifier, version_id: Identifier, services: ServicesDep) -> VersionPublic:
    """Take a version off the list; it can be restored."""
    return VersionPublic.of(services.versions.delete(plan_id, version_id))


@router.post("/plans/{plan_id}/versions/{version_id}/restore")
def restore_version(plan_id: Identifier, version_id: Identifier, services: ServicesDep) -> VersionPublic:
    """Bring a deleted version back to the list."""
    return VersionPublic.of(services.versions.restore(plan_id, version_id))


@router.get("/plans/{plan_id}/versions/{version_id}/changes")
def version_changes(
    plan_id: Identifier,
    version_id: Identifier,
    services: ServicesDep,
    until: Annotated[str | None, Query(max_length=120, description="another version; else the plan as it is")] = None,
) -> DifferencesPublic:
    """What changed since a version."""
    return DifferencesPublic(changes=list(services.versions.differences(plan_id, version_id, until)))


@router.post("/plans/{plan_id}/versions/{version_id}/go-back")
def go_back(
    plan_id: Identifier,
    version_id: Identifier,
    services: ServicesDep,
    condition: ConditionDep,
    wish: GoBack | None = None,
) -> PlanPublic:
    """Make the plan what it was, as one edit that undo takes back; settings stay."""
    expected = condition.expected(wish.revision if wish else None)
    plan = services.versions.go_back(plan_id, version_id, expected_revision=expected)
    condition.tell(plan.revision)
    return PlanPublic.of(plan)
