"""Parts of plans: paths, structures to spare, bone to be removed, the shaft's direction at a point, notes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import Field

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, Number, ServicesDep, Wish
from app.api.plan_models import Name, RemovedBonePublic, Revision, ZonePublic
from app.kit.errors import NotFound
from app.plans.edits import changed_zone
from app.plans.model import Plan
from app.plans.paths import PlanPath
from app.plans.public import PlanPublic
from app.plans.zones import Firmness, PlanZone
from vfix_engine.errors import PlanError

router = APIRouter(tags=["plan parts"], responses=ERRORS)

Seen = Annotated[int | None, Query(ge=0)]
ShapeWish = Annotated[
    dict[Annotated[str, Field(max_length=32)], Any],
    Field(max_length=8, description="as in a file of zones, LPS mm; or of the kind 'capsules' or 'structure'"),
]


class EditedZone(ZonePublic):
    """A structure to spare after an edit, and the plan's revision after it."""

    revision: int


class EditedBone(RemovedBonePublic):
    """A region of bone to be removed after an edit, and the plan's revision after it."""

    revision: int


class ZoneUpdate(Wish):
    """Changes of a structure to spare; omitted fields stay. A null max_depth_mm leaves the depth open."""

    name: Name | None = None
    shape: ShapeWish | None = None
    margin_mm: Number | None = None
    kind: Firmness | None = None
    stiffness_n_per_mm: Number | None = None
    max_depth_mm: Number | None = None
    colour: Annotated[str, Field(max_length=7)] | None = None
    visible: Annotated[bool, Field(strict=True)] | None = None
    revision: Revision = None

    def fields(self) -> dict[str, Any]:
        """What is wanted. Raises PlanError for a null where a value is needed."""
        given = {name: getattr(self, name) for name in self.model_fields_set - {"revision"}}
        if empty := [name for name, value in given.items() if value is None and name not in _MAY_BE_NULL]:
            raise PlanError(f"a structure to spare needs its {empty[0]}; leave it out to keep it.")
        return given


class ZoneCreate(ZoneUpdate):
    """A structure to spare; by default hard, with a margin of 1 mm and a colour of its own."""

    shape: ShapeWish


_KEPT_BY = {"shape", "kind", "margin_mm", "max_depth_mm"}  # what decides whether a drive can keep it
_MAY_BE_NULL = ("max_depth_mm", "stiffness_n_per_mm")


class BoneCreate(Wish):
    """A region in which bone will be removed: a sphere, a capsule or a box."""

    shape: ShapeWish
    name: Name | None = None
    revision: Revision = None


class BoneUpdate(Wish):
    """Changes of a region of bone to be removed; omitted fields stay."""

    shape: ShapeWish | None = None
    name: Name | None = None
    revision: Revision = None


@router.get("/plans/{plan_id}/zones")
def list_zones(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[ZonePublic]:
    """Structures to spare of a plan."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return [ZonePublic(**vars(one)) for one in plan.zones]


@router.post("/plans/{plan_id}/zones", status_code=201)
def add_zone(plan_id: Identifier, wish: ZoneCreate, services: ServicesDep, condition: ConditionDep) -> EditedZone:
    """Add a structure to spare, LPS mm."""
    expected = condition.expected(wish.revision)
    fields = wish.fields()
    shape, name = fields.pop("shape"), fields.pop("name", None)
    editor = services.plans.editor(plan_id)
    _check_structure(services, plan_id, shape)
    wished = PlanZone("zone", "Structure" if name is None else name, shape)
    services.planning.check_zone(editor.plan, replace(wished, **fields))
    zone_id, plan = editor.zones.add(shape, name, expected_revision=expected, **fields)
    return _zone(condition, plan, zone_id)


def _check_structure(services: ServicesDep, plan_id: str, shape: Mapping[str, Any]) -> None:
    """Raises PlanError for a structure that the plan's case does not have, which no drive could keep."""
    if isinstance(structure := shape.get("structure"), str):
        try:
            services.cases.get(services.plans.get(plan_id).case_id).structure(structure)
        except NotFound as error:
            raise PlanError(str(error)) from error


@router.patch("/plans/{plan_id}/zones/{zone_id}")
def change_zone(
    plan_id: Identifier, zone_id: Identifier, change: ZoneUpdate, services: ServicesDep, condition: ConditionDep
) -> EditedZone:
    """Change any fields of a structure to spare in one edit."""
    expected, fields = condition.expected(change.revision), change.fields()
    if not fields:
        raise PlanError("give what is to change of the structure to spare.")
    _check_structure(services, plan_id, fields.get("shape", {}))
    before = services.plans.get(plan_id)
    if found := [zone for zone in before.zones if zone.id == zone_id and _KEPT_BY & set(fields)]:
        services.planning.check_zone(before, changed_zone(found[0], fields))
    plan = services.plans.editor(plan_id).zones.change(zone_id, expected_revision=expected, **fields)
    return _zone(condition, plan, zone_id)


@router.delete("/plans/{plan_id}/zones/{zone_id}")
def delete_zone(
    plan_id: Identifier, zone_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> PlanPublic:
    """Delete a structure to spare."""
    expected = condition.expected(revision)
    return _told(condition, services.plans.editor(plan_id).zones.delete(zone_id, expected_revision=expected))


@router.get("/plans/{plan_id}/removed-bone")
def list_removed_bone(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[RemovedBonePublic]:
    """Regions of a plan in which bone will be removed."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return [RemovedBonePublic(**vars(one)) for one in plan.removed_bone]


@router.post("/plans/{plan_id}/removed-bone", status_code=201)
def add_removed_bone(
    plan_id: Identifier, wish: BoneCreate, services: ServicesDep, condition: ConditionDep
) -> EditedBone:
    """Add a region in which bone will be removed, LPS mm."""
    expected = condition.expected(wish.revision)
    region, plan = services.plans.editor(plan_id).removed_bone.add(wish.shape, wish.name, expected_revision=expected)
    return _bone(condition, plan, region)


@router.patch("/plans/{plan_id}/removed-bone/{region_id}")
def change_removed_bone(
    plan_id: Identifier, region_id: Identifier, change: BoneUpdate, services: ServicesDep, condition: ConditionDep
) -> EditedBone:
    """Change the name or the shape of such a region, or both in one edit."""
    expected = condition.expected(change.revision)
    fields = {name: value for name in ("name", "shape") if (value := getattr(change, name)) is not None}
    if not fields:
        raise PlanError("give the name or the shape that is to change.")
    plan = services.plans.editor(plan_id).removed_bone.change(region_id, expected_revision=expected, **fields)
    return _bone(condition, plan, region_id)


@router.delete("/plans/{plan_id}/removed-bone/{region_id}")
def delete_removed_bone(
    plan_id: Identifier, region_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> PlanPublic:
    """Delete such a region."""
    expected = condition.expected(revision)
    return _told(condition, services.plans.editor(plan_id).removed_bone.delete(region_id, expected_revision=expected))


@router.get("/plans/{plan_id}/paths")
def list_paths(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> list[PlanPath]:
    """Paths of a plan; the plan's `path_id` says which is chosen."""
    plan = services.plans.get(plan_id)
    condition.tell(plan.revision)
    return list(plan.paths)


def _told(condition: Condition, plan: Plan) -> PlanPublic:
    condition.tell(plan.revision)
    return PlanPublic.of(plan)


def _zone(condition: Condition, plan: Plan, zone_id: str) -> EditedZone:
    condition.tell(plan.revision)
    zone = next(zone for zone in plan.zones if zone.id == zone_id)
    return EditedZone(**vars(zone), revision=plan.revision)


def _bone(condition: Condition, plan: Plan, region_id: str) -> EditedBone:
    condition.tell(plan.revision)
    region = next(region for region in plan.removed_bone if region.id == region_id)
    return EditedBone(**vars(region), revision=plan.revision)
