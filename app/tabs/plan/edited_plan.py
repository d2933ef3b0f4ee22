"""One plan as a client edits it: selection, ghost, drags and what a click adds; every edit goes through the editor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from app.documents.editor import check_still_newest
from app.imaging.openings import Opening
from app.kit.kept import Kept, Same
from app.kit.values import Position
from app.messages.sections import Section
from app.operations.operation import Change
from app.operations.standard import Redo, SetLocked, Undo
from app.planning.previews import Dragged
from app.planning.tissue_words import PLACE_WORDS
from app.plans.model import FRAME, UNIT, PlanPoint
from app.plans.operations.base import PlanEdit
from app.plans.operations.document import SetNotes
from app.plans.operations.paths import AddPath, ChoosePath, CopyPath, DeletePath, PathEdit, SetShaft
from app.plans.operations.points import AddPoint, AddTarget, DeletePoint, EnterAt, MovePoint, SetPoints
from app.plans.operations.regions import DeleteRegion
from app.plans.paths import EntrySide, path_end
from app.plans.service import Plan
from app.scene.plan import PlanItem
from app.services import Services
from app.tabs.plan.instruments import robot_view, tool_view
from app.tabs.plan.regions import Regions
from app.tabs.plan.second_volume import SecondVolumes
from app.tabs.plan.sections import AddKind, PlanSection
from app.tabs.plan.versions import Versions
from app.workspace.plan_items import entries, plan_items, position_of
from app.workspace.sections import ItemKind
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.geometry.path import SplinePath

MOVED_WORTH_SAYING_MM = 0.05  # by a click, which goes to the nearest free place
SAME_PLACE_MM = 0.1  # a click nearer than this to a point or target of its kind selects it
DROP_MOVED_MM = 0.2  # by a drop, whose hand is less exact
# Operations that take back what is half drawn, dragged or shown as a ghost.
ENDING = (SetLocked, Undo, Redo, SetNotes, AddPath, CopyPath, PathEdit, ChoosePath, DeletePath)


@dataclass(frozen=True)
class Ghost:
    """Where a click would add: the snapped place, how far it moved, and what it lies in where that is no air inside."""

    kind: ItemKind
    position: Position
    moved_mm: float
    words: str
    lies_in: str = ""


class EditedPlan:
    """What one client does with one plan. Owned by the session's thread."""

    def __init__(
        self, services: Services, plan_id: str, side_at: Callable[[EditedPlan, Position], EntrySide] = lambda *_: ""
    ) -> None:
        """side_at: returns the side of the opening of the head that an entry is at, '' for another place."""
        self._services, self._side_at = services, side_at
        self._dragged: dict[str, Position] = {}
        self.shaft_in_hand: tuple[str, Position] | None = None  # id of the point, and the direction under the hand
        self._said: Any = None  # of robot and tool, when they were read
        self._changes = services.store.changes
        self._seen = self._changes.of_document(plan_id)  # before the plan is read
        self._show(services.plans.get(plan_id))
        self.case = services.cases.get(self.plan.case_id)
        self.selected: str | None = None
        self.add_mode: AddKind = "point"
        self.insert_after: str | None = None
        self.ghost: Ghost | None = None
        self.regions = Regions(services, lambda: self.plan, self.perform)
        self.second_volume = SecondVolumes(services, lambda: self.plan)
        self.versions = Versions(services, lambda: self.plan)
        self._path: Kept[SplinePath | None] = Kept()

    # -- what there is

    def refresh(self) -> None:
        """Read the plan anew where it was changed since, but by an edit from here: other clients edit too."""
        seen = self._changes.of_document(self.plan_id)
        if seen != self._seen:
            self._show(self._services.plans.get(self.plan_id))
            self._seen = seen

    def _show(self, plan: Plan) -> None:
        self.plan = plan
        if (said := (self.plan.content.robot, self.plan.content.tool, self.plan.content.tool_shape)) != self._said:
            self._said = said
            self._robot, self.tool = (
                robot_view(self.plan.content, self._services.instruments),
                tool_view(self.plan.content),
            )
        known = {entry.id for entry in (*self.plan.content.points, *self.plan.content.targets)}
        if self.shaft_in_hand is not None and self.shaft_in_hand[0] not in known:
            self.shaft_in_hand = None
        self._dragged = {item_id: place for item_id, place in self._dragged.items() if item_id in known}

    def perform(self, operation: Change, revision: int | None = None) -> str:
        """Do an operation on the revision that is shown, and select what it adds.

        Returns what an undo or redo did in words, or that there was nothing to do: a key pressed once too often is no
        error. When the plan has moved on, it is shown as it is stored, and the operation refused, as it is where a
        client says another `revision` than the one that is shown. Raises VfixError.
        """
        check_still_newest(revision, self.plan.revision)
        if isinstance(operation, ENDING):
            self.cancel()
        elif isinstance(operation, DeletePoint):
            self.let_go()
        if not self.locked and (nothing := _nothing(operation, self.plan)):
            return nothing
        try:
            plan = self._services.plans.do(self.plan_id, operation, expected_revision=self.plan.revision)
        except VfixError:
            self._show(self._services.plans.get(self.plan_id))
            raise
        self._show(plan)
        self._seen = self._seen[0], plan.revision
        if isinstance(operation, PlanEdit) and (added := operation.added(plan.content)):
            if not self.regions.select_added(added):
                self.selected = added
        elif isinstance(operation, DeletePoint) and self.selected == operation.point_id:
            self.selected = None
        elif isinstance(operation, DeleteRegion) and self.regions.selected == operation.region_id:
            self.regions.selected = None
        return plan.told

    @property
    def plan_id(self) -> str:
        return self.plan.id

    @property
    def locked(self) -> bool:
        return self.plan.locked

    def items(self) -> list[PlanItem]:
        """Points and targets, with a place under a dragging hand where there is one."""
        return [replace(item, position=self._dragged.get(item.id, item.position)) for item in plan_items(self.plan)]

    def points(self) -> list[Position]:
        return [item.position for item in self.items() if item.kind == "point"]

    @property
    def dragging(self) -> bool:
        """A hand is moving an item; the plan in the store is still the one before."""
        return bool(self._dragged)

    @property
    def in_hand(self) -> Dragged | None:
        """The path point that a hand is moving, or whose shaft it turns; None where it moves something else."""
        if self.shaft_in_hand is not None:
            return Dragged(self.shaft_in_hand[0], direction=self.shaft_in_hand[1])
        moved = [(point.id, self._dragged[point.id]) for point in self.plan.content.points if point.id in self._dragged]
        return Dragged(*moved[-1]) if moved else None

    def path(self) -> SplinePath | None:
        """The spline through the points, None while there is none."""
        points = tuple(self.points())
        return self._path.get(points, lambda: _spline(points))

    def section(self) -> Section[PlanSection]:
        """The page's section."""
        dragged = tuple(self._dragged.items())
        return Section((Same(self.plan), self.selected, self.add_mode, self.ghost, dragged), self._view)

    def _view(self) -> PlanSection:
        plan, items, path = self.plan, self.items(), self.path()
        points, targets = ([item for item in items if item.kind == kind] for kind in ("point", "target"))
        end = path_end(points, targets)
        return {
            "id": plan.id,
            "revision": plan.revision,
            "name": plan.name,
            "frame": FRAME,
            "unit": UNIT,
            **entries(items),
            "selected": self.selected,
            "locked": plan.locked,
            "can_undo": plan.can_undo,
            "can_redo": plan.can_redo,
            "add_mode": self.add_mode,
            "degree": 0 if path is None else int(path.degree),
            "length_mm": 0.0 if path is None else float(path.length),
            "nearest_target": None if end is None else end.target.id,
            "short_mm": 0.0 if end is None else round(end.short_mm, 3),
            "ghost": None
            if self.ghost is None
            else {
                "kind": self.ghost.kind,
                "position": list(self.ghost.position),
                "words": f"{self.ghost.words} {self.ghost.lies_in}".strip(),
            },
            "robot": self._robot,
            "tool": self.tool,
            "margin_mm": ControlSettings.from_dict(dict(plan.content.settings)).margin_mm,
        }

    def kind_of(self, item_id: str) -> ItemKind:
        """Raises PlanError when there is no such point or target."""
        for item in self.items():
            if item.id == item_id:
                return "point" if item.kind == "point" else "target"
        raise PlanError("that point is not in the plan any more.")

    def place_of(self, item_id: str | None) -> Position | None:
        """Where an item is shown; None where there is no such item."""
        return next((item.position for item in self.items() if item.id == item_id), None)

    # -- edits

    def pick(self, position: Array) -> Position | None:
        """A click at (3,): adds what fits there, else shows the ghost of it; returns its place, None where nothing is.

        A target fits everywhere, a path point where it stays in the air inside the body or at a target: undo takes both
        back. Where one of the kind already is, it is selected.
        """
        if self.regions.drawing is not None:
            return self.regions.pick(position)
        if self.add_mode == "none" or self.plan.locked:
            return None
        place = position_of(position)
        here = None if self.insert_after is not None else self._at(place, self.add_mode)
        if here is not None:
            self.ghost, self.selected = None, here
            return self.place_of(here)
        if self.add_mode == "target":
            self.ghost = None
            self.perform(AddTarget(position=place))
            return place
        fitted = self._services.planning.snap(self.case, position, self.plan)
        moved = f"Moved {fitted.moved_mm:.1f} mm, clear of bone." if fitted.moved_mm > MOVED_WORTH_SAYING_MM else ""
        words = moved or "Clear of bone here."
        self.ghost = Ghost("point", fitted.position, fitted.moved_mm, words, PLACE_WORDS[fitted.lies_in])
        if not moved and (fitted.lies_in == "air_inside" or self._at(place, "target") is not None):
            self.confirm()
        return fitted.position

    def click_item(self, item_id: str) -> Position | None:
        """A click on a point or target selects it; while clicks add points, a path is led on to a target.

        Returns its place.
        """
        self.selected, place = item_id, self.place_of(item_id)
        adds = self.add_mode == "point" and bool(self.plan.content.points) and not self.locked
        if place is not None and adds and self.kind_of(item_id) == "target":
            return self.pick(np.array(place))
        return place

    def _at(self, place: Position, kind: ItemKind) -> str | None:
        """Id of the point or target at a place, None where there is none."""
        near = (item for item in self.items() if item.kind == kind and math.dist(item.position, place) < SAME_PLACE_MM)
        return next((item.id for item in near), None)

    def enter(self, opening: Opening) -> str:
        """Begin the path at an opening; returns words where the point had to be moved clear of bone."""
        fitted = self._services.planning.snap(self.case, np.array(opening.position), self.plan)
        self.cancel()
        self.perform(EnterAt(position=fitted.position, side=opening.side))
        moved = fitted.moved_mm > MOVED_WORTH_SAYING_MM
        return f"The entry was moved {fitted.moved_mm:.1f} mm, clear of bone." if moved else ""

    def preview(self) -> SplinePath | None:
        """The spline as it would be with the ghost in it; None where it is no path point."""
        if self.ghost is None or self.ghost.kind != "point":
            return None
        points, at = self.points(), self._index_of(self.ghost)
        return _spline((*points[:at], self.ghost.position, *points[at:]))

    def confirm(self) -> None:
        ghost, self.ghost = self.ghost, None
        if ghost is None:
            return
        if ghost.kind == "target":
            self.perform(AddTarget(position=ghost.position))
            return
        index = self._index_of(ghost)
        side = "" if self.plan.content.points else self._side_at(self, ghost.position)
        self.perform(
            EnterAt(position=ghost.position, side=side) if side else AddPoint(position=ghost.position, index=index)
        )
        self.insert_after = None

    def _index_of(self, ghost: Ghost) -> int:
        """Where a point goes among those of the path: after the one that was named, at the end where it is a target's
        place, else where it lengthens the path least; never before the entry.
        """
        known = [point.id for point in self.plan.content.points]
        if self.insert_after in known:
            return known.index(self.insert_after) + 1
        points, place = self.points(), ghost.position
        longer = [
            math.dist(before, place) + math.dist(place, after) - math.dist(before, after)
            for before, after in pairwise(points)
        ]
        if not longer or self._at(place, "target") is not None or min(longer) >= math.dist(points[-1], place):
            return len(points)
        return longer.index(min(longer)) + 1

    def cancel(self) -> None:
        self.ghost = None
        self.insert_after = None
        self.regions.cancel()
        self.let_go()

    def let_go(self) -> None:
        """Whatever a hand was dragging is back where it is stored."""
        self._dragged.clear()
        self.shaft_in_hand = None
        self.regions.let_go()

    def insert_between(self, item_id: str) -> Position | None:
        """A ghost half way along the path between a point and the next one."""
        ids = [point.id for point in self.plan.content.points]
        path = self.path()
        if path is None or item_id not in ids or item_id == ids[-1]:
            raise PlanError("a point can be inserted between two points only.")
        self.cancel()  # where something is being drawn, this is no place of it
        index = ids.index(item_id)
        points = np.array(self.points())
        ahead = [path.closest(points[i])[0] for i in (index, index + 1)]
        middle = np.asarray(path.position(0.5 * (ahead[0] + ahead[1])))
        self.add_mode, self.insert_after = "point", item_id
        return self.pick(middle)

    def drag(self, item_id: str, position: Position) -> None:
        """The item follows the hand; nothing is stored yet."""
        if not self.locked:
            self.kind_of(item_id)
            self.selected = item_id
            self._dragged[item_id] = position

    def drop(self, item_id: str) -> str:
        """Store where the item was dragged to; returns words when it was moved off bone or lies outside the airway."""
        position = self._dragged.pop(item_id, None)
        if position is None or self.locked:
            return ""
        if self.kind_of(item_id) == "target":
            self.perform(MovePoint(point_id=item_id, position=position))
            return ""
        fitted = self._services.planning.snap(self.case, position, self.plan)
        self.perform(MovePoint(point_id=item_id, position=fitted.position))
        moved = f"Moved {fitted.moved_mm:.1f} mm, clear of bone." if fitted.moved_mm > DROP_MOVED_MM else ""
        # Without a CT nothing is known of any place: the ghost says so, a drop need not say it each time.
        return f"{moved} {'' if fitted.lies_in == 'not_known' else PLACE_WORDS[fitted.lies_in]}".strip()

    def set_shaft(self, point_id: str, direction: Position | None, roll_deg: float | None) -> None:
        """The shaft's direction and roll at a path point; None leaves them open."""
        self.perform(SetShaft(point_id=point_id, direction=direction, roll_deg=roll_deg))

    def use_points(self, points: tuple[PlanPoint, ...]) -> None:
        """Another way for the path, with the shaft's directions, as one edit."""
        self.cancel()
        self.perform(SetPoints(points=points))
        self.selected = None


def _nothing(operation: Change, plan: Plan) -> str:
    """That there is nothing to undo or redo; '' where there is, or for another operation."""
    if isinstance(operation, Undo) and not plan.can_undo:
        return "There is nothing to undo."
    return "There is nothing to redo." if isinstance(operation, Redo) and not plan.can_redo else ""


def _spline(points: tuple[Position, ...]) -> SplinePath | None:
    if len(points) < 2:
        return None
    try:
        return SplinePath(np.array(points))
    except PlanError:
        return None  # two points on one spot, while one is being dragged over the other
