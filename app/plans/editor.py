"""Edits of one plan: each an edit of its document."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from app.documents.editor import DocumentEditor
from app.kit.errors import NotFound
from app.kit.names import check_label
from app.kit.values import check_position
from app.plans.edits import PathEdits
from app.plans.instruments import shaped_tool
from app.plans.model import (
    Plan,
    PlanContent,
    PlanPoint,
    check_robot,
    check_tool_shape,
    new_point_id,
    without_placement,
)
from app.plans.points import check_point
from vfix_engine.errors import PlanError


class PlanEditor:
    """The only interface for changes of a plan, for the page and every other client; may be called from any thread.

    Each edit is one of the plan's document and returns the plan that it made, or the id of what it added.
    `expected_revision` is the revision the caller saw: where the plan has moved on, PlanConflict is raised and nothing
    changes. A locked plan refuses every edit with PlanLocked.
    Points are those of the chosen path. paths: edits of these, with the same rules.
    """

    def __init__(self, document: DocumentEditor[PlanContent]) -> None:
        self._document = document
        self.paths = PathEdits(self._edit)

    @property
    def plan(self) -> Plan:
        """The plan as stored now."""
        return self._document.document

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
        after: str | None = None,
        expected_revision: int | None = None,
    ) -> tuple[str, Plan]:
        """As `add_point`, with the plan that it made. after: id of the point that it follows, instead of an index."""
        point_id = new_point_id()

        def change(content: PlanContent) -> PlanContent:
            points = list(content.points)
            where = len(points) if index is None else index
            if after is not None:
                where = _index(points, after) + 1
            if not 0 <= where <= len(points):
                raise PlanError(f"there is no place {where} in a path of {len(points)} points.")
            points.insert(where, _new(point_id, position, label, "P", points))
            return content.with_points(points)

        return point_id, self._edit(change, expected_revision)

    def set_points(self, points: Sequence[PlanPoint], *, expected_revision: int | None = None) -> Plan:
        """Another way for the chosen path: all of its points with the shaft's directions, as one edit."""
        checked = [check_point(point) for point in points]
        return self._edit(lambda content: content.with_points(checked), expected_revision)

    def insert_between(
        self,
        before_id: str,
        position: Sequence[float],
        label: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> str:
        """Add a path point right after the one called `before_id`; returns its id."""
        return self.added_point(position, label, after=before_id, expected_revision=expected_revision)[0]

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

    def take_targets(self, other: Plan, *, expected_revision: int | None = None) -> Plan:
        """Add the targets of another plan of the same head as one edit; those that are here already are left out.

        Raises PlanError where the other plan is of another head, or has no target that is not here.
        """
        if other.case_id != self.plan.case_id:
            raise PlanError("that plan belongs to another head; its targets may lie in other anatomy.")

        def change(content: PlanContent) -> PlanContent:
            here = {(target.label, target.position) for target in content.targets}
            new = [one for one in other.content.targets if (one.label, one.position) not in here]
            if not new:
                raise PlanError("that plan has no target that is not here already.")
            return replace(content, targets=(*content.targets, *(replace(one, id=new_point_id()) for one in new)))

        return self._edit(change, expected_revision)

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
        return self._document.set_settings(settings, expected_revision=expected_revision)

    def set_robot(self, robot: Mapping[str, Any], *, expected_revision: int | None = None) -> Plan:
        """Keep a placement of the robot with the plan."""
        checked = check_robot(robot)
        return self._edit(lambda c: replace(c, robot=checked), expected_revision)

    def choose_robot(self, robot: Mapping[str, Any], *, expected_revision: int | None = None) -> Plan:
        """Another robot, without a placement: a shipped one's name, or name, urdf and tool_frame of one's own."""
        checked = check_robot(without_placement(robot))
        return self._edit(lambda c: replace(c, robot=checked), expected_revision)

    def choose_tool(
        self, name: str, shape: Mapping[str, float] | None = None, *, expected_revision: int | None = None
    ) -> Plan:
        """Another tool, or another shape of it; the robot's placement, made for the old one, is dropped.

        Raises RobotError for a tool that there is not, or a shape that it cannot have.
        """
        checked = check_tool_shape(shape or {})
        shaped_tool(name, **checked)

        def change(content: PlanContent) -> PlanContent:
            return replace(content, robot=without_placement(content.robot)).with_tool(name, checked)

        return self._edit(change, expected_revision)

    def set_locked(self, locked: bool, *, expected_revision: int | None = None) -> Plan:
        """Lock the plan against edits, or unlock it; not a step of the history."""
        return self._document.set_locked(locked, expected_revision=expected_revision)

    def undo(self, *, expected_revision: int | None = None) -> Plan:
        """Go back to the state before the newest edit. Raises PlanError when there is none."""
        return self._document.undo(expected_revision=expected_revision)

    def redo(self, *, expected_revision: int | None = None) -> Plan:
        """Take an undo back. Raises PlanError when there is none to take back."""
        return self._document.redo(expected_revision=expected_revision)

    def _edit(self, change: Callable[[PlanContent], PlanContent], expected_revision: int | None) -> Plan:
        return self._document.edit(change, expected_revision=expected_revision)


def _new(
    point_id: str, position: Sequence[float], label: str | None, letter: str, others: Sequence[PlanPoint]
) -> PlanPoint:
    if label is None:
        taken = {point.label for point in others}
        label = next(text for n in range(1, len(others) + 2) if (text := f"{letter}{n}") not in taken)
    else:
        check_label(label, "label")
    return PlanPoint(point_id, label, check_position(position))


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
