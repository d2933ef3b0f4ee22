"""The worker process: what crosses, what a bad function does to it, and what the caller is told."""

import os
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume

from vfix_engine.errors import FrameError, ImageError, InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.crossing import save
from vfix_engine.imaging.frame_report import FrameReport
from vfix_engine.imaging.isolated import Cancellation, Progress, run_isolated
from vfix_engine.imaging.readers import read_volume


def give_back(*values: Any) -> list[Any]:
    return list(values)


def refuse() -> None:
    raise FrameError("say which.", ("frame", "unit"))


def break_down() -> None:
    raise KeyError("Canary^Patient")


def nest(depth: int = 0) -> None:
    nest(depth + 1)


def take_memory() -> int:
    return int(np.ones(3 << 30, dtype=np.uint8).sum())


def never_end() -> None:
    time.sleep(60)


def die() -> None:
    os.abort()


def leave() -> None:
    os._exit(0)


def count(progress: Progress) -> str:
    for n in range(3):
        progress("reading", n / 2)
    print("noise from a decoder")
    return "done"


def tell_environment() -> list[str]:
    return sorted(os.environ)


def test_values_cross_and_come_back() -> None:
    volume, report = asymmetric_volume(), FrameReport("RAS", True)
    mesh = TriangleMesh(np.eye(3), [[0, 1, 2]])
    sent = [1, 0.1, "text", None, True, Path("/a"), (1, [2.5]), {"k": np.arange(4)}, report, mesh, volume]
    back = run_isolated(give_back, *sent)
    assert back[:7] == sent[:7]
    assert np.array_equal(back[7]["k"], np.arange(4))
    assert back[8] == report
    assert np.array_equal(back[9].vertices, mesh.vertices)
    assert np.array_equal(back[10].hu, volume.hu)
    assert not back[10].hu.flags.writeable


def test_what_may_not_cross_is_refused(tmp_path: Path) -> None:
    """HAZ-22: no pickle, not even of an array of objects."""
    with pytest.raises(TypeError):
        save(object(), tmp_path, "a")
    with pytest.raises(ValueError, match="allow_pickle"):
        save(np.array([object()]), tmp_path, "a")


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (break_down, "could not be read"),
        (nest, "too deeply"),
        (take_memory, "more memory"),
        (die, "SIGABRT"),
        (leave, "no answer"),
    ],
)
def test_worker_that_fails_leaves_the_caller_standing(function: Any, words: str) -> None:
    """HAZ-16, HAZ-17, HAZ-18, HAZ-33."""
    with pytest.raises(InputError, match=words) as refused:
        run_isolated(function, memory_bytes=3 << 30)
    assert "Canary" not in str(refused.value)


def test_worker_that_is_late_is_stopped() -> None:
    """HAZ-16."""
    start = time.monotonic()
    with pytest.raises(InputError, match="longer than 1 s"):
        run_isolated(never_end, seconds=1.0)
    assert time.monotonic() - start < 5.0


def test_worker_can_be_ended_from_another_thread() -> None:
    cancellation = Cancellation()
    timer = threading.Timer(0.5, cancellation.cancel)
    timer.start()
    start = time.monotonic()
    for _ in range(2):  # the second is not even started
        with pytest.raises(InputError, match="was stopped"):
            run_isolated(never_end, cancellation=cancellation)
    assert time.monotonic() - start < 5.0
    timer.join()


def test_error_of_ours_keeps_its_kind() -> None:
    with pytest.raises(FrameError, match="say which") as refused:
        run_isolated(refuse)
    assert refused.value.missing == ("frame", "unit")


def test_progress_is_passed_on() -> None:
    heard: list[tuple[str, float]] = []
    assert run_isolated(count, progress=lambda stage, fraction: heard.append((stage, fraction))) == "done"
    assert heard == [("reading", 0.0), ("reading", 0.5), ("reading", 1.0)]


def test_secrets_of_the_environment_stay_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VFIX_TOKEN", "secret")
    assert "VFIX_TOKEN" not in run_isolated(tell_environment)


def test_real_files_through_the_worker(trial_data: Path) -> None:
    with pytest.raises(ImageError, match="magic"):
        run_isolated(read_volume, trial_data / "formats" / "malformed" / "bad_magic.nii")
