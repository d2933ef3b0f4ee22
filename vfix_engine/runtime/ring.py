"""A ring buffer of rows in shared memory: unlike in a mailbox, every row is transferred, and no process waits.

The control process writes, others read independently. A row has its number and a checksum, so that a reader accepts no
partial row, regardless of memory reordering. If a reader falls behind by a whole ring, it loses rows and counts them.
After the rows follow the number of rows written and the names and units of their columns.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np

from ..arrays import Array
from .outbox import Outbox
from .system import Column

RING_BYTES = 1 << 22  # several seconds of a world's rows at 1 kHz
UNSENT = "unsent"  # kind of the event with the number of events that did not fit into the queue
_HEAD = struct.Struct("<QQ")  # number of the row from 1 on, checksum of its bytes
_COUNT = struct.Struct("<Q")
_COUNT_AT, _LAYOUT_AT = RING_BYTES, RING_BYTES + _COUNT.size  # the layout: number of bytes of JSON, then the JSON
LAYOUT_BYTES = 1 << 18  # names and units of the columns of the longest snake


class Ring:
    """Rows of ``width`` numbers, at the writer's or a reader's end. ``lost``: rows overwritten before being read."""

    def __init__(self, memory: SharedMemory, width: int):
        self._memory, self._size = memory, 8 * width + _HEAD.size
        self._rows = RING_BYTES // self._size
        self._next = 1
        self.lost = 0

    @staticmethod
    def memory() -> SharedMemory:
        """Allocate cleared memory for a ring; the caller unlinks it."""
        size = RING_BYTES + 2 * _COUNT.size + LAYOUT_BYTES
        memory = SharedMemory(create=True, size=size)
        _buffer(memory)[:size] = bytes(size)
        return memory

    def skip(self) -> None:
        """Skip the rows written so far."""
        self._next = written_rows(self._memory) + 1

    def write(self, row: Array) -> None:
        """Append a row (width,)."""
        buffer, start = _buffer(self._memory), self._place(self._next)
        data = row.tobytes()
        _HEAD.pack_into(buffer, start, 0, 0)
        buffer[start + _HEAD.size : start + self._size] = data
        _HEAD.pack_into(buffer, start, self._next, zlib.crc32(data, self._next & 0xFFFFFFFF))
        _COUNT.pack_into(buffer, _COUNT_AT, self._next)
        self._next += 1

    def read(self) -> bytes:
        """Return all complete rows since the last call, concatenated; ``lost`` counts those that were overwritten."""
        buffer, found = _buffer(self._memory), []
        while True:
            start = self._place(self._next)
            number, checksum = _HEAD.unpack_from(buffer, start)
            if number < self._next:
                break
            if number > self._next:  # overwritten: continue with the oldest available row
                oldest = number - self._rows + 1
                self.lost, self._next = self.lost + oldest - self._next, oldest
                continue
            data = bytes(buffer[start + _HEAD.size : start + self._size])
            if zlib.crc32(data, number & 0xFFFFFFFF) != checksum:
                break  # this row is being written
            found.append(data)
            self._next += 1
        return b"".join(found)

    def _place(self, number: int) -> int:
        return (number % self._rows) * self._size


def written_rows(memory: SharedMemory) -> int:
    """Number of rows written to a ring so far."""
    return int(_COUNT.unpack_from(_buffer(memory), _COUNT_AT)[0])


def write_layout(memory: SharedMemory, columns: Sequence[tuple[str, str]]) -> None:
    """Write names and units of the columns; once, before the first row."""
    data = json.dumps([list(column) for column in columns]).encode()
    if len(data) > LAYOUT_BYTES:
        raise ValueError(f"{len(columns)} columns are more than a ring can name")
    buffer, start = _buffer(memory), _LAYOUT_AT + _COUNT.size
    buffer[start : start + len(data)] = data
    _COUNT.pack_into(buffer, _LAYOUT_AT, len(data))


class RowReader:
    """Reads every row of a ring that is written from now on; for one thread.

    columns: names and units of a row. lost: rows overwritten between two calls of ``read``.
    ended: the writer has ended, and no more rows follow.
    """

    def __init__(self, name: str):
        """Raises ValueError if the writer has not started."""
        self._memory = SharedMemory(name=name)
        length = int(_COUNT.unpack_from(_buffer(self._memory), _LAYOUT_AT)[0])
        if not length:
            self._memory.close()
            raise ValueError("nothing is written yet: wait until the process is ready")
        start = _LAYOUT_AT + _COUNT.size
        layout = json.loads(bytes(_buffer(self._memory)[start : start + length]))
        self.columns = tuple(Column(*pair) for pair in layout)
        self._ring = Ring(self._memory, len(self.columns))
        self._ring.skip()
        self.ended = False

    @property
    def lost(self) -> int:
        """Number of rows lost so far."""
        return self._ring.lost

    def read(self) -> Array:
        """Return all rows since the last call (n, w), one per step; read-only."""
        return np.frombuffer(self._ring.read(), dtype="<f8").reshape(-1, len(self.columns))

    def close(self) -> None:
        """Release the memory."""
        self._memory.close()


class RingLog:
    """A driver's log in the control process: rows to a ring, events to a pipe, both with the number of ticks.

    pipe: None without a recorder.
    """

    def __init__(self, ring: Ring, pipe: Connection | None):
        self._ring, self._ticks = ring, 0
        self._events = None if pipe is None else Outbox(pipe)
        self._unsent = 0

    def tick(self, line: Array) -> None:
        self._ring.write(line)
        self._ticks += 1

    def event(self, kind: str, content: Any) -> None:
        if self._events is not None:
            self._say_unsent(self._events)
            if self._unsent or not self._events.put((self._ticks, kind, content)):
                self._unsent += 1

    def flush(self, seconds: float) -> bool:
        """Wait until every event is sent."""
        if self._events is None:
            return True
        sent = self._events.flush(seconds)
        self._say_unsent(self._events)
        return self._events.flush(seconds) and sent

    def _say_unsent(self, events: Outbox) -> None:
        """Send the number of dropped events once a recorder that had stopped reading reads again."""
        if self._unsent and events.put((self._ticks, UNSENT, self._unsent)):
            self._unsent = 0


def _buffer(memory: SharedMemory) -> memoryview:
    buffer = memory.buf
    if buffer is None:
        raise ValueError("the ring is closed")
    return buffer
