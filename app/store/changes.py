"""What was stored since when: counters by which whoever has read something knows that it is still so."""

from __future__ import annotations

import threading
from typing import Any

from sqlalchemy import event
from sqlalchemy.orm import ORMExecuteState, Session, UOWTransaction

from app.store.models import CaseRow, DocumentRow

CASES = "case"  # the name of cases among the kinds of what is stored


class Changes:
    """Counts commits; thread-safe. Read a counter before what it is of, never after: a commit may come in between.

    What another process has stored, and what was deleted for good, counts as a change of everything.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._everything = self._commits = 0
        self._kinds: dict[str, int] = {}
        self._revisions: dict[str, int] = {}

    @property
    def count(self) -> int:
        """Of all changes."""
        with self._lock:
            return self._commits

    def of(self, *kinds: str) -> tuple[int, ...]:
        """Another value once something of these kinds was stored: `CASES`, or kinds of documents."""
        with self._lock:
            return (self._everything, *(self._kinds.get(kind, 0) for kind in kinds))

    def of_document(self, document_id: str) -> tuple[int, int | None]:
        """Another value once the document was stored; the second number is its revision, None where none was stored."""
        with self._lock:
            return self._everything, self._revisions.get(document_id)

    def everything(self) -> None:
        """Something was stored, and what is not known."""
        with self._lock:
            self._everything += 1
            self._commits += 1

    def committed(self, session: Session) -> None:
        """Count what a :class:`CountedSession` has stored."""
        rows, deleted = session.info.get(_ROWS, ()), session.info.get(_DELETED, False)
        with self._lock:
            self._everything += deleted
            self._commits += deleted or bool(rows)
            for row in rows:
                kind = CASES if isinstance(row, CaseRow) else row.kind
                self._kinds[kind] = self._kinds.get(kind, 0) + 1
                if isinstance(row, DocumentRow):
                    self._revisions[row.id] = row.revision


class CountedSession(Session):
    """A session that notes the cases and documents that it stores."""


_ROWS, _DELETED = "stored_rows", "deleted_for_good"


@event.listens_for(CountedSession, "after_flush")
def _flushed(session: Session, context: UOWTransaction) -> None:
    counted = (CaseRow, DocumentRow)
    session.info.setdefault(_ROWS, set()).update(
        row for rows in (session.new, session.dirty) for row in rows if isinstance(row, counted)
    )
    if any(isinstance(row, counted) for row in session.deleted):
        session.info[_DELETED] = True


@event.listens_for(CountedSession, "do_orm_execute")
def _executed(state: ORMExecuteState) -> None:
    mapper: Any = state.bind_mapper
    if not state.is_select and mapper is not None and mapper.class_ in (CaseRow, DocumentRow):
        state.session.info[_DELETED] = True
