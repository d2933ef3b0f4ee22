"""Write snapshots of the interfaces that a refactoring must not change, as data for a test.

    .venv/bin/python scripts/freeze.py

`tests/data/frozen` contains a sorted JSON file for each interface, one line per item: the REST interface, the messages
of the page in both directions, the verbs of the command line, the keys that they print with `--json`, and what is
stored for each kind of document, for runs and in archives. `tests/app/test_frozen.py` compares them with the code. Run
this after an intended change of one of them, and commit the difference with the change.

Descriptions of REST and docstrings of messages are left out; the help of the command line is included, option by
option, since its layout differs between versions of Python.
"""

import argparse
import contextlib
import importlib.util
import io
import json
import os
import sys
import tarfile
import tempfile
import types
import zipfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest import mock

from fastapi import FastAPI
from pydantic import TypeAdapter
from sqlalchemy import select

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from app import cli  # noqa: E402
from app.api import described, router  # noqa: E402
from app.cases.reading import case_content_from_json  # noqa: E402
from app.commands.doctor import examine  # noqa: E402
from app.documents.documents import Documents  # noqa: E402
from app.gateway.pages import page_router  # noqa: E402
from app.operations.messages import messages as operation_messages  # noqa: E402
from app.services import Services, build_services  # noqa: E402
from app.session import commands  # noqa: E402
from app.session import router as session_router  # noqa: E402
from app.settings import Settings  # noqa: E402
from app.store.models import CaseRow  # noqa: E402
from app.tabs.registry import routers as tab_routers  # noqa: E402
from vfix_engine.runtime.run import Run  # noqa: E402
from vfix_engine.worlds import registry as worlds  # noqa: E402

FROZEN = ROOT / "tests" / "data" / "frozen"
OLD_HOME = ROOT / "tests" / "data" / "old_home" / "home.tar.xz"
HEAD, PLAN = "Made-up head", "Through the tube"  # in that home
Items = dict[str, Any]  # by name, such as 'GET /api/v1/cases' or 'vfix case list --deleted'
_WORDS = {"description", "title", "summary", "operationId", "tags"}  # of OpenAPI: texts, or derived from the code
_MOST_DIFFERENCES = 40


def rest() -> Items:
    """Return routes with parameters, bodies and statuses, and the fields of every schema, from OpenAPI."""
    app = FastAPI()
    for part in (page_router(), router, session_router, *tab_routers()):
        app.include_router(part)
    document, items = described(app.openapi()), Items()
    for path, methods in document["paths"].items():
        for method, route in methods.items():
            items[f"{method.upper()} {path}"] = _route(_without_words(route))
    for name, schema in document["components"]["schemas"].items():
        items |= _schema(f"schema {name}", schema)
    return items


def messages() -> Items:
    """Return fields of the commands that the page sends, with bounds, and of the sections and messages it receives."""
    items = Items()
    for model in commands.commands():
        schema = TypeAdapter(model).json_schema()
        inner = schema.pop("$defs", {})
        kind = schema["properties"]["type"]
        for name in kind.get("enum", [kind.get("const")]):
            items |= _schema(f"command {name}", schema)
        for name, one in inner.items():
            items |= _schema(f"command's {name}", one)
    for message in operation_messages().values():
        items |= _schema(f"command {message.kind}", message.schema())
    script = _declarations()
    made = script.Declarations()
    groups = (script.SessionSections, script.CaseSections, *(s.sections for s in script.specs() if s.sections))
    for group in groups:
        for name, (kind, _) in script.fields_of(group).items():
            items[f"section {name}"] = made.of(kind)
    for name, record in script.ANSWERS.items():
        items[f"answer to {name}"] = made.of(record)
    for record in script.MESSAGES:
        made.of(record)
    for name, record in sorted(made._known.items()):
        for field, (kind, always) in script.fields_of(record).items():
            items[f"{name}.{field}"] = made.of(kind) + ("" if always else " | undefined")
    return items


def verbs() -> Items:
    """Return every verb with its arguments and their help."""
    items = Items()
    for verb in cli.VERBS:
        parser, _ = cli._build_parser(verb.name)
        items["vfix"] = {"description": parser.description, "verbs": {one.name: one.summary for one in cli.VERBS}}
        (found,) = (one.choices[verb.name] for one in parser._actions if isinstance(one, argparse._SubParsersAction))
        items |= _parser_items(found)
    return items


def printed(home: Path) -> Items:
    """Return keys and types of the `--json` output of read-only verbs, from a home of an earlier version."""
    lines: tuple[tuple[str, ...], ...] = (
        ("case", "list", "--deleted"),
        ("case", "show", HEAD),
        ("case", "structures", HEAD),
        ("case", "labels", HEAD),
        ("plan", "list"),
        ("plan", "show", PLAN),
        ("plan", "versions", PLAN),
        ("plan", "diff", PLAN, "First version"),
        ("register", "list", HEAD),
    )
    items = Items()
    health = examine(Settings(home=home, port=0))
    items["vfix doctor: keys"] = sorted(asdict(health))  # types of the values depend on the machine
    with mock.patch.dict(os.environ, {"VFIX_HOME": str(home)}):
        for line in lines:
            out = io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
                cli.main([*line, "--json"])
            items |= {f"vfix {' '.join(line)}: {key}": kind for key, kind in shape(json.loads(out.getvalue())).items()}
    return items


def stored(services: Services) -> Items:
    """Return keys and types of what is stored: documents and cases as currently written, runs, and archives."""
    items = Items()
    every: tuple[Documents[Any], ...] = (
        services.plans.documents,
        services.versions.documents,
        services.registrations,
        services.labels.documents,
    )
    for documents in every:
        name, kind = documents.kind.name, documents.kind
        items[f"{name}: schema"] = kind.schema
        for document in documents.list(include_deleted=True):
            _merge(items, f"{name}: ", kind.write(document.content))
    with services.store.reading() as session:
        for row in session.scalars(select(CaseRow)):
            _merge(items, "case: ", case_content_from_json(row.document).to_json())
    for run in services.runs.list():
        with services.runs.laid_out(run.id) as folder:
            read = Run.read(folder)
        values, arrays = worlds.spec_of(read).to_parts()
        _merge(items, f"run of {run.world}: ", {**read.manifest, "spec": values, "hashes": {}})
        items[f"run of {run.world}: arrays"] = sorted(arrays)
    return items | _archive(services)


def _archive(services: Services) -> Items:
    """Return the entries of an archive with their keys."""
    items, target = Items(), io.BytesIO()
    case = next(one for one in services.cases.list() if one.name == HEAD)
    services.archive_writer.write(case.id, target, with_runs=True)
    with zipfile.ZipFile(target) as archive:
        for entry in archive.namelist():
            folder, name = (["", *entry.split("/", 1)])[-2:]
            if entry.endswith(".json"):
                keys = sorted(json.loads(archive.read(entry)))
                items[f"archive: {folder or name}{'/' + name.split('/')[0] if '/' in name else ''}"] = keys
    return items


def shape(value: Any, at: str = "") -> dict[str, str]:
    """Return types by path, such as 'cases[].name': 'string'; types of different entries of a list are combined."""
    if isinstance(value, Mapping):
        found: dict[str, str] = {} if value else {at or ".": "{}"}
        for key, inner in value.items():
            _together(found, shape(inner, f"{at}.{key}" if at else str(key)))
        return found
    if isinstance(value, list):
        found = {} if value else {f"{at}[]": "nothing"}
        for inner in value:
            _together(found, shape(inner, f"{at}[]"))
        return found
    if isinstance(value, bool) or value is None:
        return {at: "null" if value is None else "boolean"}
    return {at: "number" if isinstance(value, (int, float)) else "string"}


def laid_out(folder: Path) -> Path:
    """Unpack the data folder of an earlier version into a folder and return its path."""
    with tarfile.open(OLD_HOME) as archive:
        archive.extractall(folder, filter="data")
    return folder / "home"


def everything(folder: Path) -> dict[str, Items]:
    """Return the current content of each file of `tests/data/frozen` by name. folder: a folder for temporary files."""
    home = laid_out(folder)
    keys = printed(home)
    services = build_services(Settings(home=home, port=0))
    try:
        return {"rest": rest(), "messages": messages(), "verbs": verbs(), "printed": keys, "stored": stored(services)}
    finally:
        services.close()


def text_of(items: Items) -> str:
    """Return sorted JSON with one line per item."""
    lines = (f"{json.dumps(key)}: {json.dumps(value, sort_keys=True)}" for key, value in sorted(items.items()))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def differences(frozen: Items, now: Items) -> list[str]:
    """Return lines with the differences by item: removed, added, or the old and new value."""
    lines = [f"gone: {key}" for key in sorted(frozen.keys() - now.keys())]
    lines += [f"new: {key}: {json.dumps(now[key])}" for key in sorted(now.keys() - frozen.keys())]
    for key in sorted(frozen.keys() & now.keys()):
        lines += _changed(key, frozen[key], now[key])
    more = len(lines) - _MOST_DIFFERENCES
    return [*lines[:_MOST_DIFFERENCES], *([f"and {more} more"] if more > 0 else [])]


def _changed(at: str, then: Any, now: Any) -> list[str]:
    """Return where two values differ, recursively for objects."""
    if then == now:
        return []
    if isinstance(then, dict) and isinstance(now, dict):
        nothing = "nothing"
        parts = sorted({*then, *now})
        return [
            line for key in parts for line in _changed(f"{at} · {key}", then.get(key, nothing), now.get(key, nothing))
        ]
    return [f"changed: {at}: {json.dumps(then)} → {json.dumps(now)}"]


def _without_words(value: Any, inside: bool = False) -> Any:
    """Remove descriptive texts from a value, and normalise what libraries write differently.

    inside: the keys are names of fields, not keywords of OpenAPI.
    """
    if isinstance(value, dict):
        kept = {key: inner for key, inner in value.items() if inside or key not in _WORDS}
        if not inside:
            if "const" in kept:
                kept["enum"] = [kept.pop("const")]
            if "enum" in kept:
                kept["enum"] = sorted(kept["enum"], key=str)
            if kept.get("default", 0) is None:
                del kept["default"]
        return {key: _without_words(inner, key == "properties" and not inside) for key, inner in kept.items()}
    return [_without_words(one) for one in value] if isinstance(value, list) else value


def _route(route: Any) -> Any:
    """Return the parameters of a route by place and name, its body, and its statuses with their responses."""
    parameters = {f"{one['in']} {one['name']}": one for one in route.get("parameters", [])}
    for one in parameters.values():
        del one["in"], one["name"]
    answers: dict[str, list[str]] = {}
    for status, answer in route["responses"].items():
        contents = answer.get("content", {}) or {"no content": {}}
        for kind, content in contents.items():
            said = content.get("schema", {}).get("$ref") or json.dumps(content.get("schema", {}), sort_keys=True)
            name = said.rpartition("/")[2] if said.startswith("#") else said
            answers.setdefault(name if kind == "application/json" else f"{kind} {name}", []).append(status)
    kept = {key: value for key, value in route.items() if key not in ("parameters", "responses")}
    return {**kept, "parameters": parameters, "responses": answers}


def _schema(name: str, schema: Any) -> Items:
    """Return a schema, and an item for each of its fields."""
    plain = _without_words(schema)
    fields = plain.pop("properties", {})
    return {name: plain} | {f"{name}.{field}": kind for field, kind in fields.items()}


def _parser_items(parser: argparse.ArgumentParser) -> Items:
    items: Items = {parser.prog: {"description": parser.description}}
    for group in parser._mutually_exclusive_groups:
        names = [" ".join(one.option_strings) for one in group._group_actions]
        items[parser.prog].setdefault("one of", []).append(names)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            items[parser.prog]["actions"] = {one.dest: one.help for one in action._choices_actions}
            for inner in action.choices.values():
                items |= _parser_items(inner)
        elif not isinstance(action, argparse._HelpAction):
            said = " ".join(action.option_strings) or action.metavar or action.dest
            values = {
                "help": action.help,
                "metavar": action.metavar,
                "nargs": action.nargs,
                "choices": None if action.choices is None else list(map(str, action.choices)),
                "default": None if action.default is None else str(action.default),
                "required": action.required,
            }
            items[f"{parser.prog} {said}"] = {key: value for key, value in values.items() if value not in (None, False)}
    return items


def _merge(items: Items, before: str, value: Any) -> None:
    _together(items, {f"{before}{key}": kind for key, kind in shape(value).items()})


def _together(found: dict[str, Any], more: Mapping[str, str]) -> None:
    """Add types by path; a path with another type gets both."""
    for key, kind in more.items():
        found[key] = " | ".join(sorted({*kind.split(" | "), *found.get(key, kind).split(" | ")}))


def _declarations() -> types.ModuleType:
    """Import declarations.py, which knows every type of the page."""
    specification = importlib.util.spec_from_file_location("declarations", ROOT / "scripts" / "declarations.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def main() -> int:
    """Write the files."""
    FROZEN.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, items in everything(Path(folder)).items():
            (FROZEN / f"{name}.json").write_text(text_of(items), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
