"""The recorder of a control process's run: rows through a ring, events through a pipe, files written elsewhere.

The control process never touches a file. Whatever ends the recording, such as a full disk, is reported, and costs no
tick.
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
from .ring import UNSENT, Ring, RingLog, write_layout
from .run import RunWriter
from .system import Column, SystemSpec

LOOK_S = 0.05  # between two looks into the ring, which holds seconds


@dataclass(frozen=True)
class FarEnd:
    """What the control process writes to; it crosses when the process is started. pipe: to a recorder, if any."""

    ring: str
    pipe: Connection | None

    def attach(self, columns: tuple[Column, ...]) -> RingLog:
        """The driver's log; tells whoever reads first what the rows are."""
        memory = SharedMemory(name=self.ring)
        write_layout(memory, [*COMMAND_COLUMNS, *columns])
        if self.pipe is not None:
            self.pipe.send((0, "columns", columns))
        return RingLog(Ring(memory, COMMAND_SIZE + len(columns)), self.pipe)


class RunRecorder:
    """Writes a run from a thread of the process that watches; ``memory`` is the ring's.

    failed: why the recording ended early, '' where it did not. lost: steps that it came too late for.
    thread: the one that writes.
    """

    def __init__(self, folder: Path, spec: SystemSpec, ends: tuple[Connection, Connection], memory: SharedMemory):
        self._folder, self._spec, self._memory = folder, spec, memory
        self._near, self.far = ends
        self._ring: Ring | None = None
        self._writer: RunWriter | None = None
        self._over = threading.Event()
        self.thread = threading.Thread(target=self._run, name="vfix-recorder", daemon=True)
        self.failed = ""

    @property
    def lost(self) -> int:
        """So far."""
        return 0 if self._ring is None else self._ring.lost

    def start(self) -> None:
        """Begin; the far end's pipe is the process's now."""
        self.far.close()
        self.thread.start()

    def close(self) -> None:
        """The process has ended: write the rest, and give the run its name."""
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
        except Exception as error:  # what was written so far stays where it is, under its name of a part
            self.failed = f"the run cannot be written: {_reason(error)}"
            if self._writer is not None:
                with suppress(Exception):  # told already
                    self._writer.abandon()

    def _look(self) -> None:
        """What has come since the last look; events first, since their rows may come with them."""
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
            self._writer = RunWriter(self._folder, self._spec, columns)
            self._ring = Ring(self._memory, self._writer.width)
        elif kind == UNSENT:
            raise ControlError(f"{content} events came faster than they could be written")
        elif self._writer is not None:
            self._writer.event_at(at, kind, content)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error) if isinstance(error, VfixError) else f"an unexpected error ({type(error).__name__})"
