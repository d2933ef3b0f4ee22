"""Operations as messages of the WebSocket."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin

import msgspec

from app.documents import Document
from app.operations import registry, standard
from app.operations.bodies import Field, fields_of, keys_of, read_operations
from app.operations.fields import STRIPPED, Identifier, Revision
from app.operations.operation import Change, Context, Operation
from app.operations.reading import read
from app.operations.schema import object_schema
from app.operations.spec import DocumentSpec


class _Envelope(msgspec.Struct, frozen=True):
    """What every message may say. id: asks for a reply. revision: that the client has seen."""

    id: Revision | None = None
    revision: Revision | None = None


@dataclass(frozen=True)
class OperationMessage:
    """What a client asks to be done to a document.

    target: its id; '' where it is the one that the client has open, or is to be made.
    """

    type: str
    spec: DocumentSpec
    operations: tuple[Operation, ...]
    target: str = ""
    revision: int | None = None
    id: int | None = None
    urgent: ClassVar[bool] = False

    def stream(self) -> None:
        """None is left out for a newer one."""

    def perform(self, context: Context[Any, Any], case_id: str, open_id: str = "") -> Document[Any] | None:
        """Do it in the open case, to the open document where it names none; returns that. Raises VfixError."""
        document = None
        for operation in self.operations:
            document = operation.perform(context, case_id, self.target or open_id)
        return document


@dataclass(frozen=True)
class MessageSpec:
    """The operations of one kind of message, its `type`; of several each is done whose fields are there."""

    kind: str
    spec: DocumentSpec
    operations: tuple[type[Operation], ...]

    @property
    def target(self) -> str:
        """The field that names the document; '' where none does."""
        first = self.operations[0]
        return self.spec.id if issubclass(first, Change) and not first.of_open else ""

    @property
    def title(self) -> str:
        """The name of what it does, for people."""
        first = self.operations[0]
        words = re.findall("[A-Z][a-z]*", first.__name__)
        title = first.title or " ".join([words[0], *(word.lower() for word in words[1:])])
        return f"{title} {self.spec.kind.noun}" if first.__module__ == standard.__name__ else title

    def fields(self) -> dict[str, Field]:
        """Each field besides those of every message."""
        target: dict[str, Field] = {self.target: (Identifier, msgspec.NODEFAULT)} if self.target else {}
        return target | fields_of(self.operations, _keys)

    @functools.cached_property
    def names(self) -> frozenset[str]:
        """The fields that are names, which a hand types: blanks around them are taken off."""
        return frozenset(key for key, (kind, _) in self.fields().items() if _is_name(kind))

    def schema(self) -> dict[str, Any]:
        """Its JSON schema."""
        every: dict[str, Field] = {"type": (Literal[self.kind], msgspec.NODEFAULT)}
        return object_schema(
            every | self.fields() | {"id": (Revision | None, None), "revision": (Revision | None, None)}
        )[0]

    def read(self, message: Mapping[str, Any]) -> OperationMessage:
        """The message. Raises Unreadable."""
        said = dict(message)
        del said["type"]
        envelope = read(_Envelope, {key: said.pop(key) for key in ("id", "revision") if key in said})
        target = read(Identifier, said.pop(self.target, None), (self.target,)) if self.target else ""
        said |= {key: said[key].strip() for key in self.names & said.keys() if isinstance(said[key], str)}
        operations = read_operations(self.operations, said, keys=_keys)
        return OperationMessage(self.kind, self.spec, tuple(operations), target, envelope.revision, envelope.id)


def messages() -> dict[str, MessageSpec]:
    """Every message that does an operation, by its type."""
    return _messages(tuple(registry.DOCUMENTS))


@functools.cache
def _messages(documents: tuple[str, ...]) -> dict[str, MessageSpec]:
    del documents
    found: dict[str, tuple[DocumentSpec, list[type[Operation]]]] = {}
    for spec in registry.specs():
        for operation in spec.operations:
            if operation.message:
                found.setdefault(spec.message(operation), (spec, []))[1].append(operation)
    return {kind: MessageSpec(kind, spec, tuple(operations)) for kind, (spec, operations) in sorted(found.items())}


def read_message(message: Mapping[str, Any]) -> OperationMessage | None:
    """The operation that a message asks for; None where it is of another kind. Raises Unreadable."""
    kind = message.get("type")
    found = messages().get(kind) if isinstance(kind, str) else None
    return None if found is None else found.read(message)


@functools.cache
def _keys(operation: type[Operation]) -> Mapping[str, str]:
    """A field has its alias, or what is within it has one, such as 'fle.mm'; one with an empty alias is not said."""
    aliases, found = operation.aliases, dict[str, str]()
    for name in keys_of(operation):
        inner = [other for other in aliases if other.startswith(f"{name}.")]
        found |= {key: other for other in inner or [name] if (key := aliases.get(other, other))}
    return found


def _is_name(kind: Any) -> bool:
    if get_origin(kind) is Annotated:
        return any(isinstance(note, msgspec.Meta) and (note.extra or {}).get(STRIPPED) for note in get_args(kind)[1:])
    return any(_is_name(inner) for inner in get_args(kind))
