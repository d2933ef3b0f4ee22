"""What must not change unnoticed: REST, messages, verbs, keys that are printed, and what is stored.

A change that is meant is written by `.venv/bin/python scripts/freeze.py`.
"""

import importlib.util
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("rest", "messages", "verbs", "printed", "stored")


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    specification = importlib.util.spec_from_file_location("freeze", ROOT / "scripts" / "freeze.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def now(script: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Everything as the code has it, made once."""
    return script.everything(tmp_path_factory.mktemp("frozen"))


@pytest.mark.parametrize("name", NAMES)
def test_an_interface_is_as_it_was_frozen(script: ModuleType, now: Any, name: str) -> None:
    text = (script.FROZEN / f"{name}.json").read_text(encoding="utf-8")
    current = json.loads(script.text_of(now[name]))
    found = script.differences(json.loads(text), current)
    told = "\n".join([f"{name} differs from what is frozen; where that is meant, run scripts/freeze.py:", *found])
    assert not found, told
    assert text == script.text_of(current)


def test_every_interface_is_compared(script: ModuleType, now: Any) -> None:
    assert sorted(now) == sorted(NAMES) == sorted(path.stem for path in script.FROZEN.glob("*.json"))


def test_differences_name_the_item_and_the_place_in_it(script: ModuleType) -> None:
    frozen = {"GET /a": {"responses": {"200": {"x": 1}}}, "GET /b": {}, "plan.name": "string"}
    changed = {"GET /a": {"responses": {"200": {"x": 2}, "404": {}}}, "plan.name": "string", "plan.note": "string"}
    assert script.differences(frozen, changed) == [
        "gone: GET /b",
        'new: plan.note: "string"',
        "changed: GET /a · responses · 200 · x: 1 → 2",
        'changed: GET /a · responses · 404: "nothing" → {}',
    ]
    many = {f"item {number:02}": number for number in range(60)}
    assert len(script.differences(many, {})) == 41
    assert script.differences(many, {})[-1] == "and 20 more"


def test_types_of_lists_are_told_together(script: ModuleType) -> None:
    value = {"cases": [{"name": "a", "deleted": None}, {"name": "b", "deleted": "now", "size": 1.5}], "notes": []}
    assert script.shape(value) == {
        "cases[].name": "string", "cases[].deleted": "null | string", "cases[].size": "number", "notes[]": "nothing",
    }  # fmt: skip
