"""Serialisation of snapshots for the mailbox: MessagePack, arrays as nested lists."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import msgspec
import numpy as np

from .snapshot import Snapshot

SNAPSHOT_BYTES = 32_768  # upper bound of a snapshot without the arrays that grow with a robot: texts and blockers
NUMBER_BYTES = 10  # upper bound per number: nine, and its part of the headers of rows
T = TypeVar("T", bound=Snapshot)


def snapshot_bytes(numbers: int) -> int:
    """Largest size of a snapshot with that many numbers in its arrays, see ``SystemSpec.snapshot_numbers``."""
    return SNAPSHOT_BYTES + NUMBER_BYTES * numbers


class SnapshotReader(Generic[T]):
    """Decoder of the snapshots of one world."""

    def __init__(self, kind: type[T]):
        self._decoder = msgspec.msgpack.Decoder(kind, dec_hook=_array)

    def read(self, data: bytes) -> T:
        """Inverse of ``snapshot_to_bytes``, with fields of their declared types; msgspec's errors for other data."""
        return self._decoder.decode(data)


def snapshot_to_bytes(snapshot: Snapshot) -> bytes:
    """Serialise every field of a snapshot of any world; NaN is preserved."""
    return _ENCODER.encode(snapshot)


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise NotImplementedError(f"a snapshot has no place for a {type(value).__name__}")


def _array(kind: Any, value: Any) -> Any:
    """Convert an array of a snapshot; all of them have floats."""
    return np.array(value, dtype=np.float64)


_ENCODER = msgspec.msgpack.Encoder(enc_hook=_plain)
