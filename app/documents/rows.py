"""Documents out of the rows of the store, and what every change of a row asks and does."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from app.clock import utc_now
from app.documents.document import Content, Document, DocumentTitle, Ref
from app.documents.kind import SETTINGS, DocumentKind
from app.kit.errors import NotFound
from app.store.database_errors import is_of_reading
from app.store.models import DocumentRow, DocumentStateRow
from vfix_engine.errors import InputError

_LOG = logging.getLogger(__name__)


def find_row(
    session: Session, kind: DocumentKind[Any], document_id: str, expected_revision: int | None = None
) -> DocumentRow:
    """The row of that id and kind. Raises NotFound, and the kind's conflict at another revision than the expected."""
    row = session.get(DocumentRow, document_id)
    if row is None or row.kind != kind.name:
        raise NotFound(f"there is no {kind.noun} {document_id!r:.80}.")
    if expected_revision is not None and row.revision != expected_revision:
        raise kind.errors.conflict(
            f"the {kind.noun} is at revision {row.revision}, not {expected_revision}; somebody else changed it."
        )
    return row


def read_document(
    session: Session, kind: DocumentKind[Content], document_id: str, expected_revision: int | None = None
) -> Document[Content]:
    """The document of that id, deleted or not.

    Raises NotFound, the kind's conflict at another revision than the expected, and InputError when its content cannot
    be read.
    """
    row = find_row(session, kind, document_id, expected_revision)
    return document_of(kind, row, content_of(session, kind, row), span_of(session, document_id))


def list_document(session: Session, kind: DocumentKind[Content], row: DocumentRow) -> Document[Content]:
    """The document of a row for a list: one whose content cannot be read says why and spoils nothing else."""
    span = span_of(session, row.id)
    try:
        return document_of(kind, row, content_of(session, kind, row), span)
    except InputError as error:
        return document_of(kind, row, kind.empty(), span, unreadable=str(error))


def title_of(row: DocumentRow) -> DocumentTitle:
    """What a list shows of a document."""
    return DocumentTitle(row.id, row.name, row.case_id, row.modified, row.locked, row.deleted_at)


def content_of(session: Session, kind: DocumentKind[Content], row: DocumentRow) -> Content:
    """The content of the current state. Raises InputError that names the document and says what to do."""
    try:
        return content_with(session, kind, row, {})
    except InputError as error:
        why, hint = str(error).rstrip("."), kind.undo_hint.replace("{id}", row.id)
        raise kind.errors.refused(f"the {kind.noun} {row.name!r} cannot be read: {why}. {hint}") from error


def content_with(
    session: Session, kind: DocumentKind[Content], row: DocumentRow, settings: Mapping[str, Any]
) -> Content:
    """The content of the current state with some settings changed. Raises InputError.

    Where the stored settings cannot be read these are all that it has, so that a document can be given new ones.
    """
    try:
        return _content(session, kind, row, lambda: {**row.settings, **settings})
    except InputError:
        if not settings or _is_readable(session, kind, row):
            raise
        content, document_id = _content(session, kind, row, lambda: settings), row.id
        _LOG.warning("The stored settings of %s cannot be read; new ones replace all of them.", document_id)
        return content


def _is_readable(session: Session, kind: DocumentKind[Any], row: DocumentRow) -> bool:
    try:
        _content(session, kind, row, lambda: row.settings)
    except InputError:
        return False
    return True


def _content(
    session: Session, kind: DocumentKind[Content], row: DocumentRow, settings: Callable[[], Mapping[str, Any]]
) -> Content:
    """settings: called where whatever it raises says that the document is damaged."""
    try:
        state = session.get(DocumentStateRow, (row.id, row.cursor))
        if state is None:
            raise kind.errors.refused("its content is missing from the store")
        return kind.content(state.schema, state.content, settings())
    except (ValueError, TypeError, RecursionError, DBAPIError) as error:
        if isinstance(error, DBAPIError) and not is_of_reading(error):
            raise
        raise kind.errors.refused("what is stored of it is damaged") from error


def write_state(session: Session, kind: DocumentKind[Content], row: DocumentRow, content: Content) -> None:
    """Put a content at the row's cursor; its settings go to the row."""
    data = kind.write(content)
    row.settings = data.pop(SETTINGS, {})
    refs = [{"kind": ref.kind, "id": ref.id} for ref in kind.refs(content)]
    session.add(DocumentStateRow(document_id=row.id, position=row.cursor, schema=kind.schema, refs=refs, content=data))


def touch(row: DocumentRow) -> None:
    """Count a change."""
    row.revision += 1
    row.modified = utc_now()


def span_of(session: Session, document_id: str) -> tuple[int, int]:
    """First and last position of the history."""
    positions = select(func.min(DocumentStateRow.position), func.max(DocumentStateRow.position))
    low, high = session.execute(positions.where(DocumentStateRow.document_id == document_id)).one()
    return int(low or 0), int(high or 0)  # (0, 0) where every state is missing


def document_of(
    kind: DocumentKind[Content], row: DocumentRow, content: Content, span: tuple[int, int], unreadable: str = ""
) -> Document[Content]:
    """The value of a row, its content and the positions between which undo and redo move it."""
    refs: tuple[Ref, ...] = () if unreadable else kind.refs(content)
    return Document(
        id=row.id,
        kind=row.kind,
        schema=kind.schema,
        name=row.name,
        case_id=row.case_id,
        case_hash=row.case_hash,
        content=content,
        refs=refs,
        created=row.created,
        modified=row.modified,
        revision=row.revision,
        locked=row.locked,
        deleted_at=row.deleted_at,
        can_undo=not row.locked and span[0] < row.cursor,
        can_redo=not row.locked and row.cursor < span[1],
        unreadable=unreadable,
    )
