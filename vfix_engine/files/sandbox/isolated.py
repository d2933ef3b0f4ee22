"""Run a function on untrusted input in a separate process, with limits on memory, time and disk.

A hostile file can make a decoder loop, crash or exhaust memory: that ends the worker, and the caller gets an
InputError. `crossing` transfers values as JSON and .npy, without pickle; `worker` is the other end. The worker leads a
process group, which ends with the result or with the caller. If the kernel supports it, the worker is confined to its
files (`confinement`).
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from vfix_engine import errors
from vfix_engine.files.sandbox import crossing
from vfix_engine.json_text import parse_json
from vfix_engine.progress import ProgressCallback

Result = TypeVar("Result")

DEFAULT_MEMORY_BYTES = 6 << 30
DEFAULT_SECONDS = 30.0
MAX_PROGRESS_LINE = 4096  # [byte]
_MAX_FAILURE_BYTES = 64 << 10


class Cancellation:
    """Ends workers from another thread and prevents further ones from starting.

    within: an outer cancellation, which also ends the workers of this one.
    """

    def __init__(self, within: Cancellation | None = None) -> None:
        self._within = within
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._cancelled = False

    def cancel(self) -> None:
        """End all workers; their callers get an InputError."""
        with self._lock:
            self._cancelled = True
            for process in self._running:
                _kill(process)

    def check(self) -> None:
        """Raise InputError after cancellation."""
        if self._within is not None:
            self._within.check()
        if self._cancelled:
            raise errors.InputError("reading the file was stopped before its end.")

    @contextmanager
    def over(self, process: subprocess.Popen[bytes]) -> Iterator[None]:
        """Register a running worker; after cancellation it is ended at once."""
        with ExitStack() as outer:
            if self._within is not None:
                outer.enter_context(self._within.over(process))
            with self._over(process):
                yield

    @contextmanager
    def _over(self, process: subprocess.Popen[bytes]) -> Iterator[None]:
        with self._lock:
            self._running.add(process)
            if self._cancelled:
                _kill(process)
        try:
            yield
        finally:
            with self._lock:
                self._running.discard(process)


def run_isolated(
    function: Callable[..., Result],
    *args: Any,
    memory_bytes: int = DEFAULT_MEMORY_BYTES,
    seconds: float = DEFAULT_SECONDS,
    progress: ProgressCallback | None = None,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
    writable: Sequence[Path] = (),
) -> Result:
    """Compute the result of a function in a new process.

    function: at module level; with `progress` it is called with a keyword argument `progress(stage, fraction)`.
    args: of the types that `crossing` lists; the worker may read the files whose paths are among them.
    memory_bytes: limits of its address space and of each file it writes; if the system has no such limits, only the
        time limit applies.
    seconds: wall-clock limit.
    cancellation: lets another thread end the worker.
    folder: for its temporary files, which may contain a whole CT; None selects the system's.
    writable: further folders to which the worker may write.

    Raises:
        VfixError: what the function raises.
        InputError: the worker crashed, ran out of time or was cancelled.
    """
    cancellation = cancellation or Cancellation()
    cancellation.check()
    with tempfile.TemporaryDirectory(prefix="vfix-worker-", dir=folder) as name:
        own = Path(name)
        code = _code_of(function)
        request = {
            "module": function.__module__,
            "function": function.__qualname__,
            "memory_bytes": memory_bytes,
            "seconds": seconds,
            "progress": progress is not None,
            "path": sys.path,
            "parent": os.getpid(),
            "readable": [str(path.absolute()) for path in (*code, *_paths_in(args))],
            "writable": [str(path.absolute()) for path in (own, *writable)],
            "listable": [str(path.absolute().parent) for path in code],  # an import lists the parent of a package
        }
        (own / "request.json").write_text(json.dumps(request), encoding="utf-8")
        crossing.save(list(args), own, "arguments")
        _run_worker(own, seconds, progress, cancellation)
        result: Result = _answer(own, memory_bytes)
        return result


def _code_of(function: Callable[..., Any]) -> list[Path]:
    """Folders of the packages of the function and of this module; for a single module, its folder."""
    tops = (sys.modules[name.partition(".")[0]] for name in (function.__module__, __name__))
    return [Path(file).parent for top in tops if (file := getattr(top, "__file__", None))]


def _paths_in(value: Any) -> Iterator[Path]:
    if isinstance(value, Path):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _paths_in(item)


def _run_worker(own: Path, seconds: float, progress: ProgressCallback | None, cancellation: Cancellation) -> None:
    process = subprocess.Popen(
        [sys.executable, "-P", str(Path(__file__).with_name("worker.py")), str(own)],
        stdin=subprocess.PIPE,  # nothing is written; its end signals to the worker that the caller has ended
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # decoders quote the file there
        env=_environment(own),
        start_new_session=True,
    )
    late = threading.Event()

    def stop() -> None:
        late.set()
        _kill(process)

    timer = threading.Timer(seconds, stop)
    timer.start()
    try:
        assert process.stdout is not None
        with cancellation.over(process):
            for line in iter(lambda: process.stdout.readline(MAX_PROGRESS_LINE), b""):  # type: ignore[union-attr]
                _forward(line, progress)
            _await_end(process)
    finally:
        timer.cancel()
        timer.join()  # it must not end a later group with the same id
        _kill(process)
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
    cancellation.check()
    if late.is_set():
        raise errors.InputError(f"reading the file took longer than {seconds:g} s and was stopped.")
    if process.returncode != 0:
        raise errors.InputError(f"the file could not be read: its reader {_end(process.returncode)}.")


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End the worker and its group, unless it has been waited for."""
    if os.name != "posix":
        process.kill()
    elif process.returncode is None:  # its group id is not reused until it is waited for
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)


def _await_end(process: subprocess.Popen[bytes]) -> None:
    """Wait for the end of the worker without freeing its group id."""
    if hasattr(os, "waitid"):
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    else:
        process.wait()


def _end(status: int) -> str:
    if status < 0:
        return f"was ended by {signal.Signals(-status).name}"
    return f"ended with status {status}"


def _forward(line: bytes, progress: ProgressCallback | None) -> None:
    """Forward one line of progress; other lines, which a decoder may print, are dropped."""
    try:
        stage, fraction = parse_json(line)
        if progress is not None and isinstance(stage, str):
            progress(stage, min(max(float(fraction), 0.0), 1.0))
    except (ValueError, TypeError):
        return


def _environment(own: Path) -> dict[str, str]:
    """Environment variables that the worker needs, without secrets; its temporary files go to its folder."""
    kept = {"PATH", "HOME", "SYSTEMROOT", "LANG", "LC_ALL"}
    kept |= {"NUMBA_CACHE_DIR", "VFIX_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"}  # location of compiled kernels
    single = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS"), "1")
    temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(own))
    return {name: value for name, value in os.environ.items() if name in kept} | single | temporary


def _answer(folder: Path, max_bytes: int) -> Any:
    """Read the worker's result, at most `max_bytes`; untrusted. Raises the error that the worker reports."""
    try:
        try:
            failure = crossing.read_json(folder / "failure.json", _MAX_FAILURE_BYTES)
        except FileNotFoundError:
            return crossing.load(folder, "result", max_bytes)
        error = _failure(str(failure["kind"]), str(failure["message"]), tuple(map(str, failure["missing"])))
        if isinstance(error, errors.SeriesUnclear):
            error.series = tuple(_plain(one) for one in failure["series"])
    # The trust boundary: any error here is caused by the worker's files, and its message may quote the input.
    except Exception:
        raise errors.InputError("the file could not be read: its reader gave no answer.") from None
    raise error


def _plain(series: Any) -> dict[str, Any]:
    """Keep of a worker's description of a series only text, numbers and lists of numbers."""
    return {
        str(key)[:40]: [float(part) for part in value] if isinstance(value, list) else _text_or_number(value)
        for key, value in series.items()
    }


def _text_or_number(value: Any) -> str | int | float | None:
    return value if value is None or isinstance(value, int | float) else str(value)[:200]


def _failure(kind: str, message: str, missing: tuple[str, ...]) -> errors.VfixError:
    """Create an error of the engine; a class defined elsewhere becomes an InputError."""
    if kind == errors.FrameError.__name__:
        return errors.FrameError(message, missing)
    found = getattr(errors, kind, None)
    if isinstance(found, type) and issubclass(found, errors.VfixError):
        return found(message)
    return errors.InputError(message)
