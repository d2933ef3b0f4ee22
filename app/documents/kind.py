"""A kind of document: how its content is read, checked, written, and brought up from older schemas."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Generic, Protocol, TypeVar

import msgspec

from app.clock import utc_now
from app.documents.document import Content, Document, Ref
from app.kit.errors import DocumentConflict, DocumentLocked
from app.kit.names import printable
from vfix_engine.errors import InputError

SETTINGS = "settings"  # key of a content's JSON that is kept apart from the history
_MOST_UPGRADES = 100
_NEW_IN = "new_in"  # in `extra` of a field's type

Upgrade = Callable[[dict[str, Any]], dict[str, Any]]


def new_in(number: int) -> msgspec.Meta:
    """Of a field of a content, in the notes of its type: that schemas before this one do not have it.

    What such a schema's content has of it, once it is read, is the field's default.
    """
    return msgspec.Meta(extra={_NEW_IN: number})


Value = TypeVar("Value")


class Editable(Protocol):
    """What tells whether something may be edited: a document, or its row in the store."""

    @property
    def deleted_at(self) -> object: ...

    @property
    def locked(self) -> bool: ...


@dataclass(frozen=True)
class DocumentErrors:
    """What is raised for a kind: for an edit that cannot be done, another's change in between, and a lock."""

    refused: type[InputError] = InputError
    conflict: type[DocumentConflict] = DocumentConflict
    locked: type[DocumentLocked] = DocumentLocked


@dataclass(frozen=True)
class DocumentKind(Generic[Content]):
    """One kind of document.

    name: in the store, and the beginning of ids. noun: in messages. schema: of what `write` makes and `read` takes.
    empty: the content of a new document.
    read: content out of JSON, validated; it raises InputError. write: its inverse. The key 'settings' of that JSON,
        where a kind has it, is no step of the history: undo and redo leave it.
    check: the content of a new state, which may have to fulfil more than one that is read; it raises InputError.
    refs: what a content refers to.
    upgrades: by older schema, the next schema and what makes the older JSON into that one's.
    changes: what changed between two contents, in sentences.
    content_type: of its contents, where that is a `msgspec.Struct`.
    undo_hint: what a client does about a newest state that cannot be read; '{id}' is the document's.
    """

    name: str
    noun: str
    schema: str
    empty: Callable[[], Content]
    read: Callable[[Mapping[str, Any]], Content]
    write: Callable[[Content], dict[str, Any]]
    check: Callable[[Content], Content]
    refs: Callable[[Content], tuple[Ref, ...]] = lambda content: ()
    upgrades: Mapping[str, tuple[str, Upgrade]] = field(default_factory=dict)
    errors: DocumentErrors = DocumentErrors()
    changes: Callable[[Content, Content], tuple[str, ...]] = lambda before, after: ()
    undo_hint: str = "Take its newest edit back, or delete it."
    content_type: type[Any] = object

    @functools.cached_property
    def has_settings(self) -> bool:
        """Whether documents of this kind have settings."""
        return SETTINGS in self.write(self.empty())

    def draft(
        self, case_id: str, case_hash: str, name: str, content: Content, document_id: str = ""
    ) -> Document[Content]:
        """A document that is not stored; its revision is 0."""
        now = utc_now()
        return Document(
            id=document_id,
            kind=self.name,
            schema=self.schema,
            name=name,
            case_id=case_id,
            case_hash=case_hash,
            content=content,
            refs=self.refs(content),
            created=now,
            modified=now,
            revision=0,
            locked=False,
            deleted_at=None,
            can_undo=False,
            can_redo=False,
        )

    def check_editable(self, document: Editable, *, even_locked: bool = False) -> None:
        """Raises the kind's refusal for one that is deleted, and its lock for one that is locked."""
        if document.deleted_at is not None:
            raise self.errors.refused(f"the {self.noun} is deleted; restore it first.")
        if document.locked and not even_locked:
            raise self.errors.locked(f"the {self.noun} is locked; unlock it to change it.")

    def content(self, schema: str, stored: Any, settings: Any) -> Content:
        """The content out of a stored state. Raises InputError when it is damaged or of a newer schema."""
        if not isinstance(stored, dict):
            raise self.errors.refused(f"the content of the {self.noun} is no object.")
        data = {**stored, SETTINGS: settings} if self.has_settings else stored
        for _ in range(_MOST_UPGRADES):
            if schema == self.schema:
                return self.read(data)
            if schema not in self.upgrades:
                break
            schema, upgrade = self.upgrades[schema]
            data = upgrade(data)
        raise self.errors.refused(
            f"its schema {schema!r:.60} cannot be read; this vfix reads up to {self.schema!r}. Install a newer vfix."
        )


def read_as(of: type[Value], data: Any, refused: type[InputError] = InputError) -> Value:
    """A value out of JSON, by the types of the fields of a dataclass or struct; raises `refused`."""
    try:
        return msgspec.convert(data, of)
    except msgspec.ValidationError as error:
        raise refused(_words(error)) from error


def written(value: Any) -> Any:
    """The inverse of `read_as`: JSON values, every number unrounded; one that is not finite stays, for checks to see.

    Through MessagePack, which has such numbers: the JSON of msgspec has null, which reads as left open (HAZ-05).
    """
    return msgspec.msgpack.decode(msgspec.msgpack.encode(value, enc_hook=_number))


def struct_kind(
    content: type[Content],
    *,
    schema: str,
    changed: Mapping[int, Upgrade] | None = None,
    rules: Callable[[Content], Content] = lambda value: value,
    errors: DocumentErrors = DocumentErrors(),
    **declared: Any,
) -> DocumentKind[Content]:
    """A kind whose content is a `msgspec.Struct` or a dataclass: its types say how it is read and written.

    What is read says every field, and no other one. Whatever is stored was read back before, so that it can be read.
    schema: such as 'vfix-label/1', whose number grows with every field; content of an older one is read without the
    fields that are `new_in` a later one. changed: by the number of a schema, what else makes its JSON the next one's.
    rules: what types cannot say, such as that two names differ; it raises InputError. declared: what else a
    `DocumentKind` says.
    """
    added, (family, _, number) = _defaults(content), schema.rpartition("/")

    def read(data: Mapping[str, Any]) -> Content:
        value = read_as(content, data, errors.refused)
        try:
            _check_parts(data, value)
        except msgspec.ValidationError as error:
            raise errors.refused(_words(error)) from error
        return rules(value)

    def upgrade(before: int) -> Upgrade:
        change, new = (changed or {}).get(before, dict), added.get(before + 1, {})
        return lambda data: change({**data, **new})

    return DocumentKind(
        schema=schema,
        upgrades={f"{family}/{one}": (f"{family}/{one + 1}", upgrade(one)) for one in range(1, int(number))},
        content_type=content,
        read=read,
        write=written,
        check=lambda value: read(written(value)),
        errors=errors,
        **{"empty": content, **declared},
    )


def _defaults(content: type[Any]) -> dict[int, dict[str, Any]]:
    """The JSON of the fields that are `new_in` a schema, by its number, as they are where nothing is said."""
    shape = msgspec.inspect.type_info(content)
    assert isinstance(shape, (msgspec.inspect.DataclassType, msgspec.inspect.StructType))
    found: dict[int, dict[str, Any]] = {}
    for each in shape.fields:
        extra = (isinstance(each.type, msgspec.inspect.Metadata) and each.type.extra) or {}
        if _NEW_IN in extra:
            found.setdefault(extra[_NEW_IN], {})[each.name] = msgspec.to_builtins(each.default)
    return found


def _check_parts(data: Any, value: Any, at: str = "$") -> None:
    """Raises ValidationError for a number that is not finite, and for other keys of an object than its fields."""
    if isinstance(value, float):
        if not math.isfinite(value):
            raise msgspec.ValidationError(f"{value} is not a finite number - at `{at}`")
    elif isinstance(value, (tuple, list)):
        for index, (one, inner) in enumerate(zip(data, value, strict=True)):
            _check_parts(one, inner, f"{at}[{index}]")
    elif isinstance(value, Mapping):
        for name, inner in value.items():
            _check_parts(data[name], inner, f"{at}.{name}")
    elif is_dataclass(value) or isinstance(value, msgspec.Struct):
        names = {field.name for field in fields(value)} if is_dataclass(value) else {*value.__struct_fields__}
        if data.keys() != names:
            raise msgspec.ValidationError(f"An object has {', '.join(sorted(names))} - at `{at}`")
        for name in names:
            _check_parts(data[name], getattr(value, name), f"{at}.{name}")


def _words(error: msgspec.ValidationError) -> str:
    return printable(f"{error}").replace("`", "").rstrip(".") + "."


def _number(value: Any) -> Any:
    """A number of numpy as Python's."""
    return value.item()
