"""Whatever ends the recording of a run is told while the drive goes on (HAZ-26)."""

from __future__ import annotations

import multiprocessing.connection
import os
from collections.abc import Callable, Iterator
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.engine.tiny import Jump, TinySpec
from vfix_engine.errors import InputError
from vfix_engine.runtime import outbox
from vfix_engine.runtime.command import COMMAND_COLUMNS
from vfix_engine.runtime.ring import Ring, RingLog
from vfix_engine.runtime.run import PART, Run, RunWriter
from vfix_engine.runtime.run_recorder import FarEnd, RunRecorder

SPEC = TinySpec()
COLUMNS = SPEC.build().row_layout
LINE = np.zeros(len(COMMAND_COLUMNS) + len(COLUMNS))


@pytest.fixture
def memory() -> Iterator[SharedMemory]:
    memory = Ring.memory()
    yield memory
    memory.close()
    memory.unlink()


def begun(folder: Path, memory: SharedMemory) -> tuple[RunRecorder, RingLog]:
    """A recorder that is not started, and the log of a drive that writes to it."""
    recorder = RunRecorder(folder, SPEC, multiprocessing.Pipe(), memory)
    theirs = os.dup(recorder.far.fileno())  # the process has its own end, and the recorder closes that of its maker
    far = FarEnd(memory.name, multiprocessing.connection.Connection(theirs))
    return recorder, far.attach(COLUMNS)


def raising(error: Exception) -> Callable[..., Any]:
    def fail(*_: object) -> None:
        raise error

    return fail


@pytest.mark.parametrize(
    ("method", "error", "words"),
    [
        ("__init__", InputError("'a.run' exists already; choose another name for the run"), "exists already"),
        ("ticks", OSError(28, "No space left on device"), "No space left on device"),
        ("ticks", MemoryError(), r"an unexpected error \(MemoryError\)"),
        ("event_at", TypeError("an object of Doe, John is not serializable"), r"an unexpected error \(TypeError\)"),
        ("close", PermissionError(13, "Permission denied"), "Permission denied"),
        ("close", RuntimeError("of Doe, John"), r"an unexpected error \(RuntimeError\)"),
    ],
)
def test_every_error_in_the_recorder_is_told(
    tmp_path: Path, memory: SharedMemory, monkeypatch: pytest.MonkeyPatch, method: str, error: Exception, words: str
) -> None:
    recorder, log = begun(tmp_path / "a.run", memory)
    monkeypatch.setattr(RunWriter, method, raising(error))
    log.event("request", Jump(1.0))
    log.tick(LINE)
    assert log.flush(60.0)
    recorder.start()
    if method != "close":
        recorder.thread.join(60.0)
        assert not recorder.thread.is_alive(), "it ends by itself, while the drive goes on"
    recorder.close()
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(recorder.failed)
    assert "John" not in recorder.failed
    assert not (tmp_path / "a.run").exists()


def test_a_folder_that_is_taken_is_left_as_it_is(tmp_path: Path, memory: SharedMemory) -> None:
    taken = tmp_path / "a.run"
    taken.mkdir()
    recorder, log = begun(taken, memory)
    log.tick(LINE)
    recorder.start()
    recorder.thread.join(60.0)
    recorder.close()
    assert recorder.failed.startswith("the run cannot be written: 'a.run' exists already")
    assert not list(taken.iterdir())


def test_events_that_found_no_room_end_the_recording(
    tmp_path: Path, memory: SharedMemory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recorder that waits for its disk reads nothing; a run without an event would be driven again wrongly."""
    monkeypatch.setattr(outbox, "MOST", 4)
    recorder, log = begun(tmp_path / "a.run", memory)
    sent = 0
    while not log._unsent:
        log.event("request", Jump(float(sent)))
        sent += 1
    recorder.start()
    assert log.flush(60.0)
    recorder.thread.join(60.0)
    recorder.close()
    assert recorder.failed == "the run cannot be written: 1 events came faster than they could be written"
    assert [event.content.to for event in Run.read(tmp_path / f"a.run{PART}").events] == list(range(sent - 1))
