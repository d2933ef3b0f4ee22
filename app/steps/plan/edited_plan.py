"""One plan as a client edits it: selection, ghost, drags and what a click adds; every edit goes through the editor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from app.scene.plan import PlanItem
from app.services import Services
from app.services.plan_model import check_robot
from app.services.tissue_words import place_words
from app.steps.plan.instruments import robot_view, tool_view
from app.steps.plan.sections import AddKind, PlanSection
from app.views.plan_items import Position, entries, plan_items, position_of
from app.views.sections import ItemKind
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath

Floats = npt.NDArray[np.float64]
T = TypeVar("T")

MOVED_WORTH_SAYING_MM = 0.05  # by a click, which goes to the nearest free place
DROP_MOVED_MM = 0.2  # by a drop, whose hand is less exact


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

    def __init__(self, services: Services, plan_id: str) -> None:
        self._services = services
        self._editor = services.plans.editor(plan_id)
        self._dragged: dict[str, Position] = {}
        self._said: Any = None  # of robot and tool, when they were read
        self.refresh()
        self.selected: str | None = None
        self.add_mode: AddKind = "point"
        self.insert_after: str | None = None
        self.ghost: Ghost | None = None
        self._path: tuple[tuple[Position, ...], SplinePath | None] | None = None

    # -- what there is

    def refresh(self) -> None:
        """Read the plan anew: after each edit, and now and then because other clients edit too."""
        self.plan = self._editor.plan
        if (said := (self.plan.robot, self.plan.tool, self.plan.tool_shape)) != self._said:
            self._said = said
            self._robot, self._tool = robot_view(self.plan, self._services.instruments), tool_view(self.plan)
        self.can_undo, self.can_redo = self._editor.history()
        known = {entry.id for entry in (*self.plan.points, *self.plan.targets)}
        self._dragged = {item_id: place for item_id, place in self._dragged.items() if item_id in known}

    def _edit(self, change: Callable[..., T], *arguments: Any, **options: Any) -> T:
        """Do an edit on the revision that is shown; when the plan has moved on, it is shown and the edit refused."""
        try:
            return change(*arguments, expected_revision=self.plan.revision, **options)
        finally:
            self.refresh()

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

    def path(self) -> SplinePath | None:
        """The spline through the points, None while there is none."""
        points = tuple(self.points())
        if self._path is None or self._path[0] != points:
            self._path = (points, _spline(points))
        return self._path[1]

    def view(self) -> PlanSection:
        """The page's section."""
        plan, items, path = self.plan, self.items(), self.path()
        return {
            "id": plan.id,
            "name": plan.name,
            "frame": plan.frame,
            "unit": plan.unit,
            **entries(items),
            "selected": self.selected,
            "locked": plan.locked,
            "can_undo": self.can_undo,
            "can_redo": self.can_redo,
            "add_mode": self.add_mode,
            "degree": 0 if path is None else int(path.degree),
            "length_mm": 0.0 if path is None else float(path.length),
            "ghost": None
            if self.ghost is None
            else {
                "kind": self.ghost.kind,
                "position": list(self.ghost.position),
                "words": f"{self.ghost.words} {self.ghost.lies_in}".strip(),
            },
            "robot": self._robot,
            "tool": self._tool,
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

    def pick(self, position: Floats, on_bone: bool) -> None:
        """A click at (3,): shows the ghost of what it would add."""
        if self.add_mode == "none" or self.locked:
            return
        if self.add_mode == "target":
            self.ghost = Ghost("target", position_of(position), 0.0, "Target where you clicked.")
            return
        fitted = self._services.planning.fit_point(self.plan_id, position_of(position))
        moved = f"Moved {fitted.moved_mm:.1f} mm, clear of bone." if fitted.moved_mm > MOVED_WORTH_SAYING_MM else ""
        words = moved or "Clear of bone here."
        self.ghost = Ghost("point", fitted.position, fitted.moved_mm, words, place_words(fitted.lies_in))

    def confirm(self) -> None:
        ghost, self.ghost = self.ghost, None
        if ghost is None:
            return
        if ghost.kind == "target":
            self.selected = self._edit(self._editor.add_target, ghost.position)
            return
        ids = [point.id for point in self.plan.points]
        index = ids.index(self.insert_after) + 1 if self.insert_after in ids else None
        self.selected = self._edit(self._editor.add_point, ghost.position, index=index)
        self.insert_after = None

    def cancel(self) -> None:
        self.ghost = None
        self.insert_after = None
        self.let_go()

    def let_go(self) -> None:
        """Whatever a hand was dragging is back where it is stored."""
        self._dragged.clear()

    def insert_between(self, item_id: str) -> None:
        """A ghost half way along the path between a point and the next one."""
        ids = [point.id for point in self.plan.points]
        path = self.path()
        if path is None or item_id not in ids or item_id == ids[-1]:
            raise PlanError("a point can be inserted between two points only.")
        index = ids.index(item_id)
        points = np.array(self.points())
        ahead = [path.closest(points[i])[0] for i in (index, index + 1)]
        middle = np.asarray(path.position(0.5 * (ahead[0] + ahead[1])))
        self.add_mode, self.insert_after = "point", item_id
        self.pick(middle, on_bone=False)

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
            self._edit(self._editor.move_target, item_id, position)
            return ""
        fitted = self._services.planning.fit_point(self.plan_id, position)
        self._edit(self._editor.move_point, item_id, fitted.position)
        moved = (
            f"The point was moved {fitted.moved_mm:.1f} mm, clear of bone." if fitted.moved_mm > DROP_MOVED_MM else ""
        )
        # Without a CT nothing is known of any place: the ghost says so, a drop need not say it each time.
        return f"{moved} {'' if fitted.lies_in == 'not_known' else place_words(fitted.lies_in)}".strip()

    def delete(self, item_id: str) -> None:
        self.let_go()
        if self.kind_of(item_id) == "target":
            self._edit(self._editor.delete_target, item_id)
        else:
            self._edit(self._editor.delete_point, item_id)
        if self.selected == item_id:
            self.selected = None

    def rename(self, item_id: str, label: str) -> None:
        self._edit(self._editor.rename_point, item_id, label)

    def choose_robot(self, robot: dict[str, str]) -> None:
        """Raises PlanError and RobotError with what is wrong with it."""
        self._services.instruments.robot(check_robot(robot))
        self._edit(self._editor.choose_robot, robot)

    def choose_tool(self, name: str, shape: dict[str, float]) -> None:
        """Raises RobotError for a shape that the tool cannot have."""
        self._edit(self._editor.choose_tool, name, shape)

    def set_locked(self, locked: bool) -> None:
        self.cancel()
        self._edit(self._editor.set_locked, locked)

    def undo(self) -> str:
        """Returns words where there is nothing to undo: a key pressed once too often is no error."""
        return self._step(self._editor.undo, self.can_undo, "undo")

    def redo(self) -> str:
        """Returns words where there is nothing to redo."""
        return self._step(self._editor.redo, self.can_redo, "redo")

    def _step(self, act: Callable[..., object], possible: bool, name: str) -> str:
        self.cancel()
        if not possible and not self.locked:
            return f"There is nothing to {name}."
        self._edit(act)
        return ""


def _spline(points: tuple[Position, ...]) -> SplinePath | None:
    if len(points) < 2:
        return None
    try:
        return SplinePath(np.array(points))
    except PlanError:
        return None  # two points on one spot, while one is being dragged over the other
