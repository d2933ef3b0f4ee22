"""Snapshots and hand inputs as bytes for the mailboxes: MessagePack, which costs a tick a few microseconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from ..runtime.handle import NOBODY, Hold
from .snapshot import Snapshot

SNAPSHOT_BYTES = 16_384
INPUT_BYTES = 512


@dataclass(frozen=True)
class HandInput:
    """The newest state of the hand: grip (3) in LPS mm, its moves so far, keys held, and the hold on either."""

    grip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moves: int = 0
    drive: int = 0
    twist: int = 0
    hand: Hold = NOBODY
    keys: Hold = NOBODY

    def to_bytes(self) -> bytes:
        """Packed for the shared memory, as ``from_bytes`` reads it."""
        return _ENCODER.encode(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> HandInput:
        """What ``to_bytes`` packed; msgspec's errors where it is something else."""
        return _HAND.decode(data)


def snapshot_to_bytes(snapshot: Snapshot) -> bytes:
    """Every field of a snapshot; arrays travel as nested lists, NaN as itself."""
    return _ENCODER.encode(snapshot)


def snapshot_from_bytes(data: bytes) -> Snapshot:
    """The inverse, every field of its declared type."""
    return _SNAPSHOT.decode(data)


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise NotImplementedError(f"a snapshot has no place for a {type(value).__name__}")


def _array(kind: Any, value: Any) -> Any:
    """The arrays of a snapshot are all of floats."""
    return np.array(value, dtype=np.float64)


_ENCODER = msgspec.msgpack.Encoder(enc_hook=_plain)
_HAND = msgspec.msgpack.Decoder(HandInput)
_SNAPSHOT = msgspec.msgpack.Decoder(Snapshot, dec_hook=_array)
