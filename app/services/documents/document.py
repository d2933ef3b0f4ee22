"""A document as a value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, Literal, TypeVar

Content = TypeVar("Content")


@dataclass(frozen=True)
class Ref:
    """What a document refers to, by id: a structure of its case, or another document."""

    kind: Literal["structure", "document"]
    id: str


@dataclass(frozen=True)
class Document(Generic[Content]):
    """A stored document. `revision` grows with every change; a deleted one carries the time it was deleted at.

    schema: that of its content in this version. case_hash: of the case's content when the document was made.
    can_undo, can_redo: whether there is an edit to take back, and one that was taken back; neither when it is locked.
    unreadable: in a list, why the content cannot be read; it is empty there then.
    told: of what an undo or redo returns, what it took back or did again, in words; '' otherwise.
    """

    id: str
    kind: str
    schema: str
    name: str
    case_id: str
    case_hash: str
    content: Content
    refs: tuple[Ref, ...]
    created: str
    modified: str
    revision: int
    locked: bool
    deleted_at: str | None
    can_undo: bool
    can_redo: bool
    unreadable: str = ""
    told: str = field(default="", compare=False)


@dataclass(frozen=True)
class DocumentTitle:
    """A line of a list of documents: all but the content."""

    id: str
    name: str
    case_id: str
    modified: str
    locked: bool
    deleted_at: str | None
