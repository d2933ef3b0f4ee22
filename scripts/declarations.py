"""Write the page's TypeScript declarations from the server's types.

    .venv/bin/python scripts/declarations.py

`app/web/js/types.d.ts` declares the sections of the view model, the commands, the messages and the REST models that the
page reads. Run it after changing the sections.py or commands.py of a tab, those shared by all tabs (app/workspace,
app/session, app/messages), or the models below, and commit the result; a test compares the file with the output of this
script.
"""

import collections.abc
import inspect
import sys
import types
import typing
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NotRequired, Union, get_args, get_origin

from msgspec import NODEFAULT
from pydantic import BaseModel

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from app.api.assignments import AssignmentOpened, ResultsPublic  # noqa: E402
from app.api.dependencies import ErrorPublic  # noqa: E402
from app.api.jobs import ImportAnswer, JobPublic  # noqa: E402
from app.api.lumen_scores import LumenScorePublic, LumenSeriesPublic  # noqa: E402
from app.api.plan_models import OwnRobotPublic  # noqa: E402
from app.api.registration_models import PlanRegistrationPublic  # noqa: E402
from app.api.run_scores import ScorePublic, SeriesPublic  # noqa: E402
from app.api.runs import RunTitle  # noqa: E402
from app.api.suggestions import SuggestionPublic, ToolTablePublic  # noqa: E402
from app.api.tracing import TracedPublic  # noqa: E402
from app.messages import sections  # noqa: E402
from app.messages.hello import Hello  # noqa: E402
from app.operations.messages import messages  # noqa: E402
from app.plans.public import PlanPublic  # noqa: E402
from app.registration.public import RegistrationPublic  # noqa: E402
from app.session import commands  # noqa: E402
from app.session.sections import SessionSections  # noqa: E402
from app.tabs.registry import specs  # noqa: E402
from app.workspace.sections import ANSWERS, CaseSections  # noqa: E402

TARGET = ROOT / "app" / "web" / "js" / "types.d.ts"
HEADER = "// Made by scripts/declarations.py from the server's types; do not edit.\n"
REST_MODELS = (
    JobPublic,
    ErrorPublic,
    ImportAnswer,
    OwnRobotPublic,
    PlanPublic,
    SuggestionPublic,
    ToolTablePublic,
    RegistrationPublic,
    PlanRegistrationPublic,
    TracedPublic,
    RunTitle,
    ScorePublic,
    SeriesPublic,
    LumenScorePublic,
    LumenSeriesPublic,
    AssignmentOpened,
    ResultsPublic,
)
MESSAGES = (Hello, sections.HelloMessage, sections.NoteMessage, sections.ReplyMessage)
PLAIN = {
    str: "string",
    int: "number",
    float: "number",
    bool: "boolean",
    type(None): "null",
    Any: "unknown",
    object: "unknown",
}


class Declarations:
    """Interfaces by name, in the order in which they are first needed."""

    def __init__(self) -> None:
        self._known: dict[str, type] = {}
        self._texts: dict[str, str] = {}

    @property
    def text(self) -> str:
        """Return all interfaces, separated by empty lines."""
        return "\n".join(self._texts.values())

    def name_of(self, record: type) -> str:
        """Declare a TypedDict or model and all types that it refers to, once, and return its name.

        Raises TypeError for two types of the same name.
        """
        name = record.__name__
        if self._known.setdefault(name, record) is not record:
            raise TypeError(f"{record} and {self._known[name]} would have one name on the page; rename one of them.")
        if name not in self._texts:
            self._texts[name] = ""  # reserves its place; types that it refers to follow and may refer to it
            self._texts[name] = f"{comment(record)}export interface {name} {self.body(fields_of(record))}\n"
        return name

    def body(self, fields: "dict[str, tuple[Any, bool]]", indent: str = "  ") -> str:
        """Return `{ … }` for fields by name, each with its type and whether it is required."""
        if not fields:
            return "{}"
        lines = [
            f"{indent}{name}{'' if always else '?'}: {self.of(kind)};\n" for name, (kind, always) in fields.items()
        ]
        return "{\n" + "".join(lines) + indent[2:] + "}"

    def of(self, kind: Any) -> str:
        """Return the TypeScript type of a Python type. Raises TypeError if there is none."""
        if kind in PLAIN:
            return PLAIN[kind]
        if typing.is_typeddict(kind) or is_dataclass(kind) or (inspect.isclass(kind) and issubclass(kind, BaseModel)):
            return self.name_of(kind)
        origin, arguments = get_origin(kind), get_args(kind)
        if origin is Annotated:
            length = next((note.count for note in arguments[1:] if isinstance(note, sections.Length)), None)
            if length is None:
                return self.of(arguments[0])
            return f"[{', '.join([self.of(get_args(arguments[0])[0])] * length)}]"
        if origin is Literal:
            return " | ".join(f'"{value}"' if isinstance(value, str) else str(value).lower() for value in arguments)
        if origin in (Union, types.UnionType):
            return " | ".join(dict.fromkeys(self.of(argument) for argument in arguments))
        if origin is tuple and Ellipsis not in arguments:
            return f"[{', '.join(self.of(argument) for argument in arguments)}]"
        if origin in (list, tuple):
            entry = self.of(arguments[0])
            return f"({entry})[]" if " | " in entry else f"{entry}[]"
        if origin in (dict, collections.abc.Mapping):
            key = self.of(arguments[0])
            return f"Record<{key}, {self.of(arguments[1])}>"
        raise TypeError(f"{kind} has no TypeScript type; see scripts/declarations.py.")


def fields_of(record: type) -> "dict[str, tuple[Any, bool]]":
    """Return the type of every field of a TypedDict or model by its JSON name, and whether it is required."""
    hints = typing.get_type_hints(record, include_extras=True)
    if typing.is_typeddict(record):
        always = record.__required_keys__  # which do not know NotRequired in annotations that are text
        return {
            name: (_bare(kind), name in always and get_origin(kind) is not NotRequired) for name, kind in hints.items()
        }
    if is_dataclass(record):
        return {name: (hints[name], True) for name in record.__dataclass_fields__}
    # A received model has every field; a sent one may omit fields with defaults.
    read = record.__name__.endswith(("Public", "Words"))
    fields = record.model_fields
    return {field.alias or name: (hints[name], read or field.is_required()) for name, field in fields.items()}


def _bare(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is NotRequired else kind


def comment(record: type) -> str:
    """Return the docstring as a comment."""
    lines = inspect.cleandoc(record.__doc__ or "").splitlines()
    if not lines or record.__doc__ == BaseModel.__doc__:
        return ""
    if len(lines) == 1:
        return f"/** {lines[0]} */\n"
    return "/**\n" + "".join(f" * {line}".rstrip() + "\n" for line in lines) + " */\n"


def command_fields() -> "dict[str, dict[str, tuple[Any, bool]]]":
    """Return the fields of every command by its type, without `type` and `id`."""
    found = {}
    for model in commands.commands():
        fields = fields_of(model)
        kinds, _ = fields.pop("type")
        fields.pop("id")
        found |= dict.fromkeys(get_args(kinds), fields)
    for message in messages().values():
        fields = {name: (kind, default is NODEFAULT) for name, (kind, default) in message.fields().items()}
        found[message.kind] = {**fields, "revision": (int | None, False)}
    return dict(sorted(found.items()))


def widest(name: str, kinds: "list[Any]") -> Any:
    """Return the one of several types of a section that has all fields of the others, its own ones optional.

    Raises TypeError if there is none.
    """
    for kind in kinds:
        if all(other == kind or (typing.is_typeddict(other) and extends(kind, other)) for other in kinds):
            return kind
    raise TypeError(f"the section {name} is published as {' and as '.join(sorted({str(kind) for kind in kinds}))}.")


def extends(kind: Any, other: type) -> bool:
    """Whether a TypedDict has every field of another one, and beside these only optional ones."""
    if not typing.is_typeddict(kind):
        return False
    own, needed = fields_of(kind), fields_of(other)
    return all(own.get(field) == value for field, value in needed.items()) and not any(
        always for field, (_, always) in own.items() if field not in needed
    )


def declarations() -> str:
    """Return the whole file."""
    made = Declarations()
    state: dict[str, list[Any]] = {}
    groups = (SessionSections, CaseSections, *(spec.sections for spec in specs() if spec.sections is not None))
    for group in groups:
        for name, (kind, _) in fields_of(group).items():
            state.setdefault(name, []).append(kind)
    sections_by_name = {name: made.of(widest(name, kinds)) for name, kinds in state.items()}
    for record in (*MESSAGES, *REST_MODELS):
        made.of(record)
    view = "".join(f"  {name}?: {kind};\n" for name, kind in sorted(sections_by_name.items()))
    sent = "".join(f'  "{kind}": {made.body(fields, "    ")};\n' for kind, fields in command_fields().items())
    answers = "".join(f'  "{name}": {made.of(record)};\n' for name, record in ANSWERS.items())
    parts = [
        HEADER,
        made.text,
        "/** What the server has said so far, by section; a section that it has not sent yet is undefined. */\n"
        f"export interface ViewModel {{\n{view}}}\n",
        STATE_MESSAGE,
        f"/** Fields of each command besides its type. */\nexport interface Commands {{\n{sent}}}\n",
        f"/** Answers to commands; any other command is answered null. */\nexport interface Answers {{\n{answers}}}\n",
        CALLS,
    ]
    return "\n".join(parts)


STATE_MESSAGE = """\
/** Sections that changed, by name. */
export interface StateMessage {
  type: "state";
  sections: ViewModel;
}

export type Message = HelloMessage | StateMessage | ReplyMessage | NoteMessage;
"""
# A command without required fields is sent by its name alone.
CALLS = """\
export type CommandType = keyof Commands;
export type Fields<T extends CommandType> = {} extends Commands[T] ? [fields?: Commands[T]] : [fields: Commands[T]];
export type Answer<T extends CommandType> = T extends keyof Answers ? Answers[T] : null;
"""


def main() -> int:
    """Write the file."""
    TARGET.write_text(declarations(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
