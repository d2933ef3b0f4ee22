"""Latest-only mailboxes in shared memory between the control process and its clients.

A mailbox holds one message: a sequence number, its length, its checksum and its bytes.
The writer makes the sequence odd while it writes; a reader that finds an odd or changed number, or a wrong
checksum, tries again, so that no partial message is ever accepted, regardless of memory reordering. The checksum
includes the sequence, so that it matches no other message and no empty one: packing a header clears it first, and a
message of no bytes with the checksum 0 would be accepted at that moment.
"""

from __future__ import annotations

import struct
import zlib
from multiprocessing.shared_memory import SharedMemory

from ..errors import ControlError

_HEADER = struct.Struct("<QQQ")
_TRIES = 1000


class Mailbox:
    """One writer, any number of readers."""

    def __init__(self, memory: SharedMemory, owner: bool):
        self._memory, self._owner = memory, owner
        self._sequence = 0

    @classmethod
    def create(cls, size: int) -> Mailbox:
        """Create a mailbox for messages of up to ``size`` bytes; its creator removes it with close()."""
        memory = SharedMemory(create=True, size=size + _HEADER.size)
        _HEADER.pack_into(_buffer(memory), 0, 0, 0, 0)
        return cls(memory, owner=True)

    @classmethod
    def attach(cls, name: str) -> Mailbox:
        """Open a mailbox that another process created."""
        return cls(SharedMemory(name=name), owner=False)

    @property
    def name(self) -> str:
        return self._memory.name

    def write(self, message: bytes) -> None:
        """Replace the message."""
        buffer = _buffer(self._memory)
        if len(message) + _HEADER.size > len(buffer):
            raise ControlError(f"a message of {len(message)} bytes does not fit its mailbox")
        self._sequence += 1
        _HEADER.pack_into(buffer, 0, 2 * self._sequence - 1, len(message), 0)
        buffer[_HEADER.size : _HEADER.size + len(message)] = message
        _HEADER.pack_into(buffer, 0, 2 * self._sequence, len(message), _checksum(message, 2 * self._sequence))

    def read(self, seen: int = 0) -> tuple[int, bytes] | None:
        """Return the newest message and its number, or None if it is not newer than ``seen``."""
        buffer = _buffer(self._memory)
        for _ in range(_TRIES):
            sequence, length, checksum = _HEADER.unpack_from(buffer, 0)
            if sequence == 0 or sequence == seen:
                return None
            if sequence % 2 or _HEADER.size + length > len(buffer):
                continue
            message = bytes(buffer[_HEADER.size : _HEADER.size + length])
            if _checksum(message, sequence) == checksum and _HEADER.unpack_from(buffer, 0)[0] == sequence:
                return int(sequence), message
        return None

    def close(self) -> None:
        """Release the memory; its creator also removes it."""
        self._memory.close()
        if self._owner:
            self._memory.unlink()


def _checksum(message: bytes, sequence: int) -> int:
    """Checksum of a message with its number, never 0, the value of a cleared header."""
    return zlib.crc32(message, sequence & 0xFFFFFFFF) | 1 << 32


def _buffer(memory: SharedMemory) -> memoryview:
    buffer = memory.buf
    if buffer is None:
        raise ControlError("the mailbox is closed")
    return buffer
