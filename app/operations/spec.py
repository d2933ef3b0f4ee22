"""What a kind of document declares: its name on every way in, and its operations."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from app.documents import Document, DocumentKind
from app.operations.operation import Context, Operation
from app.operations.public import public_type, public_value


@dataclass(frozen=True)
class DocumentSpec:
    """A kind of document as it is met from outside, declared as ``SPEC`` by a module of `registry.DOCUMENTS`.

    path: of its addresses, such as 'labels' of /api/v1/labels. id: the name of its identifier in addresses and
    messages, such as 'label_id'. operations: in the order of the documentation, after those that list and show.
    service: the name among the planner's services of what its operations need; '' for its `Documents` alone.
    public: what REST answers, which `public_of` makes of the service and a document; by default the content's fields
    beside those of every document.
    """

    kind: DocumentKind[Any]
    path: str
    id: str
    operations: tuple[type[Operation], ...]
    service: str = ""
    public: type[Any] | None = None
    public_of: Callable[[Any, Document[Any]], Any] | None = None

    @functools.cached_property
    def answer(self) -> type[Any]:
        """The type of what REST answers."""
        return self.public or public_type(self.kind, f"{self.title}Public")

    def answer_of(self, service: Any, document: Document[Any]) -> Any:
        """What REST answers."""
        return public_value(self.answer, document) if self.public_of is None else self.public_of(service, document)

    def context(self, services: Any, expected: int | None = None) -> Context[Any, Any]:
        """Where its operations are done. services: the planner's. expected: the revision that the client has seen."""
        if not self.service:
            return Context(services.documents_of(self.kind), None, expected)
        service = getattr(services, self.service)
        return Context(service.documents, service, expected)

    @property
    def noun(self) -> str:
        """On the command line: 'LABEL'."""
        return self.title.upper()

    @property
    def title(self) -> str:
        """Of its schemas: 'Label'."""
        return titled(self.id)

    def addresses(self, operation: type[Operation]) -> tuple[tuple[str, str], ...]:
        """Method and path of an operation below /api/v1, '{id}' by its name."""
        lines = (operation.rest,) if isinstance(operation.rest, str) else operation.rest
        named = (line.replace("{path}", self.path).replace("{id}", f"{{{self.id}}}") for line in lines if line)
        return tuple((method, path) for method, path in (line.split(" ") for line in named))

    def message(self, operation: type[Operation]) -> str:
        """The type of an operation's message; '' for none."""
        return operation.message.replace("{name}", self.id.removesuffix("_id"))


def titled(id_name: str) -> str:
    """What an identifier is of, as in a name of a schema: 'Label' of 'label_id'."""
    return id_name.removesuffix("_id").title().replace("_", "")
