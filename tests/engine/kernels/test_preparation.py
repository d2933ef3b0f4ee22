"""Compiling ahead: in processes beside the planner, once, and never a reason not to start."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vfix_engine.kernels import preparation
from vfix_engine.kernels.preparation import Preparation
from vfix_engine.worlds import registry as worlds
from vfix_engine.worlds.registry import RIGID, SNAKE


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of this test's own."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(preparation, "cache_folder", lambda: tmp_path)
    return tmp_path


def test_it_is_done_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[Sequence[str]] = []

    def one(self: Preparation, parts: Sequence[str], meeting: threading.Barrier) -> bool:
        ran.append(parts)
        return True

    monkeypatch.setattr(Preparation, "_run_one", one)
    assert not RIGID.is_prepared()
    RIGID.prepare()
    assert sorted(ran) == sorted(RIGID.processes)
    assert RIGID.is_prepared()
    assert not SNAKE.is_prepared(), "each world has its own"
    worlds.prepare()
    assert ran[2:] == [*SNAKE.processes]
    worlds.prepare()
    assert len(ran) == 3


def test_kernels_that_a_full_disk_did_not_take_are_compiled_at_the_next_start(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Preparation, "_run_one", lambda self, parts, meeting: parts != self.processes[1])
    RIGID.prepare()
    assert not RIGID.is_prepared()


@pytest.mark.parametrize("parts", [(("no such part",), ("nothing",)), (("no such part",), ("surface", "surface"))])
def test_a_process_that_fails_is_told_and_keeps_nobody_waiting(
    folder: Path, parts: tuple[tuple[str, ...], ...]
) -> None:
    one = replace(RIGID, processes=parts)
    with pytest.raises(subprocess.SubprocessError):
        one.prepare()
    assert not one.is_prepared()  # it is tried again next time


def test_a_process_that_cannot_begin_keeps_the_other_from_waiting(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No memory for a second process: the first one stands where both are to meet, and is ended."""
    begin, at_the_meeting = subprocess.Popen, threading.Event()

    def one_only(command: list[str], **options: Any) -> Any:
        if "parts" in command:
            at_the_meeting.wait(60)
            raise OSError("cannot allocate memory")
        process = begin([sys.executable, "-c", "print(flush=True); input()"], **options)
        at_the_meeting.set()
        return process

    monkeypatch.setattr(subprocess, "Popen", one_only)
    with ThreadPoolExecutor(1) as background, pytest.raises(OSError, match="memory"):
        background.submit(RIGID.prepare).result(60)
    assert not RIGID.is_prepared()


def test_a_process_that_hangs_is_ended(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preparation, "MOST_S", 0.2)
    with pytest.raises(subprocess.SubprocessError):
        RIGID.prepare()


def test_who_needs_the_engine_meanwhile_waits_for_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[Sequence[str]] = []
    began = threading.Event()

    def slow(self: Preparation, parts: Sequence[str], meeting: threading.Barrier) -> None:
        began.set()
        time.sleep(0.2)
        order.append(parts)
        raise subprocess.CalledProcessError(1, parts[0])  # a failure keeps nobody waiting

    monkeypatch.setattr(Preparation, "_run_one", slow)
    RIGID.wait()  # nothing runs yet
    with ThreadPoolExecutor(1) as background:
        running = background.submit(RIGID.prepare)
        began.wait(60)
        SNAKE.wait()  # that is another
        RIGID.wait()
        assert len(order) == 2
        assert isinstance(running.exception(60), subprocess.SubprocessError)


def test_the_progress_is_what_its_own_processes_have_compiled(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another world's kernels, which are compiled beside them, are none of it; one that two compile counts once."""
    seen: list[float] = []
    names = iter((*"abcd", "a", ""))

    class Ends:
        def write(self, data: bytes) -> None:
            (folder / f"other-{len(seen)}.0.nbc").touch()

        def flush(self) -> None:
            seen.append(world.progress())

    class Process:
        def __init__(self, *_: Any, **__: Any) -> None:
            self.stdin, self.stdout = Ends(), self

        def readline(self) -> bytes:
            seen.append(world.progress())
            return name.encode() + b"\n" if (name := next(names, None)) is not None else b""

        def wait(self) -> int:
            return 0

        def kill(self) -> None: ...

        def __enter__(self) -> Process:
            return self

        def __exit__(self, *_: object) -> None: ...

    world = replace(RIGID, processes=(("one",),), kernels=5)
    monkeypatch.setattr(subprocess, "Popen", Process)
    world.prepare()
    assert seen == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 0.8, 0.8, 0.8])
    assert (folder / world.done).read_text() == "4"
    assert world.is_prepared()


def test_there_is_nothing_to_do_where_nothing_is_kept_or_numba_keeps_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not RIGID.is_prepared()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    assert RIGID.is_prepared()
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda path, mode: (path, mode) != (folder, os.W_OK))
        assert RIGID.is_prepared()  # somebody else's, which may be read
    assert not RIGID.is_prepared()
    monkeypatch.setattr(preparation, "cache_folder", lambda: None)
    assert RIGID.is_prepared()
    RIGID.prepare()


def test_both_processes_run_and_meet(folder: Path) -> None:
    RIGID.prepare()
    assert RIGID.is_prepared()


def test_worlds_name_their_specs() -> None:
    assert {name: world.load().__name__ for name, world in worlds.WORLDS.items()} == {
        "rigid": "RigidSpec",
        "freehand": "FreehandSpec",
        "snake": "SnakeSystemSpec",
        "snake drive": "DriveSpec",
    }


@pytest.mark.parametrize(("one", "part"), [(RIGID, "control"), (SNAKE, "drive")])
def test_a_part_ends_with_the_planner(one: Preparation, part: str) -> None:
    """Its stdin is held by the planner: when that ends, compiling for nobody ends."""
    command = [sys.executable, "-m", one.module, part]
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, cwd=root, capture_output=True, timeout=120, check=False)
    assert done.returncode == 1
    assert not done.stderr


SLICES = """
import numpy as np
from vfix_engine.files import sampling
from vfix_engine.files.volume import Volume
from vfix_engine.worlds.rigid import preparation

preparation._slices()
before = sampling._points.signatures + sampling._plane.signatures
volume = Volume(np.zeros((5, 6, 7), dtype=np.int16), np.zeros(3), np.ones(3), np.eye(3))
volume.sample([[1.0, 2.0, 3.0]])
for axis in ("axial", "coronal", "sagittal"):
    volume.slice_image(axis, 2.0)
assert sampling._points.signatures + sampling._plane.signatures == before
"""


def test_a_volume_needs_no_kernel_for_other_types_than_those_compiled_ahead() -> None:
    """In a process of its own, where no other test has loaded anything."""
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run([sys.executable, "-c", SLICES], cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
