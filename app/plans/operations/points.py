"""Operations on the points of the chosen path, and on targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, ClassVar

from msgspec import Meta

from app.kit.names import MAX_NAME, check_label
from app.kit.values import check_position
from app.operations.fields import STRIPPED, Identifier, Name, Place
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, StoredPlan, found, put, without
from app.plans.paths import EntrySide
from app.plans.points import PlanPoint, check_point, new_point_id
from app.plans.public import EditedPoint
from vfix_engine.errors import PlanError

Label = Annotated[str, Meta(max_length=MAX_NAME, extra={STRIPPED: True})]
Index = Annotated[int, Meta(ge=0, le=2**53)]


class PointEdit(PlanEdit, frozen=True):
    """An edit of one point or target, with which REST answers."""

    answers = EditedPoint

    def edited(self, content: PlanContent) -> str:
        """Id of the point, in the content that it made."""
        raise NotImplementedError

    def answer(self, context: Plans, document: StoredPlan) -> EditedPoint:
        point = found((*document.content.points, *document.content.targets), self.edited(document.content), "point")
        return EditedPoint(**vars(point), revision=document.revision)


class AddPoint(PointEdit, frozen=True):
    """Add a path point at the given position, at the end or before the point at `index`.

    `snap` finds a position that is clear of bone.
    """

    rest = "POST /plans/{id}/points"
    status = 201
    position: Place
    label: Label | None = None
    index: Index | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        points = list(content.points)
        index = len(points) if self.index is None else self.index
        if index > len(points):
            raise PlanError(f"there is no place {index} in a path of {len(points)} points.")
        points.insert(index, _new(self.position, self.label, "P", points))
        return content.with_points(points)

    def added(self, content: PlanContent) -> str:
        return content.points[-1 if self.index is None else self.index].id

    edited = added


class EnterAt(PlanEdit, frozen=True):
    """Begin the chosen path, which has no point, at this position, and say on which side it is; '' leaves the side."""

    position: Place
    side: EntrySide

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        if content.points:
            raise PlanError("the path has an entry; move or delete its first point.")
        entered = AddPoint(position=self.position).apply(content, context)
        path = replace(entered.path, entry_side=self.side or entered.path.entry_side)
        return entered.with_paths(put(entered.paths, path), path.id)

    def added(self, content: PlanContent) -> str:
        return content.points[0].id


class AddTarget(PointEdit, frozen=True):
    """Add a target."""

    rest = "POST /plans/{id}/targets"
    status = 201
    position: Place
    label: Label | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(content, targets=(*content.targets, _new(self.position, self.label, "T", content.targets)))

    def added(self, content: PlanContent) -> str:
        return content.targets[-1].id

    edited = added


class TakeTargets(PlanEdit, frozen=True):
    """Add the targets of another plan of the same head, as one edit; those that are here already are left out."""

    rest = "POST /plans/{id}/targets/take"
    message = "targets.take"
    aliases: ClassVar[Mapping[str, str]] = {"plan": "plan_id"}
    plan: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        if context.documents.title(self.plan).case_id != context.case_id:
            raise PlanError("that plan belongs to another head; its targets may lie in other anatomy.")
        here = {(target.label, target.position) for target in content.targets}
        others = context.documents.get(self.plan).content.targets
        new = [replace(one, id=new_point_id()) for one in others if (one.label, one.position) not in here]
        if not new:
            raise PlanError("that plan has no target that is not here already.")
        return replace(content, targets=(*content.targets, *new))


class PointChange(PointEdit, frozen=True):
    """A change of a path point or a target."""

    rest = "PATCH /plans/{id}/points/{point_id}"
    aliases: ClassVar[Mapping[str, str]] = {"point_id": "item_id"}
    point_id: Identifier

    def edited(self, content: PlanContent) -> str:
        return self.point_id

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        for target in content.targets:
            if target.id == self.point_id:
                return replace(content, targets=put(content.targets, self.changed(target)))
        return content.with_points(put(content.points, self.changed(found(content.points, self.point_id, "point"))))

    def changed(self, point: PlanPoint) -> PlanPoint:
        """The point after it. Raises InputError or one of its kinds."""
        raise NotImplementedError


class MovePoint(PointChange, frozen=True):
    """Move a path point or a target."""

    position: Place

    def changed(self, point: PlanPoint) -> PlanPoint:
        return replace(point, position=check_position(self.position))


class RenamePoint(PointChange, frozen=True):
    """Give a path point or a target another label."""

    label: Label

    def changed(self, point: PlanPoint) -> PlanPoint:
        return replace(point, label=check_label(self.label, "label"))


class RenameItem(RenamePoint, frozen=True):
    """Give a path point or a target another label, which is not empty."""

    rest = ""
    title = "Rename point or target"
    message = "item.rename"
    label: Name


class DeletePoint(PlanEdit, frozen=True):
    """Delete a path point or a target."""

    rest = "DELETE /plans/{id}/points/{point_id}"
    title = "Delete point or target"
    message = "item.delete"
    aliases: ClassVar[Mapping[str, str]] = {"point_id": "item_id"}
    point_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        if any(target.id == self.point_id for target in content.targets):
            return replace(content, targets=without(content.targets, self.point_id, "point"))
        return content.with_points(without(content.points, self.point_id, "point"))


class SetPoints(PlanEdit, frozen=True):
    """Another way for the chosen path: all of its points with the shaft's directions, as one edit."""

    points: tuple[PlanPoint, ...]

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return content.with_points([check_point(point) for point in self.points])


def _new(position: Place, label: str | None, letter: str, others: Sequence[PlanPoint]) -> PlanPoint:
    if label is None:
        taken = {point.label for point in others}
        label = next(text for n in range(1, len(others) + 2) if (text := f"{letter}{n}") not in taken)
    return PlanPoint(new_point_id(), check_label(label, "label"), check_position(position))


OPERATIONS = (AddPoint, AddTarget, TakeTargets, MovePoint, RenamePoint, RenameItem, DeletePoint)
