"""What is done to a document, as a value: its fields are what a client says, its class says where it is heard."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Generic, TypeVar

import msgspec

from app.documents import Document
from app.documents.documents import Documents

Content = TypeVar("Content")
Service = TypeVar("Service")


@dataclass(frozen=True)
class Context(Generic[Content, Service]):
    """Where an operation is done.

    documents: of its kind. service: what else its kind needs, as its `DocumentSpec` names it.
    expected: the revision that the client has seen; at another one the kind's conflict is raised and nothing changes.
    document_id: of the one that is edited.
    """

    documents: Documents[Content]
    service: Service
    expected: int | None = None
    document_id: str = ""

    @property
    def case_id(self) -> str:
        """Of the document."""
        return self.documents.title(self.document_id).case_id


class Operation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base class. The docstring is the help text: its first sentence on the command line, all of it in REST.

    title: its name for people, in the palette; '' for that of the class, 'Rename plan' of RenamePlan.
    rest: method and address below /api/v1, or several; '{id}' is the document's. A field that an address names is read
    from there. Operations of one address are told apart by the keys of their bodies: one of them is done per request.
    status: of the answer. message: its type on the WebSocket. aliases: names of fields there that differ, '' of
    one that is not said there; 'fle.mm' of the field `mm` of the field `fle`, whose fields stand there on their own.
    of_open: the message names no document, it is about the one that the client has open.
    answers: what REST answers with instead of the document, see `answer`.
    verb: on the command line, such as 'plan rename' or, as an option of a listing, 'case labels --undo'; or several,
    each a `Verb`. An empty one leaves that way out.
    """

    title: ClassVar[str] = ""
    rest: ClassVar[str | tuple[str, ...]] = ""
    status: ClassVar[int] = 200
    message: ClassVar[str] = ""
    aliases: ClassVar[Mapping[str, str]] = {}
    of_open: ClassVar[bool] = False
    verb: ClassVar[str | tuple[Verb, ...]] = ""
    answers: ClassVar[type[Any] | None] = None

    def perform(self, context: Context[Any, Any], case_id: str, document_id: str) -> Document[Any]:
        """Do it: in a case where it makes a document, else to the document. Raises VfixError."""
        raise NotImplementedError

    def answer(self, context: Context[Any, Any], document: Document[Any]) -> Any:
        """What REST answers where that is not the document, of the type `answers`."""
        raise NotImplementedError


@dataclass(frozen=True)
class Option:
    """A field of an operation that may be left out on the command line. metavar: '' for the flag's own name."""

    flag: str
    field: str
    metavar: str
    help: str
    default: Any = None


@dataclass(frozen=True)
class Verb:
    """A way to call an operation on the command line. Fields that are needed follow as words, in their order.

    help: '' for the docstring's first sentence. preset: fields that it says by itself. options: those that may be said.
    of_case: the document is said by its case and by an option, such as --registration, without which the command
    chooses one; else it is the first word.
    """

    line: str
    help: str = ""
    preset: Mapping[str, Any] = field(default_factory=dict)
    options: tuple[Option, ...] = ()
    of_case: bool = False


class Creation(Operation, frozen=True):
    """Makes a document of a case."""

    status: ClassVar[int] = 201

    def perform(self, context: Context[Any, Any], case_id: str, document_id: str) -> Document[Any]:
        return self.create(context, case_id)

    def create(self, context: Context[Any, Any], case_id: str) -> Document[Any]:
        """The document that was made. Raises VfixError."""
        raise NotImplementedError


class Change(Operation, frozen=True):
    """Changes a document."""

    def perform(self, context: Context[Any, Any], case_id: str, document_id: str) -> Document[Any]:
        return self.run(context, document_id)

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        """The document as it is afterwards; stored before this returns. Raises VfixError."""
        raise NotImplementedError


class Edit(Change, frozen=True):
    """Changes the content of a document: one step of its history, which undo takes back."""

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        editor, here = context.documents.editor(document_id), replace(context, document_id=document_id)
        return editor.edit(lambda content: self.apply(content, here), expected_revision=context.expected)

    def apply(self, content: Any, context: Context[Any, Any]) -> Any:
        """The content after it. Raises VfixError where that cannot be."""
        raise NotImplementedError
