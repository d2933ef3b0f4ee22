"""Edits of one plan: each an edit of its document."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from app.services.documents import DocumentEditor
from app.services.errors import NotFound
from app.services.instruments import shaped_tool
from app.services.names import check_label
from app.services.plan_kind import plan_of
from app.services.plan_model import (
    Plan,
    PlanContent,
    PlanPoint,
    check_position,
    new_point_id,
    without_placing,
)
from vfix_engine.errors import PlanError


class PlanEditor:
    """The one way to change a plan, for the page and every other client; may be called from any thread.

    Each edit is one of the plan's document and returns the plan that it made, or the id of what it added.
    `expected_revision` is the revision the caller saw: where the plan has moved on, PlanConflict is raised and nothing
    changes. A locked plan refuses every edit with PlanLocked.
    """

    def __init__(self, document: DocumentEditor[PlanContent]) -> None:
        self._document = document

    @property
    def plan(self) -> Plan:
        """The plan as stored now."""
        return plan_of(self._document.document)

    @property
    def revision(self) -> int:
        return self.plan.revision

    @property
    def locked(self) -> bool:
        return self.plan.locked

    @property
    def can_undo(self) -> bool:
        return self.history()[0]

    @property
    def can_redo(self) -> bool:
        return self.history()[1]

    def history(self) -> tuple[bool, bool]:
        """Whether there is something to undo, and something to redo; neither on a locked plan."""
        return self._document.history()

    def add_point(
        self,
        position: Sequence[float],
        label: str | None = None,
        index: int | None = None,
        *,
        expected_revision: int | None = None,
    ) -> str:
        """Add a path point at the end, or before the point at `index`; returns its id."""
        return self.added_point(position, label, index, expected_revision=expected_revision)[0]

    def added_point(
        self,
        position: Sequence[float],
        label: str | None = None,
        index: int | None = None,
        *,
        expected_revision: int | None = None,
    ) -> tuple[str, Plan]:
        """As `add_point`, with the plan that it made."""

        def place(points: Sequence[PlanPoint]) -> int:
            where = len(points) if index is None else index
            if not 0 <= where <= len(points):
                raise PlanError(f"there is no place {where} in a path of {len(points)} points.")
            return where

        return self._insert(position, label, place, expected_revision)

    def insert_between(
        self,
        before_id: str,
        position: Sequence[float],
        label: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> str:
        """Add a path point right after the one called `before_id`; returns its id."""
        return self._insert(position, label, lambda points: _index(points, before_id) + 1, expected_revision)[0]

    def _insert(
        self,
        position: Sequence[float],
        label: str | None,
        place: Callable[[Sequence[PlanPoint]], int],
        expected_revision: int | None,
    ) -> tuple[str, Plan]:
        """Add a path point at the index that `place` finds in the path as it is stored by then."""
        point_id = new_point_id()

        def change(content: PlanContent) -> PlanContent:
            points = list(content.points)
            points.insert(place(content.points), _new(point_id, position, label, "P", content.points))
            return content.with_points(points)

        return point_id, self._edit(change, expected_revision)

    def move_point(self, point_id: str, position: Sequence[float], *, expected_revision: int | None = None) -> Plan:
        """Put a path point somewhere else."""
        place = check_position(position)
        return self._edit(lambda c: c.with_points(_replaced(c.points, point_id, position=place)), expected_revision)

    def delete_point(self, point_id: str, *, expected_revision: int | None = None) -> Plan:
        """Take a path point away."""
        return self._edit(lambda c: c.with_points(_without(c.points, point_id)), expected_revision)

    def add_target(
        self, position: Sequence[float], label: str | None = None, *, expected_revision: int | None = None
    ) -> str:
        """Add a target; returns its id."""
        return self.added_target(position, label, expected_revision=expected_revision)[0]

    def added_target(
        self, position: Sequence[float], label: str | None = None, *, expected_revision: int | None = None
    ) -> tuple[str, Plan]:
        """As `add_target`, with the plan that it made."""
        target_id = new_point_id()

        def change(content: PlanContent) -> PlanContent:
            target = _new(target_id, position, label, "T", content.targets)
            return replace(content, targets=(*content.targets, target))

        return target_id, self._edit(change, expected_revision)

    def move_target(self, target_id: str, position: Sequence[float], *, expected_revision: int | None = None) -> Plan:
        """Put a target somewhere else."""
        place = check_position(position)
        return self._edit(
            lambda c: replace(c, targets=_replaced(c.targets, target_id, position=place)), expected_revision
        )

    def delete_target(self, target_id: str, *, expected_revision: int | None = None) -> Plan:
        """Take a target away."""
        return self._edit(lambda c: replace(c, targets=_without(c.targets, target_id)), expected_revision)

    def rename_point(self, item_id: str, label: str, *, expected_revision: int | None = None) -> Plan:
        """Give a path point or a target another label."""
        text = check_label(label, "label")

        def change(content: PlanContent) -> PlanContent:
            if any(point.id == item_id for point in content.targets):
                return replace(content, targets=_replaced(content.targets, item_id, label=text))
            return content.with_points(_replaced(content.points, item_id, label=text))

        return self._edit(change, expected_revision)

    def set_settings(self, settings: Mapping[str, float], *, expected_revision: int | None = None) -> Plan:
        """Set some of the controller's settings; the others stay. Not a step of the history: undo leaves them."""
        return plan_of(self._document.set_settings(settings, expected_revision=expected_revision))

    def set_robot(self, robot: Mapping[str, Any], *, expected_revision: int | None = None) -> Plan:
        """Keep a placing of the robot with the plan."""
        return self._edit(lambda c: replace(c, robot=robot), expected_revision)

    def choose_robot(self, robot: Mapping[str, Any], *, expected_revision: int | None = None) -> Plan:
        """Another robot, without a placing: a shipped one's name, or name, urdf and tool_frame of one's own."""
        return self._edit(lambda c: replace(c, robot=without_placing(robot)), expected_revision)

    def choose_tool(
        self, name: str, shape: Mapping[str, float] | None = None, *, expected_revision: int | None = None
    ) -> Plan:
        """Another tool, or another shape of it; the robot's placing, made for the old one, is dropped.

        Raises RobotError for a tool that there is not, or a shape that it cannot have.
        """
        shaped_tool(name, shape or {})

        def change(content: PlanContent) -> PlanContent:
            return replace(content, tool=name, tool_shape=shape or {}, robot=without_placing(content.robot))

        return self._edit(change, expected_revision)

    def set_locked(self, locked: bool, *, expected_revision: int | None = None) -> Plan:
        """Lock the plan against edits, or unlock it; not a step of the history."""
        return plan_of(self._document.set_locked(locked, expected_revision=expected_revision))

    def undo(self, *, expected_revision: int | None = None) -> Plan:
        """Go back to the state before the newest edit. Raises PlanError when there is none."""
        return plan_of(self._document.undo(expected_revision=expected_revision))

    def redo(self, *, expected_revision: int | None = None) -> Plan:
        """Take an undo back. Raises PlanError when there is none to take back."""
        return plan_of(self._document.redo(expected_revision=expected_revision))

    def _edit(self, change: Callable[[PlanContent], PlanContent], expected_revision: int | None) -> Plan:
        return plan_of(self._document.edit(change, expected_revision=expected_revision))


def _new(
    point_id: str, position: Sequence[float], label: str | None, letter: str, others: Sequence[PlanPoint]
) -> PlanPoint:
    if label is None:
        taken = {point.label for point in others}
        label = next(text for n in range(1, len(others) + 2) if (text := f"{letter}{n}") not in taken)
    return PlanPoint(point_id, check_label(label, "label"), check_position(position))


def _index(points: Sequence[PlanPoint], point_id: str) -> int:
    for index, point in enumerate(points):
        if point.id == point_id:
            return index
    raise NotFound(f"there is no point {point_id!r:.80} in this plan.")


def _replaced(points: Sequence[PlanPoint], point_id: str, **changes: Any) -> tuple[PlanPoint, ...]:
    index = _index(points, point_id)
    return (*points[:index], replace(points[index], **changes), *points[index + 1 :])


def _without(points: Sequence[PlanPoint], point_id: str) -> tuple[PlanPoint, ...]:
    index = _index(points, point_id)
    return (*points[:index], *points[index + 1 :])
