"""Plans of the store: listed, made, renamed, duplicated, deleted with recovery, and edited."""

from __future__ import annotations

import secrets
import threading

from sqlalchemy import Select, select

from app.clock import utc_now
from app.services.errors import OtherCase, PlanLocked
from app.services.names import MAX_NAME, check_name
from app.services.plan_editor import PlanEditor, check_revision, find_row, list_plan, read_plan, title_of, touch
from app.services.plan_model import (
    Plan,
    PlanContent,
    PlanFile,
    PlanPoint,
    PlanTitle,
    check_content,
    content_to_json,
    unplaced_robot,
)
from app.store import Store
from app.store.models import CaseRow, PlanRow, PlanStateRow
from vfix_engine.errors import PlanError

__all__ = ["Plan", "PlanContent", "PlanEditor", "PlanFile", "PlanPoint", "PlanService", "PlanTitle"]


class PlanService:
    """Plans of every case; may be used from any thread."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._editors: dict[str, PlanEditor] = {}
        self._lock = threading.Lock()

    def list(self, case_id: str | None = None, include_deleted: bool = False) -> tuple[Plan, ...]:
        """Plans of a case, or of all, oldest first; one whose content cannot be read says why (`unreadable`)."""
        with self._store.reading() as session:
            return tuple(list_plan(session, row) for row in session.scalars(_listed(case_id, include_deleted)))

    def titles(self, case_id: str | None = None, include_deleted: bool = False) -> tuple[PlanTitle, ...]:
        """Plans of a case, or of all, oldest first, without reading what they contain."""
        with self._store.reading() as session:
            return tuple(title_of(row) for row in session.scalars(_listed(case_id, include_deleted)))

    def get(self, plan_id: str) -> Plan:
        """The plan, deleted or not. Raises NotFound, and PlanError when its content cannot be read."""
        with self._store.reading() as session:
            return read_plan(session, plan_id)

    def create(
        self, case_id: str, name: str, content: PlanContent | None = None, *, plan_id: str | None = None
    ) -> Plan:
        """Make a plan of a case; empty unless a content is given."""
        check_name(name, "plan's name")
        content = check_content(content or PlanContent())
        plan_id, now = plan_id or f"plan-{secrets.token_hex(6)}", utc_now()
        with self._store.writing() as session:
            case = session.get(CaseRow, case_id)
            if case is None or case.deleted_at is not None:
                raise PlanError("the case of this plan is not there or deleted.")
            session.add(
                PlanRow(
                    id=plan_id,
                    case_id=case_id,
                    case_hash=case.content_hash,
                    name=name,
                    created=now,
                    modified=now,
                    deleted_at=None,
                    locked=False,
                    revision=1,
                    cursor=0,
                )
            )
            session.flush()
            session.add(PlanStateRow(plan_id=plan_id, position=0, document=content_to_json(content)))
        return self.get(plan_id)

    def add_file(self, case_id: str, file: PlanFile, *, name: str | None = None, other_case: bool = False) -> Plan:
        """Make a plan out of an imported file. `name` wins over the file's.

        Raises OtherCase when the file was made for another head, unless `other_case` says that this is known; the
        robot's placing is dropped then.
        """
        content = file.content
        with self._store.reading() as session:
            case = session.get(CaseRow, case_id)
        if case is not None and file.case_hash not in (None, case.content_hash):
            if not other_case:
                raise OtherCase("the plan was made for another case; its points may lie in other anatomy.")
            content = PlanContent(
                content.points, content.targets, content.tool, unplaced_robot(content.robot["name"]), content.settings
            )
        return self.create(case_id, file.name if name is None else name, content)

    def duplicate(self, plan_id: str, name: str | None = None, *, expected_revision: int | None = None) -> Plan:
        """Copy a plan as it is now, without its history. Raises PlanConflict when that is not the expected revision."""
        plan = self.get(plan_id)
        check_revision(plan, expected_revision)
        if name is None:
            name = f"{plan.name[: MAX_NAME - 7]} (copy)"
        return self.create(plan.case_id, name, plan.content)

    def rename(self, plan_id: str, name: str, *, expected_revision: int | None = None) -> Plan:
        """Give a plan another name."""
        check_name(name, "plan's name")
        return self._change(plan_id, expected_revision, name=name)

    def delete(self, plan_id: str, *, expected_revision: int | None = None) -> Plan:
        """Take a plan off the lists; `restore` brings it back. Raises PlanLocked for a locked one."""
        return self._change(plan_id, expected_revision, deleted_at=utc_now())

    def restore(self, plan_id: str, *, expected_revision: int | None = None) -> Plan:
        """Bring a deleted plan back."""
        return self._change(plan_id, expected_revision, deleted_at=None)

    def editor(self, plan_id: str) -> PlanEditor:
        """The plan's editor, the same for every caller. Raises NotFound."""
        with self._store.reading() as session:
            find_row(session, plan_id)
        with self._lock:
            if plan_id not in self._editors:
                self._editors[plan_id] = PlanEditor(self._store, plan_id)
            return self._editors[plan_id]

    def _change(self, plan_id: str, expected_revision: int | None, **values: str | None) -> Plan:
        with self._store.writing() as session:
            row = find_row(session, plan_id)
            check_revision(row, expected_revision)
            if row.locked and values.get("deleted_at") is not None:
                raise PlanLocked("the plan is locked; unlock it to delete it.")
            for name, value in values.items():
                setattr(row, name, value)
            touch(row)
            session.flush()
            return list_plan(session, row)


def _listed(case_id: str | None, include_deleted: bool) -> Select[PlanRow]:
    """Rows of plans, oldest first."""
    query = select(PlanRow).order_by(PlanRow.created, PlanRow.id)
    if case_id is not None:
        query = query.where(PlanRow.case_id == case_id)
    return query if include_deleted else query.where(PlanRow.deleted_at.is_(None))
