"""The outbox: whoever puts a message in waits for nobody, and nothing is lost that was taken."""

from __future__ import annotations

import multiprocessing
import threading

import pytest

from vfix_engine.runtime.outbox import MOST, Outbox


def test_a_reader_that_sleeps_holds_nobody_up_and_gets_everything_in_order() -> None:
    ours, theirs = multiprocessing.Pipe()
    outbox, taken = Outbox(ours), 0
    while outbox.put(("message", taken, b"-" * 4096)):  # until the queue is full
        taken += 1
    assert taken >= MOST
    assert not outbox.flush(0.01)
    assert [theirs.recv()[1] for _ in range(taken)] == list(range(taken))
    assert outbox.flush(10.0)
    assert outbox.free_slots == MOST
    with pytest.raises(TypeError, match="lock"):
        outbox.put(threading.Lock())
    assert outbox.put("last")
    assert theirs.recv() == "last"
    outbox.end()
    outbox.join()
    assert not outbox.put("after")


def test_a_reader_that_is_gone_ends_it() -> None:
    ours, theirs = multiprocessing.Pipe()
    outbox = Outbox(ours)
    while outbox.put(b"-" * 4096):
        pass
    theirs.close()
    outbox.join()
    assert outbox.ended
    assert outbox.flush(0.0)
