"""Rows through shared memory: every one, in order, or counted as lost."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest

from vfix_engine.runtime.ring import RING_BYTES, Ring


@pytest.fixture
def memory() -> Iterator[SharedMemory]:
    memory = Ring.memory()
    yield memory
    memory.close()
    memory.unlink()


def rows(data: bytes, width: int) -> np.ndarray:
    return np.frombuffer(data).reshape(-1, width)


def test_every_row_arrives_in_order(memory: SharedMemory) -> None:
    writer, reader = Ring(memory, 5), Ring(memory, 5)
    sent = np.random.default_rng(1).normal(size=(300_000, 5))
    found = []
    for row in sent:
        writer.write(row)
        if row[0] > 2.0:
            found.append(reader.read())
    found.append(reader.read())
    assert np.array_equal(rows(b"".join(found), 5), sent)
    assert reader.lost == 0


def test_a_reader_that_comes_too_late_counts_what_it_lost(memory: SharedMemory) -> None:
    writer, reader = Ring(memory, 1000), Ring(memory, 1000)
    many = RING_BYTES // 8000 + 40
    for number in range(many):
        writer.write(np.full(1000, float(number)))
    found = rows(reader.read(), 1000)
    assert np.array_equal(found[:, 0], np.arange(many - len(found), many))
    assert len(found) == reader._rows, "of what is still there nothing is skipped"
    assert reader.lost == many - len(found) > 0


def test_a_reader_that_is_overtaken_again_and_again_counts_every_row(memory: SharedMemory) -> None:
    writer, reader = Ring(memory, 1000), Ring(memory, 1000)
    random, written, found = np.random.default_rng(3), 0, list[float]()
    for _ in range(12):
        for _ in range(int(random.integers(1, 2 * reader._rows))):
            writer.write(np.full(1000, float(written)))
            written += 1
        newest = rows(reader.read(), 1000)[:, 0].tolist()
        assert newest == list(range(written - len(newest), written))
        found += newest
        assert len(found) + reader.lost == written
    assert reader.lost > 0


def test_a_half_written_row_is_not_read(memory: SharedMemory) -> None:
    writer, reader = Ring(memory, 3), Ring(memory, 3)
    writer.write(np.array([1.0, 2.0, 3.0]))
    buffer = memory.buf
    assert buffer is not None
    place = 40 + 16 + 8  # of the second number of row 1, behind its number and checksum
    buffer[place] ^= 1
    assert reader.read() == b""
    buffer[place] ^= 1
    assert rows(reader.read(), 3).tolist() == [[1.0, 2.0, 3.0]]
