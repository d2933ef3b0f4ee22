"""Operations that every kind of document has; a kind lists them, or a subclass with another message or a verb."""

from __future__ import annotations

from typing import Any

from app.documents import Document
from app.operations.fields import Name
from app.operations.operation import Change, Context


class Rename(Change, frozen=True):
    """Give it another name."""

    rest = "PATCH /{path}/{id}"
    message = "{name}.rename"
    name: Name

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return context.documents.rename(document_id, self.name, expected_revision=context.expected)


class SetLocked(Change, frozen=True):
    """Lock it against edits, or unlock it; no step of the history."""

    rest = "PATCH /{path}/{id}"
    message = "{name}.lock"
    locked: bool

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return context.documents.editor(document_id).set_locked(self.locked, expected_revision=context.expected)


class SetDeleted(Change, frozen=True):
    """Take it off the lists, or restore it."""

    rest = "PATCH /{path}/{id}"
    deleted: bool

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return (Delete() if self.deleted else Restore()).run(context, document_id)


class Delete(Change, frozen=True):
    """Take it off the lists; it can be restored."""

    rest = "DELETE /{path}/{id}"
    message = "{name}.delete"

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return context.documents.delete(document_id, expected_revision=context.expected)


class Restore(Change, frozen=True):
    """Bring it back to the lists."""

    rest = "POST /{path}/{id}/restore"
    message = "{name}.restore"

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return context.documents.restore(document_id, expected_revision=context.expected)


class Undo(Change, frozen=True):
    """Take the newest edit back."""

    rest = "POST /{path}/{id}/undo"
    message = "{name}.undo"

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return context.documents.editor(document_id).undo(expected_revision=context.expected)


class Redo(Change, frozen=True):
    """Do again what was taken back."""

    rest = "POST /{path}/{id}/redo"
    message = "{name}.redo"

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        return context.documents.editor(document_id).redo(expected_revision=context.expected)


STANDARD = (Rename, SetLocked, SetDeleted, Delete, Restore, Undo, Redo)
