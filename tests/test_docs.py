"""The docs say what is there: every setting, route, option and hazard, links that lead somewhere, commands that run."""

import argparse
import ast
import contextlib
import io
import re
import shlex
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from app import cli
from vfix_engine.control import ControlSettings
from vfix_engine.worlds.rigid.spec import SceneSpec

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
VERBS = [verb.name for verb in cli.VERBS]


def page(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def section(text: str, heading: str) -> str:
    """What stands below a heading of the second level."""
    return re.split(r"^## ", text.split(f"\n## {heading}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]


def tables(text: str) -> list[list[str]]:
    """Cells of every row of the text's tables."""
    return [[cell.strip() for cell in line[1:-1].split("|")] for line in text.splitlines() if line.startswith("| ")]


# Links


@pytest.mark.parametrize("file", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_links_lead_somewhere(file: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", file.read_text(encoding="utf-8")):
        if link.startswith("https://"):
            continue
        path, _, anchor = link.partition("#")
        target = file if not path else (file.parent / path).resolve()
        assert target.exists(), f"{file.name} points to {link}"
        assert target.is_relative_to(ROOT)
        if anchor:
            assert anchor in anchors(target), f"{file.name} points to {link}"


def anchors(file: Path) -> set[str]:
    headings = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_index_leads_to_every_page() -> None:
    linked = set(re.findall(r"\]\(([\w.-]+\.md)\)", page("docs/index.md")))
    assert linked == {file.name for file in DOCS.glob("*.md")} - {"index.md"}


def test_every_picture_is_shown() -> None:
    text = "".join(file.read_text(encoding="utf-8") for file in PAGES)
    assert not [file.name for file in (DOCS / "images").iterdir() if f"images/{file.name}" not in text]


# Reference


def test_every_environment_variable_is_documented() -> None:
    used: set[str] = set()
    for folder in ("app", "benchmarks", "scripts", "tests", "vfix_engine"):
        for file in (ROOT / folder).rglob("*.py"):
            used |= set(re.findall(r"\bVFIX_[A-Z_]+\b", file.read_text(encoding="utf-8")))
    rows = {row[0].strip("`") for row in tables(section(page("docs/settings.md"), "Environment"))}
    assert {name for name in rows if name.startswith("VFIX_")} == used


def test_every_setting_of_the_controller_is_documented() -> None:
    rows = {row[0].strip("`"): row for row in tables(section(page("docs/settings.md"), "The controller"))}
    defaults = ControlSettings().to_dict()
    assert set(rows) - {"Field", "---"} == set(defaults)
    for name, bound in ControlSettings.bounds().items():
        _, label, default, span, unit, meaning = rows[name]
        low, high = (float(value) for value in span.split(" … "))
        assert (label, float(default), low, high, unit) == (
            bound.label,
            defaults[name],
            bound.low,
            bound.high,
            bound.unit,
        )
        assert meaning


def test_every_choice_of_the_control_law_in_a_scene_is_documented() -> None:
    rows = {row[0].strip("`"): row for row in tables(section(page("docs/settings.md"), "The scene of a rigid tool"))}
    choices = {field.name: str(field.default).lower() for field in fields(SceneSpec) if isinstance(field.default, bool)}
    assert {name: row[1] for name, row in rows.items() if name not in ("Field", "---")} == choices


def options(parser: argparse.ArgumentParser) -> set[str]:
    """Long options of a parser and of those below it."""
    found: set[str] = set()
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                found |= options(below)
        found |= {text for text in action.option_strings if text.startswith("--")}
    return found - {"--help", "--version"}


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_is_documented(verb: str) -> None:
    words = section(page("docs/cli.md"), f"vfix {verb}")
    documented = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", words)) - {"--setup-only"}
    assert documented == options(cli._build_parser(verb)[0])
    parser = cli._build_parser(verb)[0]
    below = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction)).choices[verb]
    for action in below._actions:
        if isinstance(action, argparse._SubParsersAction):
            assert not [name for name in action.choices if f"`vfix {verb} {name} " not in words.replace("`,", " `,")]


def commands() -> list[tuple[str, str]]:
    """Command lines in the docs, with the file of each; abbreviated ones left out."""
    line = re.compile(r"`(?:\.venv/bin/)?vfix ([^`\n]+)`|^(?:\.venv/bin/)?vfix ([^`\n]+)$", re.MULTILINE)
    return [
        (file.name, command)
        for file in PAGES
        if file.name != "CHANGELOG.md"
        for found in line.finditer(file.read_text(encoding="utf-8"))
        if not re.search(r"…|\[|\|", command := (found[1] or found[2]).partition(" > ")[0])
        if command.split()[0] in VERBS
    ]


def test_options_and_choices_in_the_docs_exist() -> None:
    """Capitals stand for values, so only names of options and choices are checked."""
    given, unknown = commands(), []
    assert len(given) > 200
    for file, command in given:
        words = shlex.split(command, comments=True)
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # of --help
                cli._build_parser(words[0])[0].parse_args(words)
        except cli._UsageError as error:
            if re.search("invalid choice|unrecognized arguments", str(error)):
                unknown.append(f"{file}: vfix {command}: {error}")
        except SystemExit:
            pass
    assert not unknown


def test_every_verb_is_documented() -> None:
    assert re.findall(r"^## vfix (\w+)$", page("docs/cli.md"), re.MULTILINE) == VERBS


@pytest.fixture(scope="module")
def schema(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """OpenAPI of the REST routes; neither services nor scene are needed to describe them."""
    from fastapi import FastAPI

    from app.api import router

    application = FastAPI()
    application.include_router(router)
    return application.openapi()


def test_every_route_and_parameter_is_documented(schema: dict[str, Any]) -> None:
    rows = {row[0].strip("`"): row[1] for row in tables(page("docs/api.md")) if re.match("`[A-Z]+ /api/v1/", row[0])}
    described: dict[str, str] = {}
    for path, methods in schema["paths"].items():
        for method, operation in methods.items():
            route = f"{method.upper()} {path}"
            described[route] = path
            for parameter in operation.get("parameters", []):
                if parameter["in"] == "query":
                    words = rows.get(route, "")
                    named = f"`{parameter['name']}`" in words or "as above" in words
                    assert named, f"{route}: {parameter['name']}"
    assert set(rows) == set(described)


def test_every_address_of_a_step_is_documented() -> None:
    from app.tabs.registry import routers

    text = page("docs/api.md") + page("docs/session.md")
    addresses = [str(getattr(route, "path", "")) for router in routers() for route in router.routes]
    assert addresses
    assert [address for address in addresses if address not in text] == []


# Safety


def docstring_hazards(file: Path) -> set[str]:
    """Hazards that the docstrings of a test file name."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    nodes = [node for node in ast.walk(tree) if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))]
    words = " ".join(ast.get_docstring(node) or "" for node in nodes)
    shared = re.sub(r"(HAZ-\d\d), -(\d\d)", r"\1, HAZ-\2", words)
    return set(re.findall(r"HAZ-\d\d", shared))


def hazard_rows() -> dict[str, list[str]]:
    return {row[0]: row for row in tables(page("docs/safety.md")) if row[0].startswith("HAZ-")}


def test_the_table_of_hazards_is_complete_and_in_order() -> None:
    numbers = [int(hazard.removeprefix("HAZ-")) for hazard in hazard_rows()]
    assert numbers == list(range(1, len(numbers) + 1))
    for hazard, (_, _, _, _, target, state) in hazard_rows().items():
        assert re.search(r"\w", target), hazard
        assert re.match(r"built($|; .)|in part: .|not built$", state), (hazard, state)


def test_a_hazard_that_is_built_has_a_control_and_tests_that_name_it() -> None:
    for hazard, (_, _, control, test, _, state) in hazard_rows().items():
        tests = re.findall(r"\]\(\.\./(tests/[\w/.]+)\)", test)
        for file in tests:
            assert hazard in docstring_hazards(ROOT / file), f"{file} does not name {hazard}"
        if state.startswith("built"):
            assert tests, hazard
            assert re.search(r"\]\(\.\./(app|vfix_engine)/", control), hazard


def test_a_hazard_that_a_test_names_is_not_called_unbuilt() -> None:
    rows = hazard_rows()
    for file in (ROOT / "tests").rglob("test_*.py"):
        if file.name == Path(__file__).name:
            continue
        for hazard in docstring_hazards(file):
            assert hazard in rows, f"{file.name} names {hazard}"
            assert rows[hazard][5] != "not built", f"{file.name} names {hazard}"
