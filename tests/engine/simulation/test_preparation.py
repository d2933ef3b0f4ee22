"""Compiling ahead: in processes beside the planner, once, and never a reason not to start."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from vfix_engine.simulation import preparation


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of this test's own."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(preparation, "cache_folder", lambda: tmp_path)
    return tmp_path


def test_the_others_wait_for_the_first_ones_and_it_is_done_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []
    monkeypatch.setattr(preparation, "_run_part", ran.append)
    assert not preparation.is_prepared()
    preparation.prepare()
    assert sorted(ran[:2]) == sorted(preparation.FIRST)
    assert sorted(ran[2:]) == sorted(preparation.THEN)
    assert preparation.is_prepared()
    preparation.prepare()
    assert len(ran) == 4


def test_a_part_that_fails_is_told_and_is_tried_again_next_time(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(part: str) -> None:
        raise subprocess.CalledProcessError(1, part)

    monkeypatch.setattr(preparation, "_run_part", fail)
    with pytest.raises(subprocess.SubprocessError):
        preparation.prepare()
    assert not preparation.is_prepared()


def test_who_needs_the_engine_meanwhile_waits_for_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    began = threading.Event()

    def slow(part: str) -> None:
        began.set()
        time.sleep(0.2)
        order.append(part)
        if part == "control":
            raise subprocess.CalledProcessError(1, part)  # a failure keeps nobody waiting

    monkeypatch.setattr(preparation, "_run_part", slow)
    monkeypatch.setattr(preparation, "THEN", ("control",))
    preparation.wait()  # nothing runs yet
    with ThreadPoolExecutor(1) as background:
        running = background.submit(preparation.prepare)
        began.wait(10)
        preparation.wait()
        assert sorted(order[:2]) == sorted(preparation.FIRST)
        assert order[2:] == ["control"]
        assert isinstance(running.exception(10), subprocess.SubprocessError)


def test_the_progress_is_what_lies_in_the_folder(folder: Path) -> None:
    assert preparation.progress() == 0.0
    count = preparation.count_kernels()
    assert count > 50
    for number in range(count // 2):
        (folder / f"kernel-{number}.nbi").touch()
    assert 0.5 < preparation.progress() < 0.75
    for number in range(count):
        (folder / f"kernel-{number}.nbi").touch()
    assert preparation.progress() == 0.99  # it is still going on


def test_there_is_nothing_to_do_where_nothing_is_kept_or_numba_keeps_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not preparation.is_prepared()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    assert preparation.is_prepared()
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(preparation, "cache_folder", lambda: None)
    assert preparation.is_prepared()
    preparation.prepare()


@pytest.mark.parametrize("part", [*preparation.FIRST, *preparation.THEN])
def test_every_part_runs_as_a_process(part: str) -> None:
    preparation._run_part(part)


def test_a_part_ends_with_the_planner() -> None:
    """Its stdin is held by the planner: when that ends, compiling for nobody ends."""
    command = [sys.executable, "-m", "vfix_engine.simulation.preparation", "control"]
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, cwd=root, capture_output=True, timeout=60, check=False)
    assert done.returncode == 1
    assert not done.stderr
