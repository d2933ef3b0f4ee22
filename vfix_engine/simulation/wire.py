"""Snapshots and hand inputs as bytes for the mailboxes."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .snapshot import Snapshot, Timing

SNAPSHOT_BYTES = 16_384
INPUT_BYTES = 512


@dataclass(frozen=True)
class HandInput:
    """The newest state of the hand: grip (3) in LPS mm or None, number of heartbeats and moves so far, keys held."""

    grip: tuple[float, float, float] | None = None
    pressed: bool = False
    moves: int = 0
    beats: int = 0
    drive: int = 0
    twist: int = 0

    def to_bytes(self) -> bytes:
        return json.dumps(asdict(self)).encode()

    @classmethod
    def from_bytes(cls, data: bytes) -> HandInput:
        fields = json.loads(data)
        grip = fields["grip"]
        return cls(**{**fields, "grip": None if grip is None else tuple(grip)})


def snapshot_to_bytes(snapshot: Snapshot) -> bytes:
    """JSON of a snapshot; NaN travels as null."""
    return json.dumps({name: _plain(value) for name, value in vars(snapshot).items()}).encode()


def snapshot_from_bytes(data: bytes) -> Snapshot:
    fields = json.loads(data)
    for name in _ARRAYS:
        fields[name] = np.array(fields[name], dtype=float)
    point = fields["blocking_point"]
    fields["blocking_point"] = None if point is None else np.array(point, dtype=float)
    fields["active"] = tuple(fields["active"])
    fields["timing"] = Timing(**fields["timing"])
    if fields["target_error_mm"] is None:
        fields["target_error_mm"] = math.nan
    return Snapshot(**fields)


_ARRAYS = (
    "q",
    "segments_start",
    "segments_end",
    "radius",
    "tip",
    "grip",
    "virtual_point",
    "force",
    "torque",
)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Timing):
        return asdict(value)
    if isinstance(value, float) and math.isnan(value):
        return None
    return value
