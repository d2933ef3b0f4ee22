"""Snapshots and hand inputs survive the mailboxes as they are."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import msgspec
import numpy as np
import pytest

from vfix_engine.runtime.hand import INPUT_BYTES, HandInput
from vfix_engine.runtime.virtual_coupling import Hold
from vfix_engine.runtime.wire import SNAPSHOT_BYTES, SnapshotReader, snapshot_to_bytes
from vfix_engine.simulation.snapshot import Snapshot, Timing

snapshot_from_bytes = SnapshotReader(Snapshot).read


def sample() -> Snapshot:
    """Every field with a value of its own, NumPy's scalars among them."""
    values: dict[str, object] = {}
    for number, field in enumerate(fields(Snapshot), 1):
        kind = str(field.type)
        if kind == "Array":
            values[field.name] = np.arange(6.0).reshape(2, 3) + number
        elif kind == "Array | None":
            values[field.name] = np.array([1.0, 2.0, number])
        elif kind == "tuple[str, ...]":
            values[field.name] = ("bone", "joint range")
        elif kind in ("str", "bool", "int", "float"):
            values[field.name] = {"str": f"«{number}»", "bool": True, "int": number, "float": np.float64(number)}[kind]
    values["blockers"] = ()
    values["timing"] = Timing(1000.0, 100.0, 200.0, 1.0, 2.0, 3, True, "why")
    return Snapshot(**values)  # type: ignore[arg-type]


def test_a_snapshot_comes_back_whole() -> None:
    one = sample()
    data = snapshot_to_bytes(one)
    assert len(data) < SNAPSHOT_BYTES // 4
    again = snapshot_from_bytes(data)
    for field in fields(Snapshot):
        before, after = getattr(one, field.name), getattr(again, field.name)
        if isinstance(before, np.ndarray):
            assert isinstance(after, np.ndarray)
            assert after.dtype == np.float64
            np.testing.assert_array_equal(after, before)
        else:
            assert after == before, field.name


def test_what_does_not_exist_comes_back_so() -> None:
    again = snapshot_from_bytes(snapshot_to_bytes(replace(sample(), target_error_mm=math.nan, blocking_point=None)))
    assert math.isnan(again.target_error_mm)
    assert again.blocking_point is None


def test_a_hand_comes_back() -> None:
    for hand in (HandInput(), HandInput((1.5, -2.0, 3e5), 2**40, -1, 1, Hold().press(7.5), Hold(1.0, 2.0, 3.0))):
        assert len(hand.to_bytes()) < INPUT_BYTES
        assert HandInput.from_bytes(hand.to_bytes()) == hand


def test_what_is_no_snapshot_is_not_read_as_one() -> None:
    with pytest.raises(msgspec.DecodeError):
        snapshot_from_bytes(HandInput().to_bytes())
    with pytest.raises(NotImplementedError):
        snapshot_to_bytes(replace(sample(), reason=object()))  # type: ignore[arg-type]
