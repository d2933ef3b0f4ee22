"""Snapshots and hand inputs survive the mailboxes as they are."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import msgspec
import numpy as np
import pytest

from vfix_engine.robots.snake import MOST_LINKS, SnakeModel
from vfix_engine.runtime.hand import INPUT_BYTES, HandInput
from vfix_engine.runtime.mailbox import Mailbox
from vfix_engine.runtime.snapshot import Blocker
from vfix_engine.runtime.virtual_coupling import Hold
from vfix_engine.runtime.wire import SNAPSHOT_BYTES, SnapshotReader, snapshot_bytes, snapshot_to_bytes
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot, Timing
from vfix_engine.worlds.snake import SnakeSnapshot
from vfix_engine.worlds.snake.spec import LumenContours, SnakeSystemSpec

snapshot_from_bytes = SnapshotReader(RigidSnapshot).read


def sample() -> RigidSnapshot:
    """Every field with a value of its own, NumPy's scalars among them."""
    values: dict[str, object] = {}
    for number, field in enumerate(fields(RigidSnapshot), 1):
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
    return RigidSnapshot(**values)  # type: ignore[arg-type]


def test_a_snapshot_comes_back_whole() -> None:
    one = sample()
    data = snapshot_to_bytes(one)
    assert len(data) < SNAPSHOT_BYTES // 4
    again = snapshot_from_bytes(data)
    for field in fields(RigidSnapshot):
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


@pytest.mark.parametrize("links", [30, 320, MOST_LINKS])
def test_there_is_room_for_every_link_of_a_snake(links: int) -> None:
    """Numbers at random take nine bytes each, as any number of a real drive does."""
    snake, random = SnakeModel(links), np.random.default_rng(links)
    contours = LumenContours(np.zeros((4, 3)), np.ones((4, 3)))
    blocker = Blocker("bound", "w" * 80, "link 1000", 1.0, random.normal(size=3), "word " * 100)
    snapshot = SnakeSnapshot(
        t=1.5, q=random.normal(size=snake.dof), capsules=random.normal(size=(links, 7)), tip=random.normal(size=3),
        camera=random.normal(size=(4, 4)), outcome="held", steps=2**40, blockers=(blocker,) * 8,
        forces=random.normal(size=3), progress_mm=1.5, length_mm=2.5, mode="looking", doing="straighten", bend=0.5,
        straight=False, can_look=True, links_inside=links, deviations=random.normal(size=links),
        bounds=random.normal(size=links), resistance=random.normal(size=2), guidance=random.normal(size=2),
        tissue_age_s=0.1, following=True, looked_deg=random.normal(size=8), arm="certified", hand_joint=1,
        control_bends=random.normal(size=(8, 6, 3)),
    )  # fmt: skip
    room = snapshot_bytes(SnakeSystemSpec(contours, snake).snapshot_numbers)
    mailbox = Mailbox.create(room)
    mailbox.write(snapshot_to_bytes(snapshot))
    _, data = mailbox.read() or (0, b"")
    mailbox.close()
    np.testing.assert_array_equal(SnapshotReader(SnakeSnapshot).read(data).q, snapshot.q)
