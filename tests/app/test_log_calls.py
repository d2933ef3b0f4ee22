"""HAZ-33: no log call writes what an error says, or a name that a person gave, wherever it stands."""

from __future__ import annotations

import ast
import builtins
import io
import logging
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import pytest

import app
import vfix_engine
from app.gateway.connections import Discreet
from vfix_engine.error_places import error_kind, error_places

CANARY = "Canary Doe 1970"
ROOT = Path(app.__file__).parent.parent
LOGGED = {"error_places": error_places, "error_kind": error_kind, "_LOG": logging.getLogger("vfix-log-calls")}
# What else than errors is logged, and why it holds no name that a person gave.
SAFE = {
    "case_id": "case-1",  # made by the planner
    "document_id": "plan-1",  # made by the planner
    "left": [],  # keys of files, of which the number is logged
    "going_on": 1,  # a number
    "path": "/home/someone/vfix",  # the data folder
    "refusal": "the data folder is full.",  # of a start, about that folder
    "what": "The head could not be read",  # a constant: another test looks
    "scope": {"type": "http"},
    "message": {"type": "state"},  # of the page, one of four
}
# Its faults quote nothing that came: what a client sends is answered to that client alone.
LEVELS = {"debug", "info", "warning", "error", "exception", "critical", "log"}
FAULTS_OF_THE_LINK = ("app/link/server.py", "done")


class Canary(OSError):
    """Whatever is asked of it, it quotes a name; its number alone is the system's."""

    def __init__(self) -> None:
        super().__init__(28, CANARY)

    def __str__(self) -> str:
        return CANARY

    def __getattr__(self, name: str) -> str:
        if name.startswith("__"):
            raise AttributeError(name)
        return CANARY

    def __getitem__(self, key: object) -> str:
        return CANARY


def _raised() -> Canary:
    try:
        try:
            raise ValueError(CANARY)
        except ValueError as error:
            raise Canary from error
    except Canary as error:
        return error


def _calls() -> Iterator[tuple[str, ast.Call]]:
    """Every call that writes to a log, or an error to the standard error output, which is the planner's log."""
    for package in (app, vfix_engine):
        folder = Path(package.__file__).parent
        for path in sorted(folder.rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            if "logging" not in text and "traceback" not in text and "error_places" not in text:
                continue
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.Call) and _logs(node):
                    yield path.relative_to(ROOT).as_posix(), node


def _logs(call: ast.Call) -> bool:
    name = ast.unparse(call.func)
    if name.split(".")[-1] in {"print_exc", "print_exception", "format_exc"} or name.startswith("logging."):
        return name.split(".")[-1] in LEVELS | {"print_exc", "print_exception", "format_exc"}
    if name == "print":
        return "error" in ast.unparse(call)
    owner, _, method = name.rpartition(".")
    return owner.lower().endswith(("log", "logger")) and method in LEVELS


CALLS = list(_calls())


def test_the_calls_are_found() -> None:
    files = {file for file, _ in CALLS}
    assert {"app/workspace/background.py", "app/link/server.py", "vfix_engine/runtime/background.py"} <= files
    assert len(CALLS) > 25


@pytest.mark.parametrize(("file", "call"), CALLS, ids=[f"{file}:{call.lineno}" for file, call in CALLS])
def test_no_log_call_quotes_an_error(file: str, call: ast.Call, caplog: pytest.LogCaptureFixture) -> None:
    """The very call is made, with errors that quote a name in the place of everything that is no constant."""
    names = {node.id for node in ast.walk(call) if isinstance(node, ast.Name)}
    values: dict[str, Any] = {}
    for name in names:
        if hasattr(builtins, name):
            continue
        constant = 1 if name.isupper() and not name.startswith("_") else None
        values[name] = LOGGED.get(name, constant) or SAFE.get(name, _raised())
        if (file, name) == FAULTS_OF_THE_LINK and "error_places" not in ast.unparse(call):
            values[name] = "it took nothing"
    written = io.StringIO()
    values["sys"] = type("_System", (), {"stderr": written})
    compiled = compile(ast.Expression(ast.fix_missing_locations(call)), file, "eval")
    with redirect_stderr(written), caplog.at_level(logging.DEBUG):
        eval(compiled, values)
    said = caplog.text + written.getvalue()
    assert said
    assert CANARY not in said


def test_what_work_in_the_background_is_called_is_a_constant() -> None:
    """It is logged where the work fails."""
    seen = 0
    for path in sorted((ROOT / "app").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "in_background(" in text or "_latest.ask(" in text else ():
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func)
            if name == "in_background" or name.endswith("_latest.ask"):
                what = node.args[name == "in_background"]
                assert isinstance(what, ast.Constant) or (isinstance(what, ast.Name) and what.id.isupper()), path
                seen += 1
    assert seen >= 7


def test_of_an_error_its_types_and_places_are_told_and_what_the_system_says() -> None:
    error = _raised()
    assert error_kind(error) == "Canary (No space left on device)"
    lines = error_places(error).splitlines()
    assert lines[0] == "Canary (No space left on device)"
    assert "  from ValueError" in lines
    assert sum(line.endswith(" _raised") for line in lines) == 2
    assert error_kind(KeyError(CANARY)) == "KeyError"
    first, second = RuntimeError(CANARY), RuntimeError(CANARY)
    first.__cause__, second.__cause__ = second, first
    assert error_places(first).count("RuntimeError") == 2, "a circle ends"


def test_what_libraries_log_of_an_error_is_where_it_was(caplog: pytest.LogCaptureFixture) -> None:
    """An error that nobody caught comes to the log through the server's or the event loop's logger."""
    logger = logging.getLogger("vfix-of-a-library")
    logger.addFilter(Discreet())
    logger.error("Exception in ASGI application\n", exc_info=_raised())
    try:
        raise ValueError(CANARY)
    except ValueError:
        logger.exception("handler of %s failed", CANARY)
    logger.error("a line without an error: %s", "as it is")
    assert CANARY not in caplog.text
    assert "Exception in ASGI application: Canary (No space left on device)" in caplog.text
    assert "ValueError" in caplog.text
    assert "a line without an error: as it is" in caplog.text
    assert sys.exc_info() == (None, None, None)
