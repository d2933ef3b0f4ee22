"""The page's TypeScript declarations are those of the server's types."""

import importlib.util
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Annotated, Literal, NotRequired, TypedDict

import pytest
from pydantic import BaseModel

from app.messages import sections
from app.messages.version import VERSION
from app.session import commands
from app.session.commands import InvalidMessage

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    specification = importlib.util.spec_from_file_location("declarations", ROOT / "scripts" / "declarations.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_declarations_on_disk_are_those_of_the_types(script: ModuleType) -> None:
    assert script.TARGET.read_text(encoding="utf-8") == script.declarations(), "run scripts/declarations.py"


class Inner(TypedDict):
    """An inner one."""

    at: Annotated[list[float], sections.Length(2)] | None
    words: NotRequired[Literal["a", "b"]]


class Outer(Inner):
    many: list[Inner]
    mixed: list[int | str]
    by_name: dict[Literal["x", "y"], tuple[bool, int]]


def test_a_record_is_declared_with_what_it_refers_to(script: ModuleType) -> None:
    made = script.Declarations()
    assert made.of(Outer) == "Outer"
    assert made.text.split("\n\n") == [
        "export interface Outer {\n"
        "  at: [number, number] | null;\n"
        '  words?: "a" | "b";\n'
        "  many: Inner[];\n"
        "  mixed: (number | string)[];\n"
        '  by_name: Record<"x" | "y", [boolean, number]>;\n'
        "}",
        '/** An inner one. */\nexport interface Inner {\n  at: [number, number] | null;\n  words?: "a" | "b";\n}\n',
    ]


def test_what_may_be_left_out_of_a_request_is_optional_and_an_answer_has_all(script: ModuleType) -> None:
    class Wish(BaseModel):
        name: str
        unit: str | None = None

    class WishPublic(Wish):
        pass

    assert script.Declarations().body(script.fields_of(Wish)) == "{\n  name: string;\n  unit?: string | null;\n}"
    assert script.Declarations().body(script.fields_of(WishPublic)) == "{\n  name: string;\n  unit: string | null;\n}"


def test_a_type_that_json_cannot_have_is_refused(script: ModuleType) -> None:
    with pytest.raises(TypeError, match="no TypeScript type"):
        script.Declarations().of(set[int])


def test_two_records_of_one_name_are_refused(script: ModuleType) -> None:
    made = script.Declarations()
    made.of(Inner)
    with pytest.raises(TypeError, match="rename one of them"):
        made.of(TypedDict("Inner", {"other": int}))


def test_every_command_is_declared_with_its_own_fields(script: ModuleType) -> None:
    found = script.command_fields()
    for kind, fields in {
        "undo": ["revision"],
        "item.drag": ["item_id", "position"],
        "view.set": ["opacity", "cut", "slices", "skin", "skin_opacity"],
    }.items():
        assert list(found[kind]) == fields
    for kind in found:  # nothing is declared that the server does not know
        with pytest.raises(InvalidMessage) as refusal:
            commands.parse_command(json.dumps({"type": kind, "no_such_field": 1}))
        assert "does not match any of the expected tags" not in str(refusal.value), kind


def test_the_page_speaks_the_planner_s_version() -> None:
    text = (ROOT / "app" / "web" / "js" / "connection.js").read_text(encoding="utf-8")
    assert f"export const VERSION = {VERSION};" in text
