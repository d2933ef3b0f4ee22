"""Documents that a client has open, one of a kind: one tab opens and edits them, others use them."""

from __future__ import annotations

from collections.abc import Callable


class OpenedDocuments:
    """Ids by the kind of document. Owned by the session's thread."""

    def __init__(self) -> None:
        self._ids: dict[str, str] = {}
        self._listeners: list[tuple[str, Callable[[], None]]] = []

    def id(self, kind: str) -> str | None:
        """Of the document of a kind that is open; None where none is."""
        return self._ids.get(kind)

    def set(self, kind: str, document_id: str | None) -> None:
        """Another document of a kind is open, or none; listeners are called where it is another one."""
        if document_id == self.id(kind):
            return
        if document_id is None:
            del self._ids[kind]
        else:
            self._ids[kind] = document_id
        for wanted, listener in self._listeners:
            if wanted == kind:
                listener()

    def on_changed(self, kind: str, listener: Callable[[], None]) -> None:
        """Call ``listener`` when another document of a kind is open, or none."""
        self._listeners.append((kind, listener))
