"""Each operation that has a message has a control on the page, which the palette finds by `data-operation`."""

import re
from pathlib import Path

import pytest

from app.operations.messages import messages

APP = Path(__file__).resolve().parents[3] / "app"
# What has no control: what was deleted is restored from the message that says so, a path is chosen by its row, and the
# run of a trial is attached once it is stored.
WITHOUT = {"label.restore", "version.restore", "path.choose", "study.attach"}


@pytest.fixture(scope="module")
def controls() -> set[str]:
    sources = [*APP.glob("tabs/*/*.js"), *APP.glob("web/js/**/*.js")]
    text = "\n".join(path.read_text(encoding="utf-8") for path in sources)
    marks = (
        r'"?data-operation"?(?:=|: )"([a-z_. ]+)"|dataset\.operation = "([a-z_. ]+)"|\boperation: "([a-z_. ]+)"'
        r'|data-operation=\$\{[^}]*\? "([a-z_. ]+)"'
    )
    found = re.findall(marks, text)
    return {name for pair in found for names in pair for name in names.split()}


@pytest.mark.parametrize("kind", sorted(messages().keys() - WITHOUT))
def test_an_operation_has_its_control(kind: str, controls: set[str]) -> None:
    assert kind in controls


def test_the_palette_has_a_name_for_each() -> None:
    names = [message.title for message in messages().values()]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[A-Z][a-z]+( [A-Za-z()]+)*", name) and len(name.split()) <= 4 for name in names)
