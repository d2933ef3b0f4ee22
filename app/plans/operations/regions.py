"""Messages of the page about regions: a protected structure or a region of bone removal, whichever has the id."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta

from app.cases.service import CaseService
from app.kit.values import Position as Place
from app.operations.fields import Identifier, Name, Position
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, StoredPlan, found
from app.plans.operations.removed_bone import ChangeBone, DeleteBone
from app.plans.operations.zones import AddZone, ChangeZone, DeleteZone
from app.plans.shapes import ShapeDict, moved, resized, turned
from app.plans.zones import MAX_ZONE_NAME, PlanZone, RemovedBone
from vfix_engine.errors import InputError, PlanError

Number = Annotated[float, Meta(ge=-1e3, le=1e3)]  # [mm, N/mm]; what may be, the plan says


class SpareStructure(PlanEdit, frozen=True):
    """Protect a structure of the case, under its own name."""

    title = "Protect structure"
    message = "region.structure"
    structure: Identifier

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        case_id = context.documents.title(document_id).case_id
        name = context.service.cases.get(case_id).structure(self.structure).name
        shape: dict[str, Any] = {"kind": "structure", "structure": self.structure}
        return AddZone(shape=shape, name=name[:MAX_ZONE_NAME]).run(context, document_id)

    def added(self, content: PlanContent) -> str:
        return content.zones[-1].id


class DeleteRegion(PlanEdit, frozen=True):
    """Delete a region."""

    message = "region.delete"
    region_id: Identifier

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        region = found_region(context.documents.get(document_id).content, self.region_id)
        edit = DeleteZone(zone_id=region.id) if isinstance(region, PlanZone) else DeleteBone(region_id=region.id)
        return edit.run(context, document_id)


class ChangeRegion(PlanEdit, frozen=True):
    """Change some of a region; what is left out stays.

    `no_depth` leaves the greatest depth open. `turn` keeps the other side of a half-space free.
    """

    message = "region.change"
    region_id: Identifier
    name: Name | None = None
    colour: Annotated[str, Meta(max_length=7)] | None = None
    visible: bool | None = None
    soft: bool | None = None
    margin_mm: Number | None = None
    stiffness_n_per_mm: Number | None = None
    max_depth_mm: Number | None = None
    no_depth: bool = False
    sizes_mm: Annotated[list[Number], Meta(max_length=3)] | None = None
    place: Position | None = None
    turn: bool = False

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        document = context.documents.get(document_id)
        region = found_region(document.content, self.region_id)
        fields = self._fields(region, context.service.cases, document.case_id)
        if not fields:
            raise InputError("say what is to change of the region.")
        if isinstance(region, PlanZone):
            return ChangeZone(zone_id=region.id, **fields).run(context, document_id)
        if unknown := sorted(fields.keys() - {"name", "shape"}):
            raise PlanError(f"a region of bone to remove has no {unknown[0]!r}.")
        return ChangeBone(region_id=region.id, **fields).run(context, document_id)

    def _fields(self, region: PlanZone | RemovedBone, cases: CaseService, case_id: str) -> dict[str, Any]:
        """The fields of the region that change."""
        same = ("name", "colour", "visible", "margin_mm", "stiffness_n_per_mm", "max_depth_mm")
        fields = {name: value for name in same if (value := getattr(self, name)) is not None}
        if self.soft is not None:
            fields["kind"] = "soft" if self.soft else "hard"
        if self.no_depth:
            fields["max_depth_mm"] = None
        shape = region.shape
        if self.sizes_mm is not None:
            shape = resized(shape, self.sizes_mm)
        if self.place is not None:
            shape = placed(cases, case_id, shape, self.place)
        if self.turn:
            shape = turned(shape)
        return fields if shape is region.shape else fields | {"shape": shape}


def found_region(content: PlanContent, region_id: str) -> PlanZone | RemovedBone:
    """The region of that id. Raises NotFound."""
    regions: tuple[PlanZone | RemovedBone, ...] = (*content.zones, *content.removed_bone)
    return found(regions, region_id, "region")


def placed(cases: CaseService, case_id: str, shape: ShapeDict, at: Place) -> dict[str, Any]:
    """The shape moved there; a patch goes to the nearest place of the surface that it is a part of."""
    if shape["kind"] == "patch":
        x, y, z = cases.tree(cases.get(case_id)).point_distance([at])[1][0].tolist()
        at = (x, y, z)
    return moved(shape, at)


OPERATIONS = (SpareStructure, ChangeRegion, DeleteRegion)
