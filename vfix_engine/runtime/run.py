"""A run on disk: a manifest, the applied commands with the system's rows, and the events with their step numbers.

A folder NAME with

- ``manifest.json``: schema, world, clock ('driven': ``t`` of a row goes on where the period changes; runs of before
  have none, and the steps times the present period instead), control mode, device and preset, spec, hashes, settings,
  seed, versions, columns with units;
- ``spec.npz``: the spec's arrays;
- ``ticks.f64``: for every step the applied command, then the system's row, float64, little-endian;
- ``events.jsonl``: one event per line: a request or an adoption, and the number of ticks before it;
- ``end.json``: number of ticks, their digest, those of the files above, and the number of lost ticks;
- ``sideways.f64``, of a rigid tool in a head with a CT: for every step the distance by which air leads round the
  tissue that the tool passes. It is computed from the rows after the drive; no replayed value depends on it.

While it is written the folder is called NAME.part, and all but its last line and row are readable at any time.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError, VfixError
from .command import COMMAND_COLUMNS, COMMAND_SIZE, Command, command_from_row
from .control_mode import MIXED, Control, checked_control, first_labels, run_mode
from .manifest import SCHEMA, End, checked_end, checked_manifest
from .plain import from_plain, to_plain
from .requests import SetControl
from .system import Column, SystemSpec
from .versions import versions

NOTICE = "Not for clinical use"
PART = ".part"
MANIFEST, SPEC, TICKS, EVENTS, END = "manifest.json", "spec.npz", "ticks.f64", "events.jsonl", "end.json"
SIDEWAYS = "sideways.f64"
CLOSED = (MANIFEST, SPEC, EVENTS)  # their digests are in the end, beside that of the ticks
_BATCH = 1000  # ticks that a writer buffers


@dataclass(frozen=True)
class RunEvent:
    """An event after ``at`` ticks.

    kind: 'request' or 'adopt'; content: the request itself, or the result and the steps of the state that requested
        it.
    """

    at: int
    kind: str
    content: Any


@dataclass(frozen=True, eq=False)
class Run:
    """A run read from disk.

    manifest: see the module; arrays: of the spec; ticks: (n, 14 + w), command and row of each step.
    whole: the run was closed; lost: ticks that the recorder missed.
    sideways_mm: (n,) lateral distance by which air leads round the tissue that the tool passes, 0 if it passes none,
        inf beyond 15 mm, NaN where unknown; None if the run does not contain it.
    """

    manifest: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    ticks: Array
    events: tuple[RunEvent, ...]
    whole: bool
    lost: int
    sideways_mm: Array | None = None

    @property
    def mode(self) -> str | None:
        """Control mode, 'mixed' where it was changed on the way, None in a world that has none."""
        return run_mode(self.manifest)

    @property
    def rows(self) -> Array:
        """(n, w) the system's rows; their names and units are ``columns``."""
        return self.ticks[:, COMMAND_SIZE:]

    @property
    def tick_columns(self) -> tuple[Column, ...]:
        """Columns of ``ticks``."""
        return tuple(Column(*pair) for pair in self.manifest["columns"])

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of ``rows``."""
        return self.tick_columns[COMMAND_SIZE:]

    def column(self, name: str) -> Array:
        """(n,) one column of the rows. Raises InputError for an unknown name."""
        names = [column.name for column in self.columns]
        if name not in names:
            raise InputError(f"the run has no column '{name}'; it has {', '.join(names)}")
        return self.rows[:, names.index(name)]

    def command(self, index: int) -> Command:
        """Return the applied command of one step."""
        return command_from_row(self.ticks[index])

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read a run, or the complete part of one that was interrupted.

        Raises:
            InputError: the folder has no run, one of another schema, or one that was changed after its end.
        """
        folder = Path(folder)
        try:
            _check_files(folder)
            manifest = checked_manifest(json.loads((folder / MANIFEST).read_text(encoding="utf-8")))
            with np.load(folder / SPEC, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
            data = (folder / TICKS).read_bytes()
            lines = (folder / EVENTS).read_text(encoding="utf-8").splitlines(keepends=True)
            end = _ended(folder, data)
            beside = folder / SIDEWAYS
            sideways = np.frombuffer(beside.read_bytes(), dtype="<f8") if beside.exists() else None
            events = tuple(_event(json.loads(line)) for line in lines if line.endswith("\n"))
        except (OSError, ValueError, KeyError, TypeError, RecursionError, BadZipFile, VfixError) as error:
            raise InputError(f"'{folder.name}' is not a run that can be read: {error}") from error
        width = len(manifest["columns"])
        ticks = np.frombuffer(data[: len(data) // (8 * width) * 8 * width], dtype="<f8").reshape(-1, width)
        if end is not None and end.ticks not in (None, len(ticks)):
            raise InputError(f"'{folder.name}' is damaged: it has {len(ticks)} of {end.ticks} ticks")
        if sideways is not None and len(sideways) != len(ticks):
            raise InputError(f"'{folder.name}' is damaged: {SIDEWAYS} has {len(sideways)} of {len(ticks)} values")
        return cls(manifest, arrays, ticks, events, end is not None, 0 if end is None else end.lost, sideways)


class RunWriter:
    """Writes a run; also a driver's log, if the driver is in the same process.

    Args:
        folder: final name of the run, which it gets when it is closed; must not exist.
        spec, columns: of the system; seed: of the generator of the commands.
        control: mode and device; None: those of the spec's world. preset: its name, None for the default.

    Raises:
        InputError: the folder exists, or the world cannot be driven in that mode.
    """

    def __init__(
        self,
        folder: Path,
        spec: SystemSpec,
        columns: tuple[Column, ...],
        seed: int | None = None,
        control: Control | None = None,
        preset: str | None = None,
    ):
        self._folder, self._part = folder, folder.with_name(folder.name + PART)
        labels = first_labels(spec.world) if control is None else checked_control(spec.world, control).labels()
        if folder.exists() or self._part.exists():
            raise InputError(f"'{folder.name}' exists already; choose another name for the run")
        self._part.mkdir(parents=True)
        self._manifest = self._write_spec(spec, columns) | labels | {"preset": preset, "seed": seed}
        self._write_manifest()
        self._ticks = (self._part / TICKS).open("wb", buffering=0)
        self._events = (self._part / EVENTS).open("w", encoding="utf-8")
        self._digest, self._count = hashlib.sha256(), 0
        self.width = COMMAND_SIZE + len(columns)  # numbers per tick
        self._waiting: list[bytes] = []

    def _write_spec(self, spec: SystemSpec, columns: tuple[Column, ...]) -> dict[str, Any]:
        """Write the arrays of a spec; the manifest that goes with them."""
        try:
            values, arrays = spec.to_parts()
            not_written = ""
        except InputError as error:  # a user-defined fixture: replay needs the spec as an argument
            values, arrays, not_written = {}, {}, str(error)
        np.savez(self._part / SPEC, **arrays)  # type: ignore[arg-type]
        return {
            "schema": SCHEMA,
            "notice": NOTICE,
            "frame": "LPS",
            "world": spec.world,
            "spec": values,
            "spec_not_written": not_written,
            "clock": "driven",
            "hashes": {name: digest(array) for name, array in arrays.items()},
            "versions": versions(),
            "columns": [*COMMAND_COLUMNS, *columns],
        }

    def _write_manifest(self) -> None:
        """Write the manifest, whole at any time."""
        new = self._part / f"{MANIFEST}.new"
        new.write_text(json.dumps(self._manifest, indent=1), encoding="utf-8")
        new.replace(self._part / MANIFEST)

    def _relabel(self, at: int, control: Control) -> None:
        """The mode or the device was changed after ``at`` ticks."""
        labels = control.labels()
        if at and any(self._manifest[name] != label for name, label in labels.items()):
            labels = {"mode": MIXED, "device": None}
        self._manifest |= labels
        self._write_manifest()

    def tick(self, line: Array) -> None:
        """Write one step, buffered up to a thousand."""
        self._waiting.append(line.tobytes())
        if len(self._waiting) >= _BATCH:
            self.flush()

    def ticks(self, data: bytes) -> None:
        """Write whole rows, concatenated, at once."""
        self._ticks.write(data)
        self._digest.update(data)
        self._count += len(data) // (8 * self.width)

    def event(self, kind: str, content: Any) -> None:
        """Write an event after the ticks so far."""
        self.event_at(self._count + len(self._waiting), kind, content)

    def event_at(self, at: int, kind: str, content: Any) -> None:
        """Write an event after ``at`` ticks."""
        if isinstance(content, SetControl):
            checked_control(str(self._manifest["world"]), content.control)
            self._relabel(at, content.control)
        self._events.write(json.dumps({"at": at, "kind": kind, "content": to_plain(content)}) + "\n")
        self._events.flush()

    def flush(self) -> None:
        """Write the buffered ticks."""
        if self._waiting:
            self.ticks(b"".join(self._waiting))
            self._waiting.clear()

    def abandon(self) -> None:
        """Stop writing; what is written stays readable under the name NAME.part."""
        with suppress(OSError):
            self.flush()
        self._ticks.close()
        self._events.close()

    def close(self, lost: int = 0) -> None:
        """Complete the run and give it its final name."""
        self.flush()
        self._ticks.close()
        self._events.close()
        files = {name: _sha256(self._part / name) for name in CLOSED}
        end = {"ticks": self._count, "sha256": self._digest.hexdigest(), "lost": lost, "files": files}
        (self._part / END).write_text(json.dumps(end), encoding="utf-8")
        self._part.replace(self._folder)


def digest(array: NDArray[Any]) -> str:
    """SHA-256 of an array's dtype, shape and bytes."""
    head = f"{array.dtype.str}{array.shape}".encode()
    return hashlib.sha256(head + np.ascontiguousarray(array).tobytes()).hexdigest()


def _check_files(folder: Path) -> None:
    """Raise InputError for what is no file under the name of one: a named pipe would be waited for."""
    for name in (*CLOSED, TICKS, END, SIDEWAYS):
        if (folder / name).exists() and not (folder / name).is_file():
            raise InputError(f"{name} is no ordinary file")


def _ended(folder: Path, data: bytes) -> End | None:
    """The end of a run whose ticks are ``data``; None of one that was interrupted. Raises InputError for another's."""
    path = folder / END
    if not path.exists():
        return None
    end = checked_end(json.loads(path.read_text(encoding="utf-8")))
    if hashlib.sha256(data).hexdigest() != end.sha256:
        raise InputError(f"it is damaged: {TICKS} has changed since it was recorded")
    for name, recorded in end.files.items():
        if name in CLOSED and _sha256(folder / name) != recorded:
            raise InputError(f"it is damaged: {name} has changed since it was recorded")
    return end


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _event(line: dict[str, Any]) -> RunEvent:
    return RunEvent(int(line["at"]), str(line["kind"]), from_plain(line["content"]))
