"""Tables of the store. Times are UTC in ISO 8601."""

from typing import Any

from sqlalchemy import JSON, ForeignKey, Index, Integer, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class Base(DeclarativeBase):
    """Base of every table."""


class CaseRow(Base):
    """A case: its import and its files."""

    __tablename__ = "cases"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    created: Mapped[str] = mapped_column(String(32))
    deleted_at: Mapped[str | None] = mapped_column(String(32))
    content_hash: Mapped[str] = mapped_column(String(64))
    # Deferred, so that a damaged value does not keep the rest of its row from being read or replaced.
    document: Mapped[dict[str, Any]] = mapped_column(JSON, deferred=True)


class DocumentRow(Base):
    """A document, such as a plan; its content is the state of its history at `cursor`."""

    __tablename__ = "documents"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    kind: Mapped[str] = mapped_column(String(32))
    case_id: Mapped[str] = mapped_column(ForeignKey("cases.id"), index=True)
    case_hash: Mapped[str] = mapped_column(String(64))
    name: Mapped[str] = mapped_column(Text)
    created: Mapped[str] = mapped_column(String(32))
    modified: Mapped[str] = mapped_column(String(32))
    deleted_at: Mapped[str | None] = mapped_column(String(32))
    locked: Mapped[bool] = mapped_column()
    revision: Mapped[int] = mapped_column(Integer)
    cursor: Mapped[int] = mapped_column(Integer)
    # Not part of the history: undo and redo do not change them. Deferred for the same reason as a case's document.
    settings: Mapped[dict[str, Any]] = mapped_column(JSON, deferred=True)


class DocumentStateRow(Base):
    """One state of a document's history; undo and redo move the document's cursor.

    schema: of `content`. refs: the structures and documents that it refers to.
    """

    __tablename__ = "document_states"

    document_id: Mapped[str] = mapped_column(ForeignKey("documents.id"), primary_key=True)
    position: Mapped[int] = mapped_column(Integer, primary_key=True)
    schema: Mapped[str] = mapped_column(String(40))
    refs: Mapped[list[dict[str, str]]] = mapped_column(JSON)
    content: Mapped[dict[str, Any]] = mapped_column(JSON)


class RunRow(Base):
    """A recorded drive: its manifest and its files."""

    __tablename__ = "runs"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    case_id: Mapped[str | None] = mapped_column(ForeignKey("cases.id"), index=True)
    plan_id: Mapped[str | None] = mapped_column(ForeignKey("documents.id"), index=True)
    recorded: Mapped[str] = mapped_column(String(32))
    size_bytes: Mapped[int] = mapped_column(Integer)
    manifest: Mapped[dict[str, Any]] = mapped_column(JSON)
    files: Mapped[dict[str, Any]] = mapped_column(JSON)


Index("documents_by_case_and_kind", DocumentRow.case_id, DocumentRow.kind)
