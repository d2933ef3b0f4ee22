"""Documents of one kind: listed, made, renamed, duplicated, deleted with recovery, and edited."""

from __future__ import annotations

import secrets
import threading
from typing import Generic

from sqlalchemy import Select, delete, select

from app.clock import utc_now
from app.documents.document import Content, Document, DocumentTitle
from app.documents.editor import DocumentEditor
from app.documents.kind import DocumentKind
from app.documents.rows import (
    find_row,
    list_document,
    read_document,
    title_of,
    touch,
    write_state,
)
from app.kit.errors import NotFound
from app.kit.names import MAX_NAME, check_name, unused_name
from app.store import Store
from app.store.models import CaseRow, DocumentRow, DocumentStateRow


class Documents(Generic[Content]):
    """Documents of one kind, of every case; may be used from any thread."""

    def __init__(self, store: Store, kind: DocumentKind[Content]) -> None:
        self._store = store
        self.kind = kind
        self._editors: dict[str, DocumentEditor[Content]] = {}
        self._lock = threading.Lock()

    def list(self, case_id: str | None = None, include_deleted: bool = False) -> tuple[Document[Content], ...]:
        """Documents of a case, or of all, oldest first; one that cannot be read says why (`unreadable`)."""
        with self._store.reading() as session:
            rows = session.scalars(self._listed(case_id, include_deleted))
            return tuple(list_document(session, self.kind, row) for row in rows)

    def of_case(self, case_id: str, include_deleted: bool = False) -> tuple[Document[Content], ...]:
        """Documents of a case that is there, as `list`. Raises NotFound."""
        with self._store.reading() as session:
            if session.get(CaseRow, case_id) is None:
                raise NotFound(f"there is no case {case_id!r:.80}.")
        return self.list(case_id, include_deleted)

    def titles(self, case_id: str | None = None, include_deleted: bool = False) -> tuple[DocumentTitle, ...]:
        """Documents of a case, or of all, oldest first, without reading what they contain."""
        with self._store.reading() as session:
            return tuple(title_of(row) for row in session.scalars(self._listed(case_id, include_deleted)))

    def get(self, document_id: str) -> Document[Content]:
        """The document, deleted or not. Raises NotFound, and the kind's refusal when it cannot be read."""
        with self._store.reading() as session:
            return read_document(session, self.kind, document_id)

    def title(self, document_id: str) -> DocumentTitle:
        """What a list shows of a document, deleted or not, readable or not. Raises NotFound."""
        with self._store.reading() as session:
            return title_of(find_row(session, self.kind, document_id))

    def has(self, document_id: str) -> bool:
        """Whether there is a document of that id, deleted or not, readable or not."""
        with self._store.reading() as session:
            row = session.get(DocumentRow, document_id)
            return row is not None and row.kind == self.kind.name

    def create(
        self,
        case_id: str,
        name: str,
        content: Content | None = None,
        *,
        document_id: str | None = None,
        numbered: bool = False,
    ) -> Document[Content]:
        """Make a document of a case; empty unless a content is given.

        numbered: it comes in from elsewhere, and gets a number where another one of the case has the name.
        document_id: of one that is there once only: where another planner has just made it, that one is returned.
        """
        check_name(name, f"{self.kind.noun}'s name")
        checked = self.kind.check(self.kind.empty() if content is None else content)
        wanted, now = document_id, utc_now()
        document_id = wanted or f"{self.kind.name}-{secrets.token_hex(6)}"
        with self._store.writing() as session:
            if wanted is not None and session.get(DocumentRow, wanted) is not None:
                return read_document(session, self.kind, wanted)
            case = session.get(CaseRow, case_id)
            if case is None or case.deleted_at is not None:
                raise self.kind.errors.refused(f"the case of this {self.kind.noun} is not there or deleted.")
            if numbered:
                name = unused_name(name, {one.name for one in session.scalars(self._listed(case_id, False))})
            row = DocumentRow(
                id=document_id,
                kind=self.kind.name,
                case_id=case_id,
                case_hash=case.content_hash,
                name=name,
                created=now,
                modified=now,
                deleted_at=None,
                locked=False,
                revision=1,
                cursor=0,
                settings={},
            )
            session.add(row)
            session.flush()
            write_state(session, self.kind, row, checked)
        return self.get(document_id)

    def duplicate(
        self, document_id: str, name: str | None = None, *, expected_revision: int | None = None
    ) -> Document[Content]:
        """Copy a document as it is now, without its history. Raises the kind's conflict at another revision."""
        with self._store.reading() as session:
            document = read_document(session, self.kind, document_id, expected_revision)
        if name is None:
            name = f"{document.name[: MAX_NAME - 7]} (copy)"
        return self.create(document.case_id, name, document.content)

    def rename(self, document_id: str, name: str, *, expected_revision: int | None = None) -> Document[Content]:
        """Give a document another name, a locked one too: the lock keeps its content, and that it is there."""
        check_name(name, f"{self.kind.noun}'s name")
        return self._change(document_id, expected_revision, name=name)

    def delete(self, document_id: str, *, expected_revision: int | None = None) -> Document[Content]:
        """Take a document off the lists; `restore` brings it back. Raises the kind's lock for a locked one."""
        return self._change(document_id, expected_revision, deleted_at=utc_now())

    def restore(self, document_id: str, *, expected_revision: int | None = None) -> Document[Content]:
        """Bring a deleted document back."""
        return self._change(document_id, expected_revision, deleted_at=None)

    def discard(self, document_id: str) -> None:
        """Remove a document and its history for good. Raises NotFound, and the kind's lock for a locked one."""
        with self._store.writing() as session:
            row = find_row(session, self.kind, document_id)
            if row.locked:
                raise self.kind.errors.locked(f"the {self.kind.noun} is locked; unlock it to remove it.")
            session.execute(delete(DocumentStateRow).where(DocumentStateRow.document_id == document_id))
            session.delete(row)
        with self._lock:
            self._editors.pop(document_id, None)

    def editor(self, document_id: str) -> DocumentEditor[Content]:
        """The document's editor, the same for every caller. Raises NotFound."""
        with self._lock:
            known = self._editors.get(document_id)
        if known is not None:
            return known
        with self._store.reading() as session:
            find_row(session, self.kind, document_id)
        with self._lock:
            return self._editors.setdefault(document_id, DocumentEditor(self._store, self.kind, document_id))

    def _change(self, document_id: str, expected_revision: int | None, **values: str | None) -> Document[Content]:
        with self._store.writing() as session:
            row = find_row(session, self.kind, document_id, expected_revision)
            if row.locked and values.get("deleted_at") is not None:
                raise self.kind.errors.locked(f"the {self.kind.noun} is locked; unlock it to delete it.")
            for name, value in values.items():
                setattr(row, name, value)
            touch(row)
            session.flush()
            return list_document(session, self.kind, row)

    def _listed(self, case_id: str | None, include_deleted: bool) -> Select[DocumentRow]:
        """Rows, oldest first."""
        query = select(DocumentRow).where(DocumentRow.kind == self.kind.name)
        query = query.order_by(DocumentRow.created, DocumentRow.id)
        if case_id is not None:
            query = query.where(DocumentRow.case_id == case_id)
        return query if include_deleted else query.where(DocumentRow.deleted_at.is_(None))
