"""The worker process: what crosses, what a bad function does to it, and what the caller is told."""

import ctypes
import importlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vfix_engine.errors import FrameError, ImageError, InputError
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.readers import read_volume
from vfix_engine.files.sandbox import confinement, crossing, isolated
from vfix_engine.files.sandbox.crossing import save
from vfix_engine.files.sandbox.isolated import Cancellation, run_isolated
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback

linux = pytest.mark.skipif(sys.platform != "linux", reason="asks Linux what became of a process")
posix = pytest.mark.skipif(os.name != "posix", reason="Windows does not limit the size of a file")
CALLER = """
import sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from test_isolated import wait_in
from vfix_engine.files.sandbox.isolated import run_isolated
place = Path(sys.argv[1])
run_isolated(wait_in, place, True, folder=place, writable=(place,))
"""


def give_back(*values: Any) -> list[Any]:
    return list(values)


def refuse() -> None:
    raise FrameError("say which.", ("frame", "unit"))


class UnknownHere(InputError):
    """Not of the engine's tree."""


def refuse_in_other_words() -> None:
    raise UnknownHere("say how.")


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


def count(progress: ProgressCallback) -> str:
    for n in range(3):
        progress("reading", n / 2)
    print("noise from a decoder")
    return "done"


def tell_environment() -> list[str]:
    return sorted(os.environ)


def fill_disk() -> None:
    with tempfile.TemporaryFile() as file:
        file.seek(4 << 30)
        file.write(b"x")


def say_where() -> str:
    return tempfile.gettempdir()


def wait_in(place: Path, deaf: bool) -> None:
    """A decoded CT, so to speak, and no end; deaf: in code that lets no other thread of Python run."""
    Path(tempfile.gettempdir(), "voxels").write_bytes(b"x")
    (place / "started").write_text(str(os.getpid()), encoding="utf-8")
    if deaf:
        ctypes.PyDLL(None).sleep(60)
    time.sleep(60)


def started_in(place: Path) -> int:
    """Process id of the worker that waits there."""
    file = place / "started"
    until(lambda: file.exists() and file.read_text(encoding="utf-8") != "")
    return int(file.read_text(encoding="utf-8"))


def until(condition: Callable[[], bool]) -> None:
    """Returns when it holds; the test ends by its failure when it never does."""
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def is_alive(process_id: int) -> bool:
    """Whether it runs; one that has ended and was not asked for its end does not."""
    try:
        return "Z" not in Path(f"/proc/{process_id}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False


def test_values_cross_and_come_back() -> None:
    from imaging_phantoms import asymmetric_volume  # here: the worker, which loads this module, may not read it

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


def test_every_type_that_may_cross_is_where_its_name_says() -> None:
    for name, module in crossing._MODULE_OF.items():
        assert hasattr(importlib.import_module(module), name), name


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
        pytest.param(fill_disk, "more disk than it may", marks=posix),
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
    assert time.monotonic() - start < 20.0


def test_worker_can_be_ended_from_another_thread() -> None:
    cancellation = Cancellation()
    timer = threading.Timer(0.5, cancellation.cancel)
    timer.start()
    start = time.monotonic()
    for _ in range(2):  # the second is not even started
        with pytest.raises(InputError, match="was stopped"):
            run_isolated(never_end, cancellation=cancellation)
    assert time.monotonic() - start < 20.0
    timer.join()


def test_error_of_ours_keeps_its_kind() -> None:
    with pytest.raises(FrameError, match="say which") as refused:
        run_isolated(refuse)
    assert refused.value.missing == ("frame", "unit")


def test_error_of_a_kind_that_is_defined_elsewhere_keeps_its_words() -> None:
    with pytest.raises(InputError, match=r"say how\."):
        run_isolated(refuse_in_other_words)


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


def test_temporary_files_lie_where_the_caller_says(tmp_path: Path) -> None:
    place = Path(run_isolated(say_where, folder=tmp_path))
    assert place.parent == tmp_path
    assert list(tmp_path.iterdir()) == []


@linux
def test_a_worker_ends_with_the_process_that_started_it(tmp_path: Path) -> None:
    """HAZ-16: a caller that is killed cleans up nothing."""
    command = [sys.executable, "-c", CALLER, str(tmp_path), *map(str, Path(__file__).parents[:2])]
    with subprocess.Popen(command) as caller:
        worker = started_in(tmp_path)
        assert is_alive(worker)
        caller.kill()
    until(lambda: not is_alive(worker))


@linux
def test_a_worker_ends_when_its_pipe_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no kernel says that the caller has ended, the system closes what the caller held."""
    begun: list[subprocess.Popen[bytes]] = []
    real = subprocess.Popen

    def remembered(*args: Any, **options: Any) -> subprocess.Popen[bytes]:
        begun.append(real(*args, **options))
        return begun[-1]

    def close_the_pipe() -> None:
        started_in(tmp_path)
        assert begun[0].stdin is not None
        begun[0].stdin.close()

    monkeypatch.setattr(subprocess, "Popen", remembered)
    thread = threading.Thread(target=close_the_pipe)
    thread.start()
    with pytest.raises(InputError, match="SIGKILL"):
        run_isolated(wait_in, tmp_path, False, writable=(tmp_path,))
    thread.join()


@linux
def test_what_a_worker_has_started_ends_with_it() -> None:
    program = "import subprocess; print(subprocess.Popen(['sleep', '60'], stdout=subprocess.DEVNULL).pid, flush=True)"
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdout is not None
        child = int(process.stdout.readline())
        isolated._await_end(process)
        assert is_alive(child)
        isolated._kill(process)
    until(lambda: not is_alive(child))


@linux
def test_a_worker_is_kept_from_network_files_and_processes(tmp_path: Path) -> None:
    """HAZ-16: whatever a decoder is made to do. Every way is open here, so a probe that sees nothing would be seen."""
    secret = tmp_path / "other_case.nrrd"
    secret.write_bytes(b"x")
    (tmp_path / "work").mkdir()
    here = confinement.probe(str(secret))
    assert here == dict.fromkeys(here, False)
    held = run_isolated(confinement.probe, str(secret), folder=tmp_path / "work")
    assert held == dict.fromkeys(held, True)


def ways_out(file: str, other: int) -> list[str]:
    """What this process may do to a file that it was not given and to another process."""
    import resource

    ways: dict[str, Callable[[], object]] = {
        "chmod": lambda: os.chmod(file, 0o666),
        "chown": lambda: os.chown(file, os.getuid(), os.getgid()),
        "utime": lambda: os.utime(file, (1, 1)),
        "setxattr": lambda: os.setxattr(file, "user.vfix", b"x"),
        "kill": lambda: os.kill(other, signal.SIGURG),
        "queue": lambda: signal.pidfd_send_signal(os.pidfd_open(other), signal.SIGURG),
        "prlimit": lambda: resource.prlimit(other, resource.RLIMIT_CORE, (0, 0)),
        "nice": lambda: os.setpriority(os.PRIO_PROCESS, other, 5),
        "affinity": lambda: os.sched_setaffinity(other, os.sched_getaffinity(0)),
        "scheduler": lambda: os.sched_setscheduler(other, os.SCHED_BATCH, os.sched_param(0)),
    }
    return [name for name, way in ways.items() if not refused(way)]


def refused(way: Callable[[], object]) -> bool:
    try:
        way()
    except PermissionError:
        return True
    except OSError:  # let through, and not to be had: not every file system has attributes
        return False
    return False


@linux
def test_a_worker_changes_no_other_file_s_rights_and_no_other_process(tmp_path: Path) -> None:
    """HAZ-16: neither is among what Landlock keeps a process from. Every way is open here."""
    secret = tmp_path / "other_case.nrrd"
    secret.write_bytes(b"x")
    (tmp_path / "work").mkdir()
    with subprocess.Popen(["sleep", "60"]) as other:
        try:
            assert run_isolated(ways_out, str(secret), other.pid, folder=tmp_path / "work") == []
            assert len(ways_out(str(secret), other.pid)) == 10
        finally:
            other.kill()


def abuse_folder(kind: str) -> None:
    """Leave something other than a plain answer in the worker's own folder."""
    own = Path(tempfile.gettempdir())
    if kind == "pipe":
        os.mkfifo(own / "failure.json")
    else:
        (own / "result.json").symlink_to("/etc/hostname")
        (own / "failure.json").symlink_to("request.json")
    os._exit(0)


@posix
@pytest.mark.parametrize("kind", ["pipe", "link"])
def test_a_worker_that_leaves_a_pipe_or_a_link_is_not_waited_for(kind: str) -> None:
    """HAZ-16: the time limit covers the worker alone, and the next import waits for this one."""
    with pytest.raises(InputError, match="no answer"):
        run_isolated(abuse_folder, kind)


ARRAY = '{"kind": "array", "value": %s}'


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("failure.json", '{"kind": "InputError", "mess'),
        ("failure.json", "[]"),
        ("failure.json", '{"kind": "InputError"}'),
        ("failure.json", "{" + " " * (1 << 20) + '"kind": "InputError", "message": "", "missing": []}'),
        ("failure.json", "[" * 60_000),
        ("result.json", ARRAY % "0"),
        ("result.json", ARRAY % "1e999"),
        ("result.json", '{"kind": "list", "value": [' + ", ".join([ARRAY % "1"] * 9) + "]}"),
        ("result.json", '{"kind": [], "value": 0}'),
        ("result.json", '{"kind": "TriangleMesh", "value": []}'),
    ],
)
def test_a_spoiled_answer_is_none(tmp_path: Path, name: str, text: str) -> None:
    """HAZ-16: whatever a worker was made to leave, the caller hears one sentence."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "result-0.npy").write_bytes(b"PK\x03\x04")  # numpy itself would take an archive
    np.save(tmp_path / "result-1.npy", np.zeros(64))
    with pytest.raises(InputError, match="no answer"):
        isolated._answer(tmp_path, 3000)


def test_an_error_of_another_kind_than_the_engine_s_is_one_of_input(tmp_path: Path) -> None:
    (tmp_path / "failure.json").write_text('{"kind": "annotations", "message": "so", "missing": []}', encoding="utf-8")
    with pytest.raises(InputError, match="so"):
        isolated._answer(tmp_path, 900)
