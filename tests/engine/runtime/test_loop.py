"""The loop of the control process, tick by tick."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.engine.tiny import TinySettings, TinySpec, TinySystem
from vfix_engine.runtime import loop
from vfix_engine.runtime.background import InlineWorker
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.hand import INPUT_BYTES
from vfix_engine.runtime.loop import ControlLoop
from vfix_engine.runtime.mailbox import Mailbox
from vfix_engine.runtime.outbox import Outbox
from vfix_engine.runtime.priority import RealTimePriority
from vfix_engine.runtime.wire import snapshot_bytes

AGE = 3  # ticks from a request to its adoption


@pytest.fixture
def ticked() -> Iterator[tuple[Driver, Mailbox, ControlLoop]]:
    """A loop whose worker answers after AGE ticks, and its mailbox."""
    with ExitStack() as stack:
        out, into = Mailbox.create(snapshot_bytes(0)), Mailbox.create(INPUT_BYTES)
        ours, theirs = multiprocessing.Pipe()
        outbox = Outbox(theirs)
        for end in (ours.close, theirs.close, outbox.join, outbox.end, into.close, out.close):
            stack.callback(end)
        driver = Driver(TinySystem(TinySettings()), InlineWorker(TinySpec().worker(), AGE))
        yield driver, out, ControlLoop(driver, out, into, theirs, outbox, RealTimePriority(False))


def ticks(
    driver: Driver, out: Mailbox, control: ControlLoop, monkeypatch: pytest.MonkeyPatch, apart_s: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Of 200 ticks that are so far apart: which ones adopted a result, and which wrote a snapshot."""
    now, seen, told = time.monotonic(), 0, []
    monkeypatch.setattr(loop.time, "monotonic", lambda: now)
    for _ in range(200):
        now += apart_s
        control._tick(now, driven=True)
        news = out.read(seen)
        told.append((driver.adopted, news is not None))
        seen = seen if news is None else news[0]
    adopted, written = np.array(told).T
    assert 0 < adopted.sum() < len(adopted) / 2
    return adopted, written


def test_a_tick_that_adopts_leaves_the_snapshot_to_the_next(
    ticked: tuple[Driver, Mailbox, ControlLoop], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each takes long: together they made a tick late, and those after it."""
    adopted, written = ticks(*ticked, monkeypatch, 1.01 * loop.PUBLISH_S)  # a snapshot is due at every tick
    assert np.array_equal(written, ~adopted)


def test_a_snapshot_that_is_a_period_late_is_written(
    ticked: tuple[Driver, Mailbox, ControlLoop], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, written = ticks(*ticked, monkeypatch, 2.01 * loop.PUBLISH_S)
    assert written.all()
