"""Operations as verbs of the command line: actions of a verb, such as 'plan rename', or options of a listing."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, get_args, get_origin

import msgspec

from app.documents import Document
from app.operations.operation import Change, Operation, Option, Verb
from app.operations.reading import Unreadable, read
from app.operations.registry import specs
from app.operations.spec import DocumentSpec
from vfix_engine.errors import InputError

Asked = TypeVar("Asked", bound=Operation)
Actions: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


@dataclass(frozen=True)
class Called:
    """An operation that a command line asks for.

    target: id or name of the document; '' where one is made, or where none is said.
    """

    spec: DocumentSpec
    operation: Operation
    target: str

    def perform(self, services: Any, case_id: str, find: Callable[[str], str]) -> Document[Any]:
        """Do it. find: the id of a document by its id or name. Raises VfixError."""
        document_id = find(self.target) if isinstance(self.operation, Change) else ""
        return self.operation.perform(self.spec.context(services), case_id, document_id)


@dataclass(frozen=True)
class _Offer:
    """A way to call an operation. name: of its action, or of its option with the dashes."""

    spec: DocumentSpec
    operation: type[Operation]
    verb: Verb
    name: str

    @property
    def dest(self) -> str:
        """Where argparse puts the words of an option."""
        return self.name.lstrip("-").replace("-", "_")

    @property
    def help(self) -> str:
        """What it does: of several sentences the first, as argparse's own helps are written."""
        if self.verb.help:
            return self.verb.help
        first = inspect.cleandoc(self.operation.__doc__ or "").split("\n\n")[0].split(". ")[0].rstrip(".")
        return first[:1].lower() + first[1:]

    @property
    def words(self) -> list[str]:
        """What has to be said, in order: the document, and each field that is needed."""
        target = [self.spec.noun] if self.has_target else []
        return [*target, *(_metavar(field) for field in self.needed)]

    @property
    def has_target(self) -> bool:
        """Whether the first word is the document."""
        return issubclass(self.operation, Change) and not self.verb.of_case

    @property
    def needed(self) -> list[msgspec.structs.FieldInfo]:
        """Fields that have to be said."""
        said = {*self.verb.preset, *(option.field for option in self.verb.options)}
        return [field for field in msgspec.structs.fields(self.operation) if field.required and field.name not in said]

    def called(self, args: argparse.Namespace, words: Sequence[str]) -> Called:
        """The operation out of its words and options. Raises InputError."""
        if len(words) < len(self.words):
            raise InputError(f"{self.name} needs {' '.join(self.words)}.")
        target, rest = (words[0], words[1:]) if self.has_target else ("", words)
        if self.verb.of_case:
            target = getattr(args, self.spec.title.lower()) or ""
        values = dict(self.verb.preset)
        for index, field in enumerate(self.needed):
            read_word = _place if _is_place(_item(field.type) or field.type) else str
            values[field.name] = [*map(read_word, rest[index:])] if _item(field.type) else read_word(rest[index])
        for option in self.verb.options:
            if (value := getattr(args, option.field)) is not None:
                values[option.field] = value
        return Called(self.spec, asked(self.operation, **values), target)


def asked(operation: type[Asked], **values: Any) -> Asked:
    """The operation with what a command line says of its fields. Raises InputError."""
    try:
        return read(operation, values, strict=False)
    except Unreadable as error:
        raise InputError(f"{str(error).rstrip('.')}.") from None


def add_actions(line: str, actions: Actions) -> dict[str, argparse.ArgumentParser]:
    """The operations whose verbs are actions of a line, such as 'plan', each with what has to and may be said."""
    found: dict[str, argparse.ArgumentParser] = {}
    for offer in _offers(line, options=False):
        parser = found[offer.name] = actions.add_parser(offer.name, help=offer.help)
        if offer.has_target:
            parser.add_argument("target", metavar=offer.spec.noun, help="id or name")
        else:
            parser.add_argument("case", metavar="CASE", help="id or name of the case")
        if offer.verb.of_case:
            noun = offer.spec.title.lower()
            parser.add_argument(f"--{noun}", metavar="NAME", help="id or name; else the newest of the case")
        for field in offer.needed:
            many = "+" if _item(field.type) else None
            parser.add_argument(field.name, metavar=_metavar(field), nargs=many, help=_description(field.type))
        for option in offer.verb.options:
            add_option(parser, option, _words_of(offer.operation, option))
    return found


def groups(line: str) -> list[str]:
    """Words after a line, such as 'route', of which operations are actions in turn, such as 'route contour add'."""
    every = (verb.line.split(" ") for spec in specs() for operation in spec.operations for verb in _verbs(operation))
    return sorted({words[-2] for words in every if " ".join(words[:-2]) == line and not words[-1].startswith("--")})


def called_action(line: str, args: argparse.Namespace) -> Called | None:
    """The operation that an action of a line is, if it is one. Raises InputError."""
    offer = next((offer for offer in _offers(line, options=False) if offer.name == args.action), None)
    if offer is None:
        return None
    words = [args.target] if offer.has_target else []
    for field in offer.needed:
        value = getattr(args, field.name)
        words += value if isinstance(value, list) else [value]
    return offer.called(args, words)


def add_options(line: str, parser: argparse.ArgumentParser, group: argparse._MutuallyExclusiveGroup) -> None:
    """The operations whose verbs are options of a line, such as 'case labels', and what may be said with them."""
    options: dict[str, Option] = {}
    for offer in _offers(line, options=True):
        many = any(_item(field.type) for field in offer.needed)
        words, count = offer.words, len(offer.words)
        nargs: int | str | None = "+" if many else None if count == 1 else count
        group.add_argument(
            offer.name, dest=offer.dest, nargs=nargs, metavar=" ".join(words) if many or count == 1 else tuple(words),
            help=offer.help,
        )  # fmt: skip
        options |= {option.flag: option for option in offer.verb.options}
    for option in options.values():
        add_option(parser, option)


def add_option(parser: argparse.ArgumentParser, option: Option, choices: Sequence[str] = ()) -> None:
    """One field that may be left out. choices: the words that it may be; () for any."""
    parser.add_argument(
        option.flag, dest=option.field, metavar=option.metavar or None, help=option.help, default=option.default,
        type=str if option.default is None else type(option.default), choices=choices or None,
    )  # fmt: skip


def called_option(line: str, args: argparse.Namespace) -> Called | None:
    """The operation that the options of a line ask for, if any. Raises InputError."""
    offers = list(_offers(line, options=True))
    found = next((offer for offer in offers if getattr(args, offer.dest, None)), None)
    allowed = [] if found is None else [option.flag for option in found.verb.options]
    for offer in offers:
        for option in offer.verb.options:
            if option.default is None and getattr(args, option.field) is not None and option.flag not in allowed:
                raise InputError(f"{option.flag} goes with {offer.name}.")
    if found is None:
        return None
    words = getattr(args, found.dest)
    return found.called(args, [words] if isinstance(words, str) else words)


def lines() -> dict[str, list[DocumentSpec]]:
    """The first words of all verbs of operations, each with the kinds that have some."""
    found: dict[str, list[DocumentSpec]] = {}
    for spec in specs():
        for operation in spec.operations:
            for verb in _verbs(operation):
                kinds = found.setdefault(verb.line.split(" ")[0], [])
                if spec not in kinds:
                    kinds.append(spec)
    return found


def _verbs(operation: type[Operation]) -> tuple[Verb, ...]:
    declared = operation.verb
    if isinstance(declared, str):
        return (Verb(declared),) if declared else ()
    return declared


def _offers(line: str, options: bool) -> Iterator[_Offer]:
    """The operations that are called below a line, by an option of it or by an action."""
    for spec in specs():
        for operation in spec.operations:
            for verb in _verbs(operation):
                before, _, name = verb.line.rpartition(" ")
                if before == line and name.startswith("--") == options:
                    yield _Offer(spec, operation, verb, name)


def _words_of(operation: type[Operation], option: Option) -> tuple[str, ...]:
    """The words that a field may be, where its type names them."""
    kind = next(field.type for field in msgspec.structs.fields(operation) if field.name == option.field)
    kinds = (kind, *get_args(kind))
    return next((get_args(one) for one in kinds if get_origin(one) is Literal), ())


def _metavar(field: msgspec.structs.FieldInfo) -> str:
    return "X,Y,Z" if _is_place(_item(field.type) or field.type) else field.name.upper()


def _description(kind: Any) -> str:
    """What a field is, where its type says so."""
    notes = get_args(kind)[1:] if get_origin(kind) is Annotated else ()
    return next((note.description for note in notes if isinstance(note, msgspec.Meta) and note.description), "")


def _item(kind: Any) -> Any:
    """The type of each of a list, however long it is; None of anything else."""
    kind = _bare(kind)
    several = get_origin(kind) is list or (get_origin(kind) is tuple and get_args(kind)[1:] == (...,))
    return get_args(kind)[0] if several else None


def _is_place(kind: Any) -> bool:
    """Whether it is three numbers."""
    kind = _bare(kind)
    numbers = get_args(kind) if get_origin(kind) is tuple else ()
    return len(numbers) == 3 and all(_bare(number) is float for number in numbers)


def _bare(kind: Any) -> Any:
    """A type without its notes."""
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _place(text: str) -> list[float]:
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"{text!r:.60} is not a place: three numbers in mm, separated by commas") from None
    return [x, y, z]
