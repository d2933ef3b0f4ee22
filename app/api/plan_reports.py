"""Reports on the paths of a plan."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel

from app.api.dependencies import Identifier, ServicesDep
from app.planning.piercing import PiercedState
from app.planning.verdict import Level, Reason, TissueLevel

router = APIRouter()


class TargetReportPublic(BaseModel):
    """A target, and the full opening angle of the cone of directions from which it can be inspected."""

    target: str
    label: str
    cone_deg: float


class SoftDepthPublic(BaseModel):
    """A soft protected structure, how deep below the border of its layer the tool goes, and where its tip is then."""

    name: str
    depth_mm: float
    s_mm: float


class PiercedPublic(BaseModel):
    """Whether the tool goes through skin ('room') or a wall between two air spaces of the body ('wall'); lengths in mm.

    sideways_mm: how far sideways the nearest air leads round the worst tissue that the tool's axis passes, null where
    that is not known or beyond 15 mm; gives_mm: what tissue gives there. begin, end: of that tissue, in LPS.
    """

    state: PiercedState
    sideways_mm: float | None
    gives_mm: float | None
    begin: tuple[float, float, float] | None
    end: tuple[float, float, float] | None
    s_mm: float | None
    words: str


class PathReportPublic(BaseModel):
    """The verdict on one path; lengths in mm, null where they are not known, as tissue is without a CT.

    word: of the level; short: with what decided it; words: the whole; each begins with the one before. nearest: bone
    or the protected structure that leaves least above its margin, margin_mm; least_clearance_mm: to it.
    """

    path: str
    name: str
    verdict: Level
    reason: Reason
    word: str
    short: str
    words: str
    least_clearance_mm: float | None
    margin_mm: float | None
    nearest: str | None
    part: str | None
    s_mm: float | None
    tissue_level: TissueLevel
    tissue_mm: float | None
    nostril_mm: float | None
    tissue_depth_mm: float | None
    tissue_s_mm: float | None
    soft_structures: list[SoftDepthPublic]
    pierced: PiercedPublic
    side_caution: str
    completed: bool
    reached_mm: float
    length_mm: float | None
    targets: list[TargetReportPublic]


class RegionVolumePublic(BaseModel):
    """The bone in a region that is to be removed, in mm³ and in words."""

    id: str
    name: str
    removed_mm3: float
    words: str


class RemovedVolumesPublic(BaseModel):
    """The bone in each region to be removed, and in all together, where what regions share is counted once."""

    regions: list[RegionVolumePublic]
    removed_mm3: float
    words: str


class PlanReportPublic(BaseModel):
    """The report on the chosen path, or the one asked for, and on all paths, and the bone that is removed first."""

    plan: str
    name: str
    case: str
    chosen: PathReportPublic
    paths: list[PathReportPublic]
    removed: RemovedVolumesPublic
    notice: str


@router.get("/plans/{plan_id}/removed-bone/volumes")
def removed_volumes(plan_id: Identifier, services: ServicesDep) -> RemovedVolumesPublic:
    """Volume of the bone that a plan removes, region by region."""
    return RemovedVolumesPublic.model_validate(
        services.removed_volumes.of_plan(services.plans.get(plan_id)), from_attributes=True
    )


@router.get("/plans/{plan_id}/report")
def report(
    plan_id: Identifier, services: ServicesDep, path: Annotated[str | None, Query(max_length=200)] = None
) -> PlanReportPublic:
    """Verdict on a plan's paths, or on the named one; takes seconds the first time."""
    made = services.path_evaluations.of_plan(services.plans.get(plan_id), path)
    return PlanReportPublic.model_validate(made, from_attributes=True)
