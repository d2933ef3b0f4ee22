"""The checksum of OpenIGTLink: CRC-64 of ECMA-182, polynomial 42F0E1EBA9EA3693, not reflected, beginning with 0.

Source: http://openigtlink.org/protocols/v2_header.html

A long body is cut into rows that are divided side by side, and their remainders are joined: the remainder of two rows
is that of the first with a row of zeros behind it, plus that of the second. Zeros in front change nothing.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

_POLYNOMIAL = 0x42F0E1EBA9EA3693
_MASK = (1 << 64) - 1
_ROW = 256  # [byte]
_LONG = 16 * _ROW  # [byte], from which rows are faster


def _entry(value: int) -> int:
    register = value << 56
    for _ in range(8):
        register = (register << 1) ^ (_POLYNOMIAL if register >> 63 else 0)
        register &= _MASK
    return register


_TABLE = tuple(_entry(value) for value in range(256))
_ARRAY = np.array(_TABLE, dtype=np.uint64)


def crc64(data: bytes) -> int:
    """Checksum of a message's body."""
    if len(data) >= _LONG:
        return _of_rows(data)
    register = 0
    for value in data:
        register = ((register << 8) & _MASK) ^ _TABLE[(register >> 56) ^ value]
    return register


def _of_rows(data: bytes) -> int:
    padded = data.rjust(-(-len(data) // _ROW) * _ROW, b"\0")
    remainders = _remainders(np.frombuffer(padded, dtype=np.uint8).reshape(-1, _ROW))
    first, *others = _followed_by_a_row()
    register = 0
    for remainder in remainders.tolist():
        moved = first[register >> 56]
        for table, shift in zip(others, range(48, -1, -8), strict=True):
            moved ^= table[(register >> shift) & 0xFF]
        register = moved ^ remainder
    return register


def _remainders(rows: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Remainder (n,) of each of the rows (n, bytes)."""
    registers = np.zeros(len(rows), dtype=np.uint64)
    for column in np.ascontiguousarray(rows.T):
        registers = (registers << np.uint64(8)) ^ _ARRAY[(registers >> np.uint64(56)) ^ column]
    return registers


@cache
def _followed_by_a_row() -> list[list[int]]:
    """Of each byte of a remainder, the highest first, and each value of it: the remainder with a row of zeros behind.

    A remainder weighs as much as its 8 bytes at the beginning of that row would.
    """
    rows = np.zeros((8, 256, _ROW), dtype=np.uint8)
    for at in range(8):
        rows[at, :, at] = np.arange(256)
    tables: list[list[int]] = _remainders(rows.reshape(-1, _ROW)).reshape(8, 256).tolist()
    return tables
