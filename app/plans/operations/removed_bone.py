"""Operations on a plan's regions of bone removal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.kit.values import new_id
from app.operations.fields import Identifier, Name
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, StoredPlan, found, put, without
from app.plans.operations.zones import Shape, keeping_placement, next_name
from app.plans.zones import RemovedBone, check_removed
from vfix_engine.errors import PlanError

_WHAT = "region"


@dataclass(frozen=True, kw_only=True)
class EditedBone(RemovedBone):
    """A region of bone removal after an edit, and the plan's revision after it."""

    revision: int


class _AnsweredBone(PlanEdit, frozen=True):
    """An edit that REST answers with the region."""

    answers = EditedBone

    def edited(self, content: PlanContent) -> str:
        """Id of the region, in the content that it made."""
        raise NotImplementedError

    def answer(self, context: Plans, document: StoredPlan) -> EditedBone:
        region = found(document.content.removed_bone, self.edited(document.content), _WHAT)
        return EditedBone(**vars(region), revision=document.revision)


class AddBone(_AnsweredBone, frozen=True):
    """Add a region of bone removal: a sphere, a capsule or a box."""

    rest = "POST /plans/{id}/removed-bone"
    status = 201
    shape: Shape
    name: Name | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        name = next_name("Opening", content.removed_bone) if self.name is None else self.name
        return _with_removed(content, (*content.removed_bone, RemovedBone(new_id("bone"), name, self.shape)))

    def added(self, content: PlanContent) -> str:
        return content.removed_bone[-1].id

    edited = added


class ChangeBone(_AnsweredBone, frozen=True):
    """Change the name or the shape of a region of bone removal, or both in one edit."""

    rest = "PATCH /plans/{id}/removed-bone/{region_id}"
    region_id: Identifier
    name: Name | None = None
    shape: Shape | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        said = {"name": self.name, "shape": self.shape}
        changes: dict[str, Any] = {name: value for name, value in said.items() if value is not None}
        if not changes:
            raise PlanError("give the name or the shape that is to change.")
        changed = replace(found(content.removed_bone, self.region_id, _WHAT), **changes)
        return _with_removed(content, put(content.removed_bone, changed))

    def edited(self, content: PlanContent) -> str:
        return self.region_id


class DeleteBone(PlanEdit, frozen=True):
    """Delete a region of bone removal; the bone stays."""

    rest = "DELETE /plans/{id}/removed-bone/{region_id}"
    region_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return _with_removed(content, without(content.removed_bone, self.region_id, _WHAT))


def _with_removed(content: PlanContent, regions: Sequence[RemovedBone]) -> PlanContent:
    return keeping_placement(content, replace(content, removed_bone=check_removed(regions)))


OPERATIONS = (AddBone, ChangeBone, DeleteBone)
