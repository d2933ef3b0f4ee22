"""Operations on the paths of a plan, and on what a path says of its shaft."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, ClassVar

from msgspec import Meta

from app.kit.names import check_name
from app.kit.values import check_position, new_id
from app.operations.fields import Identifier, Name, Place
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, found, put
from app.plans.paths import PATH, EntrySide, PlanPath, check_paths, new_path_name
from app.plans.points import MAX_ROLL_DEG, PlanPoint, check_direction, check_point, check_roll, new_point_id
from vfix_engine.errors import PlanError

Component = Annotated[float, Meta(ge=-1e6, le=1e6)]
Direction = tuple[Component, Component, Component]  # LPS, from the tip towards the tail; of any length but 0
Roll = Annotated[float, Meta(ge=-MAX_ROLL_DEG, le=MAX_ROLL_DEG)]  # [deg]


class AddPath(PlanEdit, frozen=True):
    """Add a path and choose it: empty with the chosen path's tool, or a copy of another one (`copy_of`)."""

    rest = "POST /plans/{id}/paths"
    status = 201
    message = "path.new"
    aliases: ClassVar[Mapping[str, str]] = {"name": "", "copy_of": ""}
    name: Name | None = None
    copy_of: Identifier | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        if self.copy_of is None:
            return with_path(content, self.name)
        copied = found(content.paths, self.copy_of, "path")
        points = tuple(replace(point, id=new_point_id()) for point in copied.points)
        return _with_new(content, self.name, PATH, replace(copied, points=points, entry_side=""))


class CopyPath(PlanEdit, frozen=True):
    """Add a copy of a path and choose it."""

    message = "path.duplicate"
    path_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return AddPath(copy_of=self.path_id).apply(content, context)


class AddTracedPath(PlanEdit, frozen=True):
    """Add a path through these places, LPS mm from outside to inside, and choose it; `named`: what is numbered."""

    places: Sequence[Place]
    name: str | None = None
    named: str = PATH

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return with_path(content, self.name, self.places, self.named)


class PathEdit(PlanEdit, frozen=True):
    """An edit of one path."""

    path_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        changed = self.changed(found(content.paths, self.path_id, "path"))
        return content.with_paths(check_paths(put(content.paths, changed)), content.path_id)

    def changed(self, path: PlanPath) -> PlanPath:
        """The path after it. Raises InputError or one of its kinds."""
        raise NotImplementedError


class RenamePath(PathEdit, frozen=True):
    """Give a path another name."""

    rest = "PATCH /plans/{id}/paths/{path_id}"
    message = "path.rename"
    name: Name

    def changed(self, path: PlanPath) -> PlanPath:
        return replace(path, name=check_name(self.name, "path's name"))


class SetEntrySide(PathEdit, frozen=True):
    """Say on which side of the patient a path enters; an empty one says nothing."""

    rest = "PATCH /plans/{id}/paths/{path_id}"
    message = "path.side"
    aliases: ClassVar[Mapping[str, str]] = {"entry_side": "side"}
    entry_side: EntrySide

    def changed(self, path: PlanPath) -> PlanPath:
        return replace(path, entry_side=self.entry_side)


class ChoosePath(PlanEdit, frozen=True):
    """Make a path the one that is edited and driven."""

    rest = "PATCH /plans/{id}/paths/{path_id}"
    message = "path.choose"
    aliases: ClassVar[Mapping[str, str]] = {"chosen": ""}
    path_id: Identifier
    chosen: Annotated[bool, Meta(extra_json_schema={"enum": [True]})] = True

    def __post_init__(self) -> None:
        if not self.chosen:
            raise ValueError("choose another path instead")

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return content.with_paths(content.paths, self.path_id)


class DeletePath(PlanEdit, frozen=True):
    """Delete a path; a plan keeps one at least. The one before it is chosen where it was."""

    rest = "DELETE /plans/{id}/paths/{path_id}"
    message = "path.delete"
    path_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        index = content.paths.index(found(content.paths, self.path_id, "path"))
        rest = (*content.paths[:index], *content.paths[index + 1 :])
        if not rest:
            raise PlanError("a plan has one path at least; delete its points instead.")
        chosen = content.path_id if content.path_id != self.path_id else rest[max(index - 1, 0)].id
        return content.with_paths(rest, chosen)


class SetShaft(PlanEdit, frozen=True):
    """Set the shaft's `direction` (from the tip towards its tail, LPS) and `roll_deg` at a point of the chosen path.

    Null leaves them open.
    """

    rest = "PUT /plans/{id}/points/{point_id}/shaft"
    point_id: Identifier
    direction: Direction | None
    roll_deg: Roll | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        point = found(content.points, self.point_id, "point")
        turned = replace(point, direction=check_direction(self.direction), roll_deg=check_roll(self.roll_deg))
        return content.with_points(put(content.points, check_point(turned)))


class ClearShaft(PlanEdit, frozen=True):
    """Leave the shaft's direction and roll open at a point of the chosen path."""

    message = "shaft.clear"
    title = "Clear shaft direction"
    aliases: ClassVar[Mapping[str, str]] = {"point_id": "item_id"}
    point_id: Identifier

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return SetShaft(point_id=self.point_id, direction=None).apply(content, context)


class RollShaft(PlanEdit, frozen=True):
    """Turn a bent tool about its shaft at a point of the chosen path, in degrees; without any its roll is open."""

    message = "shaft.roll"
    aliases: ClassVar[Mapping[str, str]] = {"point_id": "item_id"}
    point_id: Identifier
    roll_deg: Roll | None = None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        direction = found(content.points, self.point_id, "point").direction
        if direction is None:
            raise PlanError("aim the shaft first; its roll is about that direction.")
        rolled = SetShaft(point_id=self.point_id, direction=direction, roll_deg=self.roll_deg)
        return rolled.apply(content, context)


def with_path(
    content: PlanContent, name: str | None = None, places: Sequence[Place] = (), named: str = PATH
) -> PlanContent:
    """The content with one more path, which is chosen, with the tool of the one that was.

    places: LPS mm, from outside to inside; none are an empty path. named: what is numbered where there is no name.
    """
    points = tuple(
        check_point(PlanPoint(new_point_id(), f"P{number}", check_position(place)))
        for number, place in enumerate(places, 1)
    )
    return _with_new(content, name, named, replace(content.path, points=points))


def _with_new(content: PlanContent, name: str | None, named: str, like: PlanPath) -> PlanContent:
    called = new_path_name(content.paths, named) if name is None else name
    path = replace(like, id=new_id("path"), name=called)
    return content.with_paths(check_paths((*content.paths, path)), path.id)


OPERATIONS = (SetShaft, ClearShaft, RollShaft, AddPath, CopyPath, RenamePath, SetEntrySide, ChoosePath, DeletePath)
