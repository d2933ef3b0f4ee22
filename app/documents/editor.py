"""Edits of one document: checked, stored before they return, and undone and redone across restarts."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Generic

from sqlalchemy import delete
from sqlalchemy.orm import Session

from app.documents.document import Content, Document
from app.documents.history_words import step_words
from app.documents.kind import SETTINGS, DocumentKind
from app.documents.rows import (
    content_of,
    content_with,
    document_of,
    find_row,
    list_document,
    read_document,
    span_of,
    touch,
    write_state,
)
from app.store import Store
from app.store.models import DocumentRow, DocumentStateRow
from vfix_engine.errors import InputError

MAX_STATES = 500  # states of a document's history that are kept


class DocumentEditor(Generic[Content]):
    """The only interface for changes of a document, for the page and every other client; may be called from any thread.

    Each edit is one durable transaction (HAZ-24) and returns the document that it made.
    `expected_revision` is the revision the caller saw: where the document has moved on, the kind's conflict is raised
    and nothing changes. A locked document refuses every edit.
    """

    def __init__(self, store: Store, kind: DocumentKind[Content], document_id: str) -> None:
        self._store, self._kind = store, kind
        self._id = document_id
        self._lock = threading.RLock()
        self._known: Document[Content] | None = None  # a revision never changes: what was read once is not read again

    @property
    def document(self) -> Document[Content]:
        """The document as stored now."""
        with self._store.reading() as session:
            self._known = known = read_document(session, self._kind, self._id)
        return known

    def history(self) -> tuple[bool, bool]:
        """Whether there is something to undo, and something to redo; neither on a locked document."""
        with self._store.reading() as session:
            row = find_row(session, self._kind, self._id)
            low, high = span_of(session, self._id)
            return not row.locked and low < row.cursor, not row.locked and row.cursor < high

    def edit(self, change: Callable[[Content], Content], *, expected_revision: int | None = None) -> Document[Content]:
        """Apply a change as the newest state of the history; what had been undone is gone."""
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision)
            known = self._known_at(row)
            before = content_of(session, self._kind, row) if known is None else known.content
            content = self._kind.check(change(before))
            states = DocumentStateRow.document_id == self._id
            session.execute(delete(DocumentStateRow).where(states, DocumentStateRow.position > row.cursor))
            row.cursor += 1
            write_state(session, self._kind, row, content)
            session.execute(
                delete(DocumentStateRow).where(states, DocumentStateRow.position <= row.cursor - MAX_STATES)
            )
            touch(row)
            made = document_of(self._kind, row, content, (row.cursor - 1, row.cursor))
        self._known = made  # once it is durable
        return made

    def set_settings(self, settings: Mapping[str, Any], *, expected_revision: int | None = None) -> Document[Content]:
        """Set some settings; the others stay. Not a step of the history: undo and redo leave them."""
        if not self._kind.has_settings:
            raise self._kind.errors.refused(f"a {self._kind.noun} has no settings.")
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision)
            content = content_with(session, self._kind, row, settings)
            row.settings = self._kind.write(content)[SETTINGS]
            touch(row)
            return read_document(session, self._kind, self._id)

    def set_locked(self, locked: bool, *, expected_revision: int | None = None) -> Document[Content]:
        """Lock the document against edits, or unlock it; not a step of the history."""
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision, even_locked=True)
            if row.locked != locked:
                row.locked = locked
                touch(row)
            return list_document(session, self._kind, row)

    def undo(self, *, expected_revision: int | None = None) -> Document[Content]:
        """Go back to the state before the newest edit. Raises the kind's refusal when there is none."""
        return self._move(-1, expected_revision)

    def redo(self, *, expected_revision: int | None = None) -> Document[Content]:
        """Take an undo back. Raises the kind's refusal when there is none to take back."""
        return self._move(+1, expected_revision)

    def _move(self, by: int, expected_revision: int | None) -> Document[Content]:
        with self._lock, self._store.writing() as session:
            row = self._open(session, expected_revision)
            low, high = span_of(session, self._id)
            if not low <= row.cursor + by <= high:
                raise self._kind.errors.refused(f"there is nothing to {'undo' if by < 0 else 'redo'}.")
            here = self._known_at(row) or list_document(session, self._kind, row)
            row.cursor += by
            touch(row)
            there = list_document(session, self._kind, row)
            before, after = (there, here) if by < 0 else (here, there)  # the edit that is undone led from one to other
            read = not (here.unreadable or there.unreadable)
            edits = self._kind.changes(before.content, after.content) if read else ()
        self._known = None if there.unreadable else there
        return replace(there, told=step_words(by, edits))

    def _known_at(self, row: DocumentRow) -> Document[Content] | None:
        """What was read or made last, if that is the row's revision."""
        known = self._known
        return known if known is not None and known.revision == row.revision else None

    def _open(self, session: Session, expected_revision: int | None, even_locked: bool = False) -> DocumentRow:
        row = find_row(session, self._kind, self._id, expected_revision)
        self._kind.check_editable(row, even_locked=even_locked)
        return row


def check_still_newest(offered: int | None, revision: int) -> None:
    """Refuse the undo of one edit where another one is the newest by now.

    offered: the revision that the edit led to; None for an undo of whatever is the newest. revision: the present one.
    """
    if offered is not None and offered != revision:
        raise InputError("something else was edited since, so this is not undone. Undo takes back the newest edit.")
