"""`vfix VERB ...`: loads the verb's module, runs it, and turns errors into one line and an exit status.

Exit status: 0 done, 1 the verb ran with a negative result, 2 the input was refused, 130 interrupted, 141 the output
was closed.
"""

import argparse
import importlib
import io
import json
import os
import select
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NoReturn, Protocol, cast

from app import __version__
from app.error_shape import error_body, error_code
from app.extras import has_app, need_app
from vfix_engine.errors import VfixError

_PIPE_CLOSED = 141  # as a shell has it: 128 and the number of SIGPIPE
NOTICE = "Not for clinical use."


@dataclass(frozen=True)
class CliVerb:
    """A verb of the command line and its module; needs_app: whether it requires the extra `app`."""

    name: str
    module: str
    summary: str
    needs_app: bool = False


VERBS = (
    CliVerb("serve", "app.commands.serve", "start the planner and open its page", needs_app=True),
    CliVerb("import", "app.commands.import_", "make a new case of a CT or a surface", needs_app=True),
    CliVerb("case", "app.commands.case", "list, rename, delete and restore cases", needs_app=True),
    CliVerb("plan", "app.commands.plan", "list, import and export plans", needs_app=True),
    CliVerb("register", "app.commands.register", "how a CT lies on a patient: beads, fit, transforms", needs_app=True),
    CliVerb("rehearse", "app.commands.rehearse", "run a rehearsal without a page"),
    CliVerb("run", "app.commands.run", "list, show, comment on, export and delete recorded runs"),
    CliVerb("replay", "app.commands.replay", "drive a recorded run again, step by step"),
    CliVerb("score", "app.commands.score", "score recorded runs"),
    CliVerb("report", "app.commands.report", "write a report on recorded runs"),
    CliVerb("route", "app.commands.route", "list, make and edit routes through a lumen", needs_app=True),
    CliVerb("assignment", "app.commands.assignment", "check assignments, and print their results", needs_app=True),
    CliVerb("study", "app.commands.study", "run a paper's experiment, or one's own study"),
    CliVerb("lumen", "app.commands.lumen", "drive a snake robot through a lumen"),
    CliVerb("bench", "app.commands.bench", "measure the engine on this machine"),
    CliVerb("doctor", "app.commands.doctor", "check this machine"),
)


class _UsageError(Exception):
    """The command line is invalid; `parser` is that of the verb."""

    def __init__(self, parser: argparse.ArgumentParser, message: str) -> None:
        super().__init__(message)
        self.parser = parser


class _Parser(argparse.ArgumentParser):
    """Raises the error that argparse would print, so that it can be printed as JSON."""

    def error(self, message: str) -> NoReturn:
        raise _UsageError(self, message)


class VerbModule(Protocol):
    """Interface of a verb's module."""

    def add_parser(
        self, subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]"
    ) -> argparse.ArgumentParser: ...

    def run(self, args: argparse.Namespace) -> int | None: ...


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line; `argv` without the program's name. Returns the exit status."""
    _show_any_name()
    try:
        try:
            return _run(argv)
        finally:
            sys.stdout.flush()  # here and not at the interpreter's end, where nobody can answer for it
    except BrokenPipeError:
        if not _reader_is_gone():
            raise
        return _PIPE_CLOSED


def _show_any_name() -> None:
    """Let a console that lacks a character of a name show its code: a listing must not end at one name."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _run(argv: Sequence[str] | None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    chosen = next((word for word in arguments if not word.startswith("-")), None)
    try:
        parser, command = _build_parser(chosen)
    except VfixError as error:  # of an engine that cannot be loaded, or a page that is not installed
        return _refused(error, "--json" in arguments)
    try:
        args = parser.parse_args(arguments)
    except _UsageError as wrong:
        if "--json" in arguments:
            print(json.dumps(error_body("usage_error", f"{wrong}.")))
        argparse.ArgumentParser.error(wrong.parser, str(wrong))  # prints the usage and ends with status 2
    if command is None:
        parser.print_help(sys.stderr)
        return 2
    try:
        return command.run(args) or 0
    except VfixError as error:
        return _refused(error, getattr(args, "json", False))
    except KeyboardInterrupt:
        return 130


def _refused(error: VfixError, as_json: bool) -> int:
    if as_json:
        print(json.dumps(error_body(error_code(error), str(error))))
    print(f"vfix: {error}", file=sys.stderr)
    return 2


def _reader_is_gone() -> bool:
    """Whether stdout or stderr was closed by its reader, such as `head`; buffered output is dropped then.

    The system is asked, since an unbuffered stream does not store the error; Windows reports another one.
    """
    if sys.platform == "win32":
        return False
    gone = False
    for stream in (sys.stdout, sys.stderr):
        poll = select.poll()
        poll.register(stream, select.POLLOUT)
        if any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0)):
            gone = True
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
    return gone


def _build_parser(chosen: str | None) -> tuple[argparse.ArgumentParser, VerbModule | None]:
    """Parser of all verbs by name, with the options of the chosen one; only its module is imported."""
    parser: argparse.ArgumentParser = _Parser(
        prog="vfix",
        description=f"Surgical planner and simulator with virtual fixtures from the anatomy. {NOTICE}",
    )
    parser.add_argument("--version", action="version", version=f"vfix {__version__}")
    subparsers = parser.add_subparsers(metavar="VERB")
    command: VerbModule | None = None
    for verb in VERBS:
        if verb.name == chosen:
            if verb.needs_app and not has_app():
                raise need_app(f"vfix {verb.name}")
            command = cast(VerbModule, importlib.import_module(verb.module))
            command.add_parser(subparsers)
        else:
            subparsers.add_parser(verb.name, help=verb.summary)
    if chosen is not None and command is None and has_app() and (command := _of_documents(chosen)):
        command.add_parser(subparsers)
    return parser, command


def _of_documents(word: str) -> VerbModule | None:
    """The verb of a kind of document without a module of its own; loaded for a word that is no other verb."""
    if word in [verb.name for verb in VERBS]:
        return None
    from app.commands.documents import DocumentCommand
    from app.operations.verbs import lines

    kinds = lines().get(word, [])
    return DocumentCommand(word, kinds[0]) if kinds else None


if __name__ == "__main__":
    sys.exit(main())
