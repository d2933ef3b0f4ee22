"""Edits of one plan: checked, stored before they return, and undone and redone across restarts."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from app.clock import utc_now
from app.services.errors import NotFound, PlanConflict, PlanLocked
from app.services.names import check_label
from app.services.plan_model import (
    Plan,
    PlanContent,
    PlanPoint,
    PlanTitle,
    check_content,
    check_position,
    check_stored,
    content_from_json,
    content_to_json,
    new_point_id,
)
from app.store import Store
from app.store.models import PlanRow, PlanStateRow
from vfix_engine.errors import InputError, PlanError

MAX_STATES = 500  # states of a plan's history that are kept


class PlanEditor:
    """The one way to change a plan, for the page and every other client; may be called from any thread.

    Each edit is one durable transaction (HAZ-24) and returns the plan that it made, or the id of what it added.
    `expected_revision` is the revision the caller saw: where the plan has moved on, PlanConflict is raised and nothing
    changes. A locked plan refuses every edit with PlanLocked.
    """

    def __init__(self, store: Store, plan_id: str) -> None:
        self._store = store
        self._plan_id = plan_id
        self._lock = threading.RLock()

    @property
    def plan(self) -> Plan:
        """The plan as stored now."""
        with self._store.reading() as session:
            return read_plan(session, self._plan_id)

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
        with self._store.reading() as session:
            row = find_row(session, self._plan_id)
            low, high = _span(session, self._plan_id)
            return not row.locked and low < row.cursor, not row.locked and row.cursor < high

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
        """Set some of the controller's settings; the others stay. Not a step of the history: every state gets them."""
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision)
            content = _content(session, row)
            kept = check_stored(replace(content, settings={**content.settings, **settings})).settings
            document = func.json_set(PlanStateRow.document, "$.settings", func.json(json.dumps(dict(kept))))
            session.execute(update(PlanStateRow).where(PlanStateRow.plan_id == self._plan_id).values(document=document))
            touch(row)
            return read_plan(session, self._plan_id)

    def set_robot(self, robot: Mapping[str, Any], *, expected_revision: int | None = None) -> Plan:
        """Keep a placing of the robot with the plan."""
        return self._edit(lambda c: replace(c, robot=robot), expected_revision)

    def set_locked(self, locked: bool, *, expected_revision: int | None = None) -> Plan:
        """Lock the plan against edits, or unlock it; not a step of the history."""
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision, even_locked=True)
            if row.locked != locked:
                row.locked = locked
                touch(row)
            return list_plan(session, row)

    def undo(self, *, expected_revision: int | None = None) -> Plan:
        """Go back to the state before the newest edit. Raises PlanError when there is none."""
        return self._move(-1, expected_revision)

    def redo(self, *, expected_revision: int | None = None) -> Plan:
        """Take an undo back. Raises PlanError when there is none to take back."""
        return self._move(+1, expected_revision)

    def _move(self, by: int, expected_revision: int | None) -> Plan:
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision)
            low, high = _span(session, self._plan_id)
            if not low <= row.cursor + by <= high:
                raise PlanError("there is nothing to undo." if by < 0 else "there is nothing to redo.")
            row.cursor += by
            touch(row)
            return list_plan(session, row)

    def _edit(self, change: Callable[[PlanContent], PlanContent], expected_revision: int | None) -> Plan:
        """Apply a change as the newest state of the history; what had been undone is gone."""
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision)
            content = check_content(change(_content(session, row)))
            later = PlanStateRow.plan_id == self._plan_id, PlanStateRow.position > row.cursor
            session.execute(delete(PlanStateRow).where(*later))
            row.cursor += 1
            session.add(PlanStateRow(plan_id=self._plan_id, position=row.cursor, document=content_to_json(content)))
            oldest = PlanStateRow.plan_id == self._plan_id, PlanStateRow.position <= row.cursor - MAX_STATES
            session.execute(delete(PlanStateRow).where(*oldest))
            touch(row)
            return read_plan(session, self._plan_id)

    def _open(self, session: Session, expected_revision: int | None, even_locked: bool = False) -> PlanRow:
        row = find_row(session, self._plan_id)
        if row.deleted_at is not None:
            raise PlanError("the plan is deleted; restore it first.")
        check_revision(row, expected_revision)
        if row.locked and not even_locked:
            raise PlanLocked("the plan is locked; unlock it to change it.")
        return row


def read_plan(session: Session, plan_id: str) -> Plan:
    """The plan of that id, deleted or not. Raises NotFound, and PlanError when its content cannot be read."""
    row = find_row(session, plan_id)
    return _plan(row, _content(session, row))


def list_plan(session: Session, row: PlanRow) -> Plan:
    """The plan of a row for a list: one whose content cannot be read says why and spoils nothing else."""
    try:
        return _plan(row, _content(session, row))
    except InputError as error:
        return _plan(row, PlanContent(), unreadable=str(error))


def title_of(row: PlanRow) -> PlanTitle:
    """What a list shows of a plan."""
    return PlanTitle(row.id, row.name, row.case_id, row.modified, row.locked, row.deleted_at)


def _plan(row: PlanRow, content: PlanContent, unreadable: str = "") -> Plan:
    return Plan(
        id=row.id,
        name=row.name,
        case_id=row.case_id,
        case_hash=row.case_hash,
        points=content.points,
        targets=content.targets,
        tool=content.tool,
        robot=content.robot,
        settings=content.settings,
        created=row.created,
        modified=row.modified,
        revision=row.revision,
        locked=row.locked,
        deleted_at=row.deleted_at,
        unreadable=unreadable,
    )


def find_row(session: Session, plan_id: str) -> PlanRow:
    """The row of that id. Raises NotFound."""
    row = session.get(PlanRow, plan_id)
    if row is None:
        raise NotFound(f"there is no plan {plan_id!r:.80}.")
    return row


def _content(session: Session, row: PlanRow) -> PlanContent:
    state = session.get(PlanStateRow, (row.id, row.cursor))
    if state is None:
        raise PlanError(f"the content of the plan {row.name!r} is missing from the store.")
    try:
        return content_from_json(state.document)
    except InputError as error:
        raise PlanError(
            f"the plan {row.name!r} cannot be read: {str(error).rstrip('.')}. "
            f"Take its newest edit back with POST /api/plans/{row.id}/undo, or delete it."
        ) from error


def _span(session: Session, plan_id: str) -> tuple[int, int]:
    """First and last position of the history."""
    positions = select(func.min(PlanStateRow.position), func.max(PlanStateRow.position))
    low, high = session.execute(positions.where(PlanStateRow.plan_id == plan_id)).one()
    return int(low), int(high)


def check_revision(row: PlanRow | Plan, expected: int | None) -> None:
    """Raise PlanConflict unless the plan is as the caller saw it, where the caller says what that was."""
    if expected is not None and row.revision != expected:
        raise PlanConflict(f"the plan is at revision {row.revision}, not {expected}; somebody else changed it.")


def touch(row: PlanRow) -> None:
    """Count a change."""
    row.revision += 1
    row.modified = utc_now()


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
