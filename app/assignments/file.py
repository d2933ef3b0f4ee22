"""Files of assignments: JSON from an instructor, read strictly."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from app.assignments.content import Assignment, Criteria, with_rules
from app.kit.errors import TooLarge
from app.kit.names import check_name, printable
from vfix_engine.errors import InputError
from vfix_engine.json_text import parse_json
from vfix_engine.runtime.control_mode import ControlMode

SCHEMA = "vfix-assignment/1"
MAX_BYTES = 64 << 10


class PlanOfFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A plan by its id, or by its name and that of its case."""

    id: str = ""
    name: str = ""
    case: str = ""


class AssignmentFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The keys of a file; docs/formats.md describes them."""

    schema: Literal["vfix-assignment/1"]
    name: str
    plan: PlanOfFile
    mode: ControlMode
    criteria: Criteria
    runs: Annotated[int, Meta(ge=1, le=100)] = 1
    preset: Literal["li2004", "li2007"] | None = None
    countdown: bool = False
    since: str = ""
    notice: str = ""

    def content(self, plan_id: str) -> Assignment:
        """As it is stored, of a plan that was found. Raises InputError."""
        told = {name: getattr(self, name) for name in ("mode", "criteria", "runs", "preset", "countdown", "since")}
        return with_rules(Assignment(plan_id=plan_id, **told))


def read_assignment(data: bytes) -> AssignmentFile:
    """Raises TooLarge, and InputError in words for everything that is no assignment."""
    if len(data) > MAX_BYTES:
        raise TooLarge(f"a file of an assignment has at most {MAX_BYTES:,} bytes; this one has {len(data):,}.")
    try:
        read = msgspec.convert(parse_json(data), AssignmentFile)
    except msgspec.ValidationError as error:
        raise InputError(f"this is no assignment: {_words(error)}.") from None
    except ValueError as error:
        raise InputError(f"this is no assignment: it cannot be read as JSON: {error}.") from None
    check_name(read.name, "assignment's name")
    plan = read.plan
    if bool(plan.id) == bool(plan.name) or bool(plan.name) != bool(plan.case):
        raise InputError("name the assignment's plan by 'id', or by 'name' and 'case'.")
    for text in (plan.id, plan.name, plan.case):
        if text:
            check_name(text, "name of the assignment's plan")
    read = msgspec.structs.replace(read, since=_since(read.since))
    read.content("p")
    return read


def _words(error: msgspec.ValidationError) -> str:
    text = printable(str(error))  # it repeats keys of the file, which a terminal would obey
    return text[:1].lower() + text[1:] if len(text) < 300 else "a value has the wrong type"


def _since(text: str) -> str:
    """An ISO time in UTC as runs have it; '' for none."""
    if not text:
        return ""
    try:
        at = datetime.fromisoformat(text)
        return (at if at.tzinfo else at.replace(tzinfo=UTC)).astimezone(UTC).isoformat(timespec="milliseconds")
    except (ValueError, OverflowError):  # the latter where UTC is before the year 1 or after 9999
        raise InputError("'since' is no time; write it as 2026-11-27 or 2026-11-27T10:00:00Z.") from None
