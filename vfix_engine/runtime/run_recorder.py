"""Recorder of a control process's run: rows through a ring, events through a pipe, files written by another process.

The control process never accesses a file. Any failure of the recording, such as a full disk, is reported, and delays
no tick.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

from ..errors import ControlError, VfixError
from .command import COMMAND_COLUMNS, COMMAND_SIZE
from .control_mode import Control
from .ring import UNSENT, Ring, RingLog, write_layout
from .run import RunWriter
from .system import Column, SystemSpec

LOOK_S = 0.05  # polling period of the ring, which holds seconds


@dataclass(frozen=True)
class FarEnd:
    """The control process's end, passed to it at its start. pipe: to a recorder, if any."""

    ring: str
    pipe: Connection | None

    def attach(self, columns: tuple[Column, ...]) -> RingLog:
        """Return the driver's log, after publishing the columns of the rows to all readers."""
        memory = SharedMemory(name=self.ring)
        write_layout(memory, [*COMMAND_COLUMNS, *columns])
        if self.pipe is not None:
            self.pipe.send((0, "columns", columns))
        return RingLog(Ring(memory, COMMAND_SIZE + len(columns)), self.pipe)


class RunRecorder:
    """Writes a run from a thread of the observing process; ``memory`` is the ring's.

    control, preset: as of ``RunWriter``.
    failed: reason why the recording ended early, '' if it did not. lost: steps that were overwritten before it read
        them.
    thread: the writing thread.
    """

    def __init__(
        self,
        folder: Path,
        spec: SystemSpec,
        ends: tuple[Connection, Connection],
        memory: SharedMemory,
        control: Control | None = None,
        preset: str | None = None,
    ):
        self._folder, self._spec, self._memory = folder, spec, memory
        self._control, self._preset = control, preset
        self._near, self.far = ends
        self._ring: Ring | None = None
        self._writer: RunWriter | None = None
        self._over = threading.Event()
        self.thread = threading.Thread(target=self._run, name="vfix-recorder", daemon=True)
        self.failed = ""

    @property
    def lost(self) -> int:
        """Number of steps lost so far."""
        return 0 if self._ring is None else self._ring.lost

    def start(self) -> None:
        """Start; the pipe's far end now belongs to the control process."""
        self.far.close()
        self.thread.start()

    def close(self) -> None:
        """Write the rest after the process has ended, and give the run its final name."""
        self._over.set()
        if self.thread.ident is not None:
            self.thread.join()
        self._near.close()
        self.far.close()

    def _run(self) -> None:
        try:
            while not self._over.wait(LOOK_S):
                self._look()
            self._look()
            if self._writer is not None:
                self._writer.close(self.lost)
        except Exception as error:  # what is written so far keeps its name NAME.part
            self.failed = f"the run cannot be written: {_reason(error)}"
            if self._writer is not None:
                with suppress(Exception):  # already reported
                    self._writer.abandon()

    def _look(self) -> None:
        """Write everything new; events first, since their rows may be in the same batch."""
        try:
            while self._near.poll():
                self._hear(*self._near.recv())
        except EOFError:  # the process has ended; its rows are still in the ring
            pass
        if self._ring is not None and self._writer is not None:
            self._writer.ticks(self._ring.read())

    def _hear(self, at: int, kind: str, content: Any) -> None:
        if kind == "columns":
            columns = tuple(Column(*pair) for pair in content)
            self._writer = RunWriter(self._folder, self._spec, columns, None, self._control, self._preset)
            self._ring = Ring(self._memory, self._writer.width)
        elif kind == UNSENT:
            raise ControlError(f"{content} events came faster than they could be written")
        elif self._writer is not None:
            self._writer.event_at(at, kind, content)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error) if isinstance(error, VfixError) else f"an unexpected error ({type(error).__name__})"
