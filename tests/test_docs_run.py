"""What the docs tell to type does what they say: the tutorial's commands, and the Python of README and library page."""

import json
import re
import shlex
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest

from app import cli

ROOT = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: str) -> list[tuple[str, str]]:
    """Language and text of every block of a page that names its language."""
    return BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))


def keys_of(value: Any) -> Any:
    """The keys of a JSON value, as deep as they go; of a list those of its first item."""
    if isinstance(value, dict):
        return {name: keys_of(item) for name, item in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [keys_of(value[0])]
    return None


def in_first(part: Any, whole: Any) -> bool:
    """Whether what is shown is what was said, numbers to 1 % and one unit of the last digit shown; `…` is anything.

    Times depend on the machine and are not compared.
    """
    if isinstance(part, dict):
        return all(name == "step_time_us" or in_first(item, whole[name]) for name, item in part.items())
    if isinstance(part, list):
        return len(part) <= len(whole) and all(map(in_first, part, whole))  # a page may show the first of many
    if isinstance(part, str) and "…" in part:
        return re.fullmatch(re.escape(part).replace("…", ".*"), whole) is not None
    if isinstance(part, Decimal) and isinstance(whole, int | float):
        last_digit = 10.0 ** int(part.as_tuple().exponent)
        return abs(float(part) - whole) <= 0.01 * abs(whole) + last_digit
    return bool(part == whole)


def test_numbers_that_are_shown_are_compared() -> None:
    shown = json.loads('{"a": [0.65, {"b": 9085}], "step_time_us": 1}', parse_float=Decimal, parse_int=Decimal)
    assert in_first(shown, {"a": [0.6541, {"b": 9100}], "step_time_us": 700})
    assert not in_first(shown, {"a": [0.67, {"b": 9085}], "step_time_us": 1})
    assert not in_first(shown, {"a": [0.65, {"b": 9300}], "step_time_us": 1})
    assert not in_first(shown, {"a": [0.65, {"b": None}], "step_time_us": 1})


def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Every command in turn, in a new home; the JSON that is shown has the keys, words and numbers of the real one."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "assets").symlink_to(ROOT / "assets")
    said, compared, answers = "", 0, {}
    for language, text in blocks("docs/tutorial.md"):
        if language == "json":
            shown, said_now = json.loads(text, parse_float=Decimal, parse_int=Decimal), json.loads(said)
            assert keys_of(shown) == keys_of(said_now)
            assert in_first(shown, said_now), said
            compared += 1
            continue
        assert language == "sh"
        for line in text.strip().splitlines():
            program, *arguments = shlex.split(line)
            assert program == "vfix"
            assert cli.main(arguments) == 0, (line, capsys.readouterr().err)
            said = capsys.readouterr().out
            answers[line] = json.loads(said)
    assert compared == 6
    driven = [answer for answer in answers.values() if "min_clearance_mm" in answer]
    assert len(driven) == 2
    assert all(answer["min_clearance_mm"] >= answer["margin_mm"] for answer in driven)
    assert driven[0]["tip_error_mm"]["max"] <= 0.05
    with (tmp_path / "run.csv").open(encoding="utf-8") as file:
        columns = file.readline()
        assert {"command_force_x [N]", "t [s]", "q6 [rad]", "tip_x [mm]", "s0_ax [mm]"} <= {*columns.split(",")}
        assert columns.endswith(" [mm],sideways [mm],certified,not_for_clinical_use\n"), "HAZ-35"
        assert sum(1 for _ in file) == driven[0]["steps"]
    formats = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    rows = re.split(r"^## ", formats.split("## Plan, JSON\n")[1], maxsplit=1, flags=re.MULTILINE)[0]
    documented = {name for row in re.findall(r"^\| (`.+?) \|", rows, re.MULTILINE) for name in re.findall(r"\w+", row)}
    assert documented == set(json.loads((tmp_path / "corridor.json").read_text(encoding="utf-8")))
    assert "Not for clinical use" in (tmp_path / "first.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("README.md", r"[\d.]+ of [\d.]+ mm, clearance \d\.\d\d mm"),
        ("docs/library.md", "along the path"),
        ("docs/lumen_tutorial.md", "8 links, 224 mm in, all within their bounds: True"),
    ],
)
def test_the_python_runs(
    page: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The blocks of a page are one program; what it writes it writes where it is started."""
    program = "\n".join(text for language, text in blocks(page) if language == "python")
    monkeypatch.chdir(tmp_path)
    exec(compile(program, page, "exec"), {})
    assert re.search(words, capsys.readouterr().out)
