"""Operations on a plan's protected structures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

from msgspec import UNSET, Meta, UnsetType

from app.kit.values import new_id
from app.operations.fields import Identifier, Name
from app.plans.model import PlanContent, drive_parts
from app.plans.operations.base import PlanEdit, Plans, StoredPlan, found, put, without
from app.plans.zones import COLOURS, LARGEST_DEPTH_MM, Firmness, PlanZone, RemovedBone, check_zones
from vfix_engine.errors import PlanError
from vfix_engine.virtual_fixtures.soft_zone import STIFFEST_N_PER_MM
from vfix_engine.virtual_fixtures.zones import LARGEST_MARGIN_MM

Margin = Annotated[float, Meta(ge=0.0, le=LARGEST_MARGIN_MM)]
Stiffness = Annotated[float, Meta(gt=0.0, le=STIFFEST_N_PER_MM)]
Depth = Annotated[float, Meta(ge=0.0, le=LARGEST_DEPTH_MM)]
Number = Annotated[float, Meta(ge=-1e6, le=1e6)]
# A text, a number, a place, or a list of places; what each field of a shape may be, `check_shape` says.
_Numbers = Annotated[list[Number], Meta(max_length=64)]
_Places = Annotated[list[Number | _Numbers], Meta(max_length=64)]
_ShapeField = Annotated[str, Meta(max_length=64)] | Number | _Places | None
Shape = Annotated[
    dict[Annotated[str, Meta(max_length=32)], _ShapeField],
    Meta(max_length=8, description="as in a file of zones, LPS mm; or of the kind 'capsules' or 'structure'"),
]

_WHAT = "protected structure"
_KEPT_BY = {"shape", "kind", "margin_mm", "max_depth_mm"}  # what decides whether a drive can keep it
_MAY_BE_NULL = ("max_depth_mm", "stiffness_n_per_mm")


@dataclass(frozen=True, kw_only=True)
class EditedZone(PlanZone):
    """A protected structure after an edit, and the plan's revision after it."""

    revision: int


class _ZoneEdit(PlanEdit, frozen=True, kw_only=True):
    """Fields of a protected structure; what is left out stays, or is as a new one has it."""

    name: Name | UnsetType | None = UNSET
    shape: Shape | UnsetType | None = UNSET
    margin_mm: Margin | UnsetType | None = UNSET
    kind: Firmness | UnsetType | None = UNSET
    stiffness_n_per_mm: Stiffness | UnsetType | None = UNSET
    max_depth_mm: Depth | UnsetType | None = UNSET
    colour: Annotated[str, Meta(max_length=7)] | UnsetType | None = UNSET
    visible: bool | UnsetType | None = UNSET

    def said(self) -> dict[str, Any]:
        """The fields of `PlanZone` that are said. Raises PlanError for a null where a value is needed."""
        values = {name: getattr(self, name) for name in _ZoneEdit.__struct_fields__}
        values = {name: value for name, value in values.items() if value is not UNSET}
        if empty := [name for name, value in values.items() if value is None and name not in _MAY_BE_NULL]:
            raise PlanError(f"a protected structure needs its {empty[0]}; leave it out to keep it.")
        return values


class _AnsweredZone(_ZoneEdit, frozen=True):
    """An edit that REST answers with the structure."""

    answers = EditedZone

    def edited(self, content: PlanContent) -> str:
        """Id of the structure, in the content that it made."""
        raise NotImplementedError

    def answer(self, context: Plans, document: StoredPlan) -> EditedZone:
        zone = found(document.content.zones, self.edited(document.content), _WHAT)
        return EditedZone(**vars(zone), revision=document.revision)


class AddZone(_AnsweredZone, frozen=True, kw_only=True):
    """Add a protected structure; by default hard, with a margin of 1 mm and a colour of its own.

    One that no drive could keep is refused, as is a structure that the case does not have.
    """

    rest = "POST /plans/{id}/zones"
    status = 201
    shape: Shape

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        plan = context.documents.get(document_id)
        context.service.planning.check_zone(plan, self._zone(plan.content.zones))
        return super().run(context, document_id)

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return _with_zones(content, (*content.zones, self._zone(content.zones)))

    def added(self, content: PlanContent) -> str:
        return content.zones[-1].id

    edited = added

    def _zone(self, others: Sequence[PlanZone]) -> PlanZone:
        own = {"name": next_name("Structure", others), "colour": COLOURS[len(others) % len(COLOURS)]}
        return PlanZone(new_id("zone"), **(own | self.said()))


class ChangeZone(_AnsweredZone, frozen=True, kw_only=True):
    """Change any fields of a protected structure in one edit; those that are left out stay.

    A null `max_depth_mm` leaves the depth open. One that is made hard loses its stiffness and its depth.
    """

    rest = "PATCH /plans/{id}/zones/{zone_id}"
    zone_id: Identifier

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        changes, plan = self._changes(), context.documents.get(document_id)
        if _KEPT_BY & changes.keys():
            changed = replace(found(plan.content.zones, self.zone_id, _WHAT), **changes)
            context.service.planning.check_zone(plan, changed)
        return super().run(context, document_id)

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        changed = replace(found(content.zones, self.zone_id, _WHAT), **self._changes())
        return _with_zones(content, put(content.zones, changed))

    def edited(self, content: PlanContent) -> str:
        return self.zone_id

    def _changes(self) -> dict[str, Any]:
        changes = self.said()
        if not changes:
            raise PlanError("give what is to change of the protected structure.")
        return changes | ({"stiffness_n_per_mm": None, "max_depth_mm": None} if changes.get("kind") == "hard" else {})


class DeleteZone(PlanEdit, frozen=True):
    """Delete a protected structure."""

    rest = "DELETE /plans/{id}/zones/{zone_id}"
    zone_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return _with_zones(content, without(content.zones, self.zone_id, _WHAT))


def next_name(word: str, items: Sequence[PlanZone] | Sequence[RemovedBone]) -> str:
    """The first numbered name that none of them has."""
    taken = {item.name for item in items}
    return next(name for n in range(1, len(items) + 2) if (name := f"{word} {n}") not in taken)


def keeping_placement(content: PlanContent, changed: PlanContent) -> PlanContent:
    """What the content became; a placement of the robot is dropped where it was made among other obstacles."""
    if drive_parts(changed) == drive_parts(content):
        return changed
    return changed.without_placement()


def _with_zones(content: PlanContent, zones: Sequence[PlanZone]) -> PlanContent:
    return keeping_placement(content, replace(content, zones=check_zones(zones)))


OPERATIONS = (AddZone, ChangeZone, DeleteZone)
