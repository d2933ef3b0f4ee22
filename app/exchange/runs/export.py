"""Writes a run to a file of the kind that its suffix names."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.exchange.runs.table import about, table_of
from app.extras import need_extra
from vfix_engine.errors import InputError
from vfix_engine.runtime.run import Run

if TYPE_CHECKING:  # a folder is exported without a store
    from app.drives.live_comments import RunComment

_BLOCK = 10_000  # rows

Writer = Callable[[Run, dict[str, Any], Path], None]  # the second: what the file says of itself, see `about`


def check_suffix(suffix: str) -> None:
    """Raise ExtraMissing where the packages that write such a file are not installed."""
    extra, modules = EXTRAS.get(suffix, ("", ()))
    if any(find_spec(name) is None for name in modules):
        raise need_extra(f"An export to {suffix}", extra)


def check_target(path: Path) -> None:
    """Refuse a file that no export can be written to, before a drive whose recording would be lost.

    Raises InputError, or ExtraMissing as `check_suffix`.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise InputError(f"an export's file ends in {', '.join(WRITERS)}, not {path.name!r:.80}")
    check_suffix(suffix)
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise InputError(f"the recording {path} cannot be written: {path.parent} is no folder that can be written to")


def export_run(run: Run, path: Path, run_id: str | None = None, comments: Sequence[RunComment] = ()) -> None:
    """Write a run; the file gets its name when it is complete. run_id, comments: of a stored run.

    Raises as `check_target`, and InputError where the file cannot be written.
    """
    check_target(path)
    part = path.with_name(f"{path.name}.part")
    try:
        WRITERS[path.suffix.lower()](run, about(run, run_id, comments), part)
        part.replace(path)
        if _beside(part).exists():
            _beside(part).replace(_beside(path))
    except OSError as error:
        raise InputError(f"the recording {path} cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
        _beside(part).unlink(missing_ok=True)


def _write_csv(run: Run, told: dict[str, Any], path: Path) -> None:
    """A heading of names with units, then a line a step; FILE.about.json beside it says the rest."""
    table = table_of(run)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table.headings)
        for first in range(0, len(table.rows), _BLOCK):  # as Python's floats a long run would be gigabytes
            writer.writerows(table.rows[first : first + _BLOCK].tolist())
    _beside(path).write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def _beside(path: Path) -> Path:
    """What is written beside a file that has no place for it; of FILE.part FILE.about.json.part."""
    name = path.name.removesuffix(".part")
    return path.with_name(f"{name}.about.json{path.name.removeprefix(name)}")


def _write_parquet(run: Run, told: dict[str, Any], path: Path) -> None:
    from app.exchange.runs.parquet_file import write_parquet  # here: it needs an extra

    write_parquet(run, told, path)


def _write_mcap(run: Run, told: dict[str, Any], path: Path) -> None:
    from app.exchange.runs.mcap_file import write_mcap  # here: it needs an extra

    write_mcap(run, told, path)


WRITERS: dict[str, Writer] = {".csv": _write_csv, ".parquet": _write_parquet, ".mcap": _write_mcap}
EXTRAS = {
    ".parquet": ("tables", ("pyarrow",)),
    ".mcap": ("mcap", ("mcap", "google.protobuf", "foxglove_schemas_protobuf")),
}  # by suffix: the extra that brings the packages, and their names to import
