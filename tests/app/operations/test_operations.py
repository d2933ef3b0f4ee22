"""Every operation that is declared: hostile bodies are refused by its types, over REST and as a message (HAZ-05)."""

from __future__ import annotations

import json
import re
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
import pytest
from fastapi import FastAPI
from rest_client import Client

from app.api import router
from app.gateway.error_answers import install_error_answers
from app.kit.names import MAX_TEXT, check_text
from app.operations import specs
from app.operations.bodies import fields_of
from app.operations.fields import Text
from app.operations.messages import MessageSpec, messages
from app.operations.operation import Operation
from app.operations.reading import Unreadable, read
from app.operations.rest import addresses
from app.registration.operations import FleRequest, SetFle, TouchPair
from app.session.commands import InvalidMessage, parse_command
from app.studies.content import MAX_TEXT as LONGEST
from vfix_engine.errors import InputError

HOSTILE: list[Any] = [
    1e300, -1e300, "x" * (LONGEST + 1), {"a": [1] * 1000}, [[0.0] * 1000] * 10, "x" * 10_001, "../../etc\n", [], "",
]  # fmt: skip
TEXTS = ["name", "#00ff00", "", "0" * 64, "sha256:" + "0" * 64]
ROUTES = [
    pytest.param(method, path, operations, id=f"{method} {path}")
    for spec in specs()
    for (method, path), operations in addresses(spec).items()
]
MESSAGES = [pytest.param(message, id=kind) for kind, message in messages().items()]


@pytest.fixture(scope="module")
def bare() -> Iterator[Client]:
    """The routes without services: nothing that is refused gets as far."""
    app = FastAPI()
    app.state.services = None
    install_error_answers(app)
    app.include_router(router)
    opened = Client(app)
    yield opened
    opened.close()


def example(kind: Any) -> Any:
    """A value that a type takes."""
    origin, arguments = get_origin(kind), get_args(kind)
    candidates: Iterator[Any] | list[Any]
    if origin is Annotated:
        inner = example(arguments[0])
        candidates = [inner, [inner], *TEXTS, 0, 1, 0.5, 3, *([inner * 16] if isinstance(inner, list) else [])]
    elif origin in (Union, types.UnionType):
        candidates = [example(one) for one in arguments if one is not type(None)]
    elif origin is Literal:
        candidates = list(arguments)
    elif origin is tuple and Ellipsis not in arguments:
        candidates = [[example(one) for one in arguments]]
    elif origin in (list, tuple):
        candidates = [[example(arguments[0])]]
    elif origin is dict:
        candidates = [{example(arguments[0]): example(arguments[1])}]
    elif isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        candidates = [{field.name: example(field.type) for field in msgspec.structs.fields(kind)}]
    else:
        candidates = [*TEXTS, 1, 0.5, True, {}]
    return next(value for value in candidates if taken(kind, value))


def taken(kind: Any, value: Any) -> bool:
    try:
        read(kind, value)
    except Unreadable:
        return False
    return True


def body_of(operations: list[type[Operation]], path: str) -> dict[str, Any]:
    """A body of one operation that its types take."""
    fields = fields_of(operations[:1])
    return {name: example(kind) for name, (kind, _) in fields.items() if f"{{{name}}}" not in path}


def refused_by(kind: Any) -> list[Any]:
    """The hostile values that a type does not take: all but what may be a name, a word or an empty list."""
    found = [value for value in HOSTILE if not taken(kind, value)]
    assert all(value in found for value in HOSTILE[:5])
    return found


@pytest.mark.parametrize(("method", "path", "operations"), ROUTES)
def test_each_field_of_a_body_is_bounded(
    bare: Client, method: str, path: str, operations: list[type[Operation]]
) -> None:
    address = "/api/v1" + path.replace("{", "").replace("}", "")
    good = body_of(operations, path)

    def refused(body: Any) -> list[dict[str, Any]]:
        answer = bare.request(method, address, json=body)
        assert answer.status_code in (422, 500), answer.text
        details: list[dict[str, Any]] = answer.json()["error"].get("details", [])
        return details

    assert refused(good) == [], "what its types take comes as far as the services, which are not there"
    for name in good:
        for hostile in refused_by(fields_of(operations)[name][0]):
            found = refused({**good, name: hostile})
            assert found, (name, hostile)
            assert [detail["where"][:2] for detail in found] == [["body", name]] * len(found)
    assert refused({**good, "nobody": 1}) == [{"where": ["body", "nobody"], "message": "There is no such field"}]
    assert refused({**good, "revision": -1})[0]["where"] == ["body", "revision"]
    assert refused([good])[0]["where"] == ["body"]


@pytest.mark.parametrize(("method", "path", "operations"), ROUTES)
def test_a_body_says_nothing_else_than_the_address(
    bare: Client, method: str, path: str, operations: list[type[Operation]]
) -> None:
    """It was left unheard where it did, as was every body of a DELETE."""
    names = [name for name in re.findall(r"\{(\w+)\}", path)[1:] if name in fields_of(operations)]
    address = "/api/v1" + path.replace("{", "").replace("}", "")
    for name in names:
        same, other = {**body_of(operations, path), name: name}, {**body_of(operations, path), name: "another"}
        assert "details" not in bare.request(method, address, json=same).json()["error"]
        details = bare.request(method, address, json=other).json()["error"]["details"]
        assert details == [{"where": ["body", name], "message": "The address says another one"}]


@pytest.mark.parametrize("message", MESSAGES)
def test_each_field_of_a_message_is_bounded(message: MessageSpec) -> None:
    good = {name: example(kind) for name, (kind, _) in message.fields().items()}
    parse_command(json.dumps({"type": message.kind, **good}))
    for name, (kind, _) in message.fields().items():
        for hostile in (*refused_by(kind), float("nan"), float("inf")):
            with pytest.raises(InvalidMessage):
                parse_command(json.dumps({"type": message.kind, **good, name: hostile}))
    for further in ({"nobody": 1}, {f"key{n}": n for n in range(10_000)}, {"id": -1}, {"id": True}):
        with pytest.raises(InvalidMessage):
            parse_command(json.dumps({"type": message.kind, **good, **further}))
    with pytest.raises(InvalidMessage, match="stands twice"):
        parse_command(f'{{"type": "{message.kind}", "type": "undo"}}')


def test_a_body_says_every_place_that_is_wrong(bare: Client) -> None:
    points = [[0, 0, 0], [0, True, 0], [0, 0], [0, 0, 1e6]]
    answer = bare.post("/api/v1/labels/x/strokes", json={"mode": "blow", "points": points, "colour": "#fff"})
    places = [".".join(detail["where"]) for detail in answer.json()["error"]["details"]]
    assert places == [
        "body.radius_mm", "body.points.1.1", "body.points.2", "body.points.3.2", "body.mode", "body.colour",
    ]  # fmt: skip
    many = bare.post("/api/v1/labels/x/strokes", json={"radius_mm": 1, "points": [["a", 0, 0]] * 30})
    details = many.json()["error"]["details"]
    assert (len(details), details[-1]["message"]) == (21, "and 10 more")


def test_a_body_is_json_without_a_doubled_key(bare: Client) -> None:
    def told(content: str, kind: str = "application/json") -> str:
        answer = bare.post("/api/v1/labels/x/strokes", content=content, headers={"Content-Type": kind})
        assert answer.status_code == 422
        return str(answer.json()["error"]["details"][0]["message"])

    assert "stands twice" in told('{"radius_mm": 1, "radius_mm": 2}')
    assert "Content-Type" in told("{}", "text/plain")
    assert "no number" in told('{"radius_mm": NaN}')


def test_blanks_around_a_name_that_a_page_sends_are_taken_off() -> None:
    command = parse_command('{"type": "label.change", "label_id": "label-1", "name": " Wall "}')
    (operation,) = command.operations  # type: ignore[union-attr]
    assert operation.name == "Wall"  # type: ignore[attr-defined]
    with pytest.raises(InvalidMessage):
        parse_command('{"type": "label.change", "label_id": "label-1", "name": "  "}')


@pytest.mark.parametrize("message", MESSAGES)
def test_types_of_fields_are_looked_at_once_and_not_at_each_message(
    message: MessageSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each look evaluates every annotation, which takes milliseconds."""
    text = json.dumps({**{name: example(kind) for name, (kind, _) in message.fields().items()}, "type": message.kind})
    parse_command(text)
    monkeypatch.delattr(msgspec.structs, "fields")
    monkeypatch.delattr(msgspec, "inspect")
    parse_command(text)


def test_a_number_beyond_its_bounds_is_refused_in_words_at_its_place(bare: Client) -> None:
    def told(method: str, path: str, body: dict[str, Any]) -> list[Any]:
        answer = bare.request(method, f"/api/v1/registrations/x{path}", json=body).json()
        return [(".".join(detail["where"]), detail["message"]) for detail in answer["error"]["details"]]

    noise = "a noise of 20.5 mm cannot be simulated; say 0 to 20 mm."
    assert told("POST", "/pairs/p/touch", {"noise_mm": 20.5}) == [("body.noise_mm", noise)]
    fle = "a localisation error of 0 mm cannot be; say more than 0 and up to 50 mm."
    assert told("PATCH", "", {"fle": {"mm": 0}}) == [("body.fle.mm", fle)]
    weight = told("PATCH", "/pairs/p", {"weight": -1, "in_image": [0, 0, 1e4]})
    assert weight == [
        ("body.in_image.2", "Expected `float` < 10000.0"),
        ("body.weight", "a pair's weight is above 0; leave a pair out of the fit by its switch."),
    ]
    assert told("PATCH", "/pairs/p", {"weight": True}) == [("body.weight", "Expected `float | null`, got `bool`")]


def test_of_what_a_command_line_says_only_what_is_wrong_is_told() -> None:
    """There every number is a text; one that is right stands beside one that is beyond its bounds."""
    with pytest.raises(Unreadable) as refused:
        read(TouchPair, {"noise_mm": "0.5", "pair_id": "", "seed": "7"}, strict=False)
    assert [place for place, _ in refused.value.problems] == [("pair_id",)]
    with pytest.raises(Unreadable, match=r"noise.* 25 mm"):
        read(TouchPair, {"noise_mm": "25", "seed": "7"}, strict=False)


def test_a_text_is_what_a_stored_text_may_be(bare: Client) -> None:
    def stored(text: str) -> bool:
        try:
            return bool(check_text(text, "notes", MAX_TEXT))
        except InputError:
            return False

    texts = [f"a{chr(code)}b" for code in (*range(0x3000), *range(0xD7F0, 0xE010), *range(0xFFF0, 0x10010))]
    assert [text for text in (*texts, "a\n", "x" * (MAX_TEXT + 1)) if taken(Text, text) != stored(text)] == []
    answer = bare.request("PUT", "/api/v1/plans/x/notes", json={"notes": "Dr \n\x00 x\u202e"}).json()
    refused = "the text holds a control character; use letters, digits, signs and line breaks."
    assert answer["error"]["details"] == [{"where": ["body", "notes"], "message": refused}]
    for value, words in ((3, "Expected `str`, got `int`"), ("x" * (MAX_TEXT + 1), "length <= 10000")):
        with pytest.raises(Unreadable, match=words):
            read(Text, value)


def test_a_field_within_another_is_said_by_itself_in_a_message(bare: Client) -> None:
    for value in (0.5, None):
        command = parse_command(json.dumps({"type": "registration.fle", "fle_mm": value}))
        assert command.operations == (SetFle(fle=FleRequest(value)),)  # type: ignore[union-attr]
    for body, place in (
        ({"fle_mm": 60}, "fle_mm: a localisation error of 60 mm"),
        ({}, "fle_mm: Field required"),
        ({"fle": {"mm": 0.5}}, "fle_mm: Field required"),
        ({"fle_mm": 0.5, "fle": {"mm": 0.5}}, "fle: There is no such field"),
        ({"fle_mm": 0.5, "fle.mm": 0.5}, "fle.mm: There is no such field"),
    ):
        with pytest.raises(InvalidMessage, match=place):
            parse_command(json.dumps({"type": "registration.fle", **body}))


def test_each_operation_is_reached_and_documented_in_its_own_words() -> None:
    for spec in specs():
        for operation in spec.operations:
            assert operation.rest or operation.message or operation.verb, operation
            assert operation.__doc__, operation
            assert operation.__doc__.strip().split("\n")[0].endswith((".", ",")), operation
