"""What a run's manifest and end have: checked where a run is read, so that a damaged or foreign file is refused."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

import msgspec

from ..errors import InputError
from .command import COMMAND_COLUMNS, COMMAND_SIZE
from .control_mode import run_mode

SCHEMA = "vfix-run/1"

T = TypeVar("T")
Count = Annotated[int, msgspec.Meta(ge=0)]


class Manifest(msgspec.Struct):
    """The fields that readers use, with the defaults of those that a file may lack; see ``runtime.run``."""

    world: str
    columns: list[tuple[str, str]]
    spec: dict[str, Any] = {}
    spec_not_written: str = ""
    versions: dict[str, str] = {}
    seed: int | None = None
    mode: str | None = None
    device: str | None = None
    preset: str | None = None


class End(msgspec.Struct):
    """The fields of ``end.json``. ticks: of the run; sha256: of ``ticks.f64``; lost: steps that were not recorded.

    files: SHA-256 of the other files that were closed with it, by name; empty in runs of before.
    """

    sha256: str
    ticks: Count | None = None
    lost: Count = 0
    files: dict[str, str] = {}


_DEFAULTS = ("spec", "spec_not_written", "versions", "seed")


def checked_manifest(data: object) -> dict[str, Any]:
    """The manifest of a run, with its own values and the defaults of what it lacks.

    Raises:
        InputError: of another schema, with a field of another type, with other columns of commands than this schema
            has, with two columns of one name, or with a mode that its world does not have.
    """
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise InputError(f"it is no run of the schema {SCHEMA}")
    known = _converted(data, Manifest, "its manifest")
    names = [name for name, _ in known.columns]
    if names[:COMMAND_SIZE] != [name for name, _ in COMMAND_COLUMNS]:
        raise InputError(f"its manifest's first {COMMAND_SIZE} columns are not those of a command")
    own = names[COMMAND_SIZE:]
    if len(set(own)) < len(own):
        raise InputError("its manifest has two columns of one name")
    run_mode(data)
    return {name: getattr(known, name) for name in _DEFAULTS} | data


def checked_end(data: object) -> End:
    """The end of a run. Raises InputError."""
    return _converted(data, End, "its end")


def _converted(data: object, kind: type[T], what: str) -> T:
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        raise InputError(f"{what} is damaged: {error}") from None
