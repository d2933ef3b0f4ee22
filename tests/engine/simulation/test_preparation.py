"""Compiling ahead: in processes beside the planner, once, and never a reason not to start."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from vfix_engine.simulation import preparation


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of this test's own."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(preparation, "cache_folder", lambda: tmp_path)
    return tmp_path


def test_it_is_done_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[Sequence[str]] = []

    def half(parts: Sequence[str], meeting: threading.Barrier) -> bool:
        ran.append(parts)
        return True

    monkeypatch.setattr(preparation, "_run_half", half)
    assert not preparation.is_prepared()
    preparation.prepare()
    assert sorted(ran) == sorted(preparation.HALVES)
    assert preparation.is_prepared()
    preparation.prepare()
    assert len(ran) == 2


def test_kernels_that_a_full_disk_did_not_take_are_compiled_at_the_next_start(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(preparation, "_run_half", lambda parts, meeting: parts != preparation.HALVES[1])
    preparation.prepare()
    assert not preparation.is_prepared()


@pytest.mark.parametrize("halves", [(("no such part",), ("nothing",)), (("no such part",), ("surface", "surface"))])
def test_a_half_that_fails_is_told_and_keeps_nobody_waiting(
    folder: Path, monkeypatch: pytest.MonkeyPatch, halves: tuple[tuple[str, ...], ...]
) -> None:
    monkeypatch.setattr(preparation, "HALVES", halves)
    with pytest.raises(subprocess.SubprocessError):
        preparation.prepare()
    assert not preparation.is_prepared()  # it is tried again next time


def test_a_half_that_cannot_begin_keeps_the_other_from_waiting(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No memory for a second process: the first one stands where both are to meet, and is ended."""
    begin, at_the_meeting = subprocess.Popen, threading.Event()

    def one_only(command: list[str], **options: Any) -> Any:
        if "parts" in command:
            at_the_meeting.wait(10)
            raise OSError("cannot allocate memory")
        process = begin([sys.executable, "-c", "print(flush=True); input()"], **options)
        at_the_meeting.set()
        return process

    monkeypatch.setattr(subprocess, "Popen", one_only)
    with ThreadPoolExecutor(1) as background, pytest.raises(OSError, match="memory"):
        background.submit(preparation.prepare).result(20)
    assert not preparation.is_prepared()


def test_a_half_that_hangs_is_ended(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preparation, "HALF_SECONDS", 0.2)
    with pytest.raises(subprocess.SubprocessError):
        preparation.prepare()


def test_who_needs_the_engine_meanwhile_waits_for_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[Sequence[str]] = []
    began = threading.Event()

    def slow(parts: Sequence[str], meeting: threading.Barrier) -> None:
        began.set()
        time.sleep(0.2)
        order.append(parts)
        raise subprocess.CalledProcessError(1, parts[0])  # a failure keeps nobody waiting

    monkeypatch.setattr(preparation, "_run_half", slow)
    preparation.wait()  # nothing runs yet
    with ThreadPoolExecutor(1) as background:
        running = background.submit(preparation.prepare)
        began.wait(10)
        preparation.wait()
        assert len(order) == 2
        assert isinstance(running.exception(10), subprocess.SubprocessError)


def test_the_progress_is_what_lies_in_the_folder(folder: Path) -> None:
    assert preparation.progress() == 0.0
    for number in range(preparation.KEPT_KERNELS // 2):
        (folder / f"kernel-{number}.nbi").touch()
    assert preparation.progress() == pytest.approx(0.5, abs=0.01)
    for number in range(preparation.KEPT_KERNELS):
        (folder / f"kernel-{number}.nbi").touch()
    assert preparation.progress() == 0.99  # it is still going on


def test_there_is_nothing_to_do_where_nothing_is_kept_or_numba_keeps_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not preparation.is_prepared()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    assert preparation.is_prepared()
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda path, mode: (path, mode) != (folder, os.W_OK))
        assert preparation.is_prepared()  # somebody else's, which may be read
    assert not preparation.is_prepared()
    monkeypatch.setattr(preparation, "cache_folder", lambda: None)
    assert preparation.is_prepared()
    preparation.prepare()


def test_both_halves_run_and_meet(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    preparation.prepare()
    assert preparation.is_prepared()


def test_a_part_ends_with_the_planner() -> None:
    """Its stdin is held by the planner: when that ends, compiling for nobody ends."""
    command = [sys.executable, "-m", "vfix_engine.simulation.preparation", "control"]
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, cwd=root, capture_output=True, timeout=60, check=False)
    assert done.returncode == 1
    assert not done.stderr
