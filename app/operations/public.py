"""What REST answers of a document: what all have, and the fields of its content."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, make_dataclass
from typing import Any, TypeVar, get_type_hints

import msgspec

from app.documents import Document, DocumentKind

Public = TypeVar("Public")


@dataclass(frozen=True, kw_only=True)
class DocumentPublic:
    """What every document has. unreadable: in a list, why its content cannot be read; '' where it can.

    A dataclass, so that a route that is written by hand may answer it too.
    """

    id: str
    name: str
    case_id: str
    created: str
    modified: str
    revision: int
    locked: bool
    deleted_at: str | None
    can_undo: bool
    can_redo: bool
    unreadable: str


def with_content(content: type[Any]) -> Callable[[type[Public]], type[Public]]:
    """A decorator below `dataclass`: the class has the fields of a content too, where it does not declare its own."""

    def added(public: type[Public]) -> type[Public]:
        declared = public.__annotations__
        public.__annotations__ = {**get_type_hints(content, include_extras=True), **declared}
        return public

    return added


def common_values(document: Document[Any]) -> dict[str, Any]:
    """The values of the fields of `DocumentPublic`."""
    return {field.name: getattr(document, field.name) for field in fields(DocumentPublic)}


def public_type(kind: DocumentKind[Any], name: str) -> type[Any]:
    """What is answered of a kind whose content is a struct: its fields beside those of every document."""
    own = [(field.name, field.type) for field in msgspec.structs.fields(kind.content_type)]
    return make_dataclass(name, own, bases=(DocumentPublic,), frozen=True, kw_only=True)


def public_value(public: type[Any], document: Document[Any]) -> Any:
    """A document as `public_type` has it."""
    return public(**common_values(document), **msgspec.structs.asdict(document.content))
