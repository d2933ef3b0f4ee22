"""What REST answers of a document: what all have, and the fields of its content."""

from __future__ import annotations

from typing import Any

import msgspec

from app.documents import Document, DocumentKind


class DocumentPublic(msgspec.Struct, frozen=True, kw_only=True):
    """What every document has. unreadable: in a list, why its content cannot be read; '' where it can."""

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


def common_values(document: Document[Any]) -> dict[str, Any]:
    """The values of the fields of `DocumentPublic`."""
    return {name: getattr(document, name) for name in DocumentPublic.__struct_fields__}


def public_type(kind: DocumentKind[Any], name: str) -> type[msgspec.Struct]:
    """What is answered of a kind whose content is a struct: its fields beside those of every document."""
    fields = [(field.name, field.type) for field in msgspec.structs.fields(kind.content_type)]
    return msgspec.defstruct(name, fields, bases=(DocumentPublic,), frozen=True, kw_only=True)


def public_value(public: type[msgspec.Struct], document: Document[Any]) -> msgspec.Struct:
    """A document as `public_type` has it."""
    return public(**common_values(document), **msgspec.structs.asdict(document.content))
