"""A ring of rows in shared memory: every row crosses, unlike a mailbox's latest message, and nobody waits.

The control process writes, one other process reads. A row carries its number and a checksum, so that a reader takes no
half row whatever the processor reorders. Where the reader falls behind by a whole ring, rows are lost, counted and
told.
"""

from __future__ import annotations

import struct
import zlib
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .outbox import Outbox

Array = NDArray[np.float64]

RING_BYTES = 1 << 22  # several seconds of a world's rows at 1 kHz
_HEAD = struct.Struct("<QQ")  # number of the row from 1 on, checksum of its bytes


class Ring:
    """Rows of ``width`` numbers; one writer, one reader. ``lost``: how many the reader came too late for."""

    def __init__(self, memory: SharedMemory, width: int):
        self._memory, self._size = memory, 8 * width + _HEAD.size
        self._rows = RING_BYTES // self._size
        self._next = 1
        self.lost = 0

    @staticmethod
    def memory() -> SharedMemory:
        """Cleared memory for a ring; its maker unlinks it."""
        memory = SharedMemory(create=True, size=RING_BYTES)
        _buffer(memory)[:RING_BYTES] = bytes(RING_BYTES)
        return memory

    def write(self, row: Array) -> None:
        """Append a row (width,)."""
        buffer, start = _buffer(self._memory), self._place(self._next)
        data = row.tobytes()
        _HEAD.pack_into(buffer, start, 0, 0)
        buffer[start + _HEAD.size : start + self._size] = data
        _HEAD.pack_into(buffer, start, self._next, zlib.crc32(data, self._next & 0xFFFFFFFF))
        self._next += 1

    def read(self) -> bytes:
        """All whole rows since the last call, one behind the other; ``lost`` counts those that were overwritten."""
        buffer, found = _buffer(self._memory), []
        while True:
            start = self._place(self._next)
            number, checksum = _HEAD.unpack_from(buffer, start)
            if number < self._next:
                break
            if number > self._next:  # overwritten: go on with the oldest row that is still there
                gone = number - self._next
                self.lost, self._next = self.lost + gone, self._next + gone
                continue
            data = bytes(buffer[start + _HEAD.size : start + self._size])
            if zlib.crc32(data, number & 0xFFFFFFFF) != checksum:
                break  # being written
            found.append(data)
            self._next += 1
        return b"".join(found)

    def _place(self, number: int) -> int:
        return (number % self._rows) * self._size


class RingLog:
    """A driver's log in the control process: rows into a ring, events into a pipe, both with the number of ticks."""

    def __init__(self, ring: Ring, pipe: Connection):
        self._ring, self._events, self._ticks = ring, Outbox(pipe), 0

    def tick(self, line: Array) -> None:
        self._ring.write(line)
        self._ticks += 1

    def event(self, kind: str, content: Any) -> None:
        self._events.put((self._ticks, kind, content))

    def flush(self, seconds: float) -> bool:
        """Wait until every event is sent."""
        return self._events.flush(seconds)


def _buffer(memory: SharedMemory) -> memoryview:
    buffer = memory.buf
    if buffer is None:
        raise ValueError("the ring is closed")
    return buffer
