"""Snapshots as bytes for the mailbox: MessagePack, arrays as nested lists."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import msgspec
import numpy as np

from .snapshot import Snapshot

SNAPSHOT_BYTES = 32_768  # of a snapshot at most, but for the numbers that grow with a robot: words and blockers mainly
NUMBER_BYTES = 10  # of a number at most: nine, and its share of the heads of rows
T = TypeVar("T", bound=Snapshot)


def snapshot_bytes(numbers: int) -> int:
    """Room for a snapshot with so many numbers in its arrays, see ``SystemSpec.snapshot_numbers``."""
    return SNAPSHOT_BYTES + NUMBER_BYTES * numbers


class SnapshotReader(Generic[T]):
    """Reads the snapshots of one world."""

    def __init__(self, kind: type[T]):
        self._decoder = msgspec.msgpack.Decoder(kind, dec_hook=_array)

    def read(self, data: bytes) -> T:
        """The inverse of ``snapshot_to_bytes``, fields of their declared types; msgspec's errors for anything else."""
        return self._decoder.decode(data)


def snapshot_to_bytes(snapshot: Snapshot) -> bytes:
    """Every field of a snapshot of any world; NaN travels as itself."""
    return _ENCODER.encode(snapshot)


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise NotImplementedError(f"a snapshot has no place for a {type(value).__name__}")


def _array(kind: Any, value: Any) -> Any:
    """The arrays of a snapshot are all of floats."""
    return np.array(value, dtype=np.float64)


_ENCODER = msgspec.msgpack.Encoder(enc_hook=_plain)
