"""Named versions of plans: list and compare."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.plans.operations.versions import VersionPublic

router = APIRouter(tags=["plan versions"], responses=ERRORS)


class DifferencesPublic(BaseModel):
    """What changed, in sentences; empty where nothing did."""

    changes: Annotated[list[str], Field(description="in the order of the panel")]


@router.get("/plans/{plan_id}/versions")
def list_versions(plan_id: Identifier, services: ServicesDep) -> list[VersionPublic]:
    """Versions of a plan, oldest first."""
    return [VersionPublic.of(one) for one in services.versions.list(plan_id)]


@router.get("/plans/{plan_id}/versions/{version_id}/changes")
def version_changes(
    plan_id: Identifier,
    version_id: Identifier,
    services: ServicesDep,
    until: Annotated[str | None, Query(max_length=120, description="another version; else the plan as it is")] = None,
) -> DifferencesPublic:
    """What changed since a version."""
    return DifferencesPublic(changes=list(services.versions.differences(plan_id, version_id, until)))
