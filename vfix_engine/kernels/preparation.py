"""Compiling a world's kernels ahead, once for each installation, in processes beside the planner.

A kernel is compiled where it is first called, and most of that time the interpreter waits; in processes of their own
several are compiled at once and the planner answers meanwhile. They leave what they compiled in the folder of
geometry/kernel_cache.py, from where every later process reads it.
What is called to that end is the world's: a module that ends in ``compile_parts(sys.argv[1:], its parts)``.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from .kernel_cache import KernelCache, cache_folder

MOST_S = 600.0  # a process that takes longer hangs
_LOOK_S = 0.1
_GO = b"."
_NOT_KEPT = 3  # exit status of a process whose kernels could not all be written
_NICE = 10  # of processes that nobody waits for


@dataclass(frozen=True, eq=False)
class Preparation:
    """The kernels of one world.

    module: of its parts. processes: the parts of each process; after each part but the last it waits until the other
    processes are as far, since a later part puts their kernels into its own. done: name of the file that says so.
    kernels: how many are in the folder at the end, for the progress. spare: nobody waits for it, so it yields the
    processor to whoever else wants it.
    """

    module: str
    processes: tuple[tuple[str, ...], ...]
    done: str
    kernels: int
    spare: bool = False
    _idle: threading.Event = field(default_factory=threading.Event, init=False, repr=False)

    def __post_init__(self) -> None:
        self._idle.set()

    def is_prepared(self) -> bool:
        """Whether nothing is to be done: all is compiled already, or what is compiled cannot be kept in our folder."""
        folder = cache_folder()
        if os.environ.get("NUMBA_CACHE_DIR") or folder is None:
            return True
        return (folder / self.done).exists() or not os.access(folder, os.W_OK)

    def progress(self) -> float:
        """Share of the kernels that are compiled and kept already, below 1 as long as it goes on."""
        folder = cache_folder()
        return 0.99 if folder is None else min(saved_kernels(folder) / self.kernels, 0.99)

    def prepare(self) -> None:
        """Compile everything; returns when it is done.

        Raises subprocess.SubprocessError when a process fails, OSError when it cannot even begin; the kernels are then
        compiled where they are first called.
        """
        folder = cache_folder()
        if self.is_prepared() or folder is None:
            return
        self._idle.clear()
        try:
            if self._run_all():  # else the disk is full: the next start tries again
                with suppress(OSError):
                    (folder / self.done).touch()
        finally:
            self._idle.set()

    def wait(self, go_on: Callable[[], object] = bool) -> None:
        """Return once none of it runs in this process: compiling the same a second time would slow both down.

        go_on: called now and then; what it raises ends the waiting.
        """
        while not self._idle.wait(_LOOK_S):
            go_on()

    def _run_all(self) -> bool:
        """All at once, in threads that keep no planner from ending. Whether all kernels were kept."""
        meeting, failures, kept = threading.Barrier(len(self.processes)), list[Exception](), list[bool]()

        def run(parts: Sequence[str]) -> None:
            try:
                kept.append(self._run_one(parts, meeting))
            except Exception as failure:  # whatever it is, the others do not wait for this one
                failures.append(failure)
                meeting.abort()

        threads = [threading.Thread(target=run, args=(parts,), daemon=True) for parts in self.processes]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        if failures:
            raise failures[0]
        return all(kept)

    def _run_one(self, parts: Sequence[str], meeting: threading.Barrier) -> bool:
        """One process with its parts; returns whether all of its kernels were kept."""
        root = str(Path(__file__).resolve().parents[2])
        paths = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        command = [sys.executable, "-m", self.module, *(["--spare"] if self.spare else []), *parts]
        environment = {**os.environ, "PYTHONPATH": paths}
        with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            late = threading.Timer(MOST_S, process.kill)
            late.daemon = True
            late.start()
            try:
                while process.stdout.readline():
                    meeting.wait()
                    process.stdin.write(_GO)
                    process.stdin.flush()
            except threading.BrokenBarrierError:
                process.kill()
            finally:
                status = process.wait()
                late.cancel()
        if status not in (0, _NOT_KEPT):
            meeting.abort()
            raise subprocess.CalledProcessError(status, command)
        return status == 0


def saved_kernels(folder: Path) -> int:
    """How many kernels have a compiled version in the folder."""
    return len({file.name.rsplit(".", 2)[0] for file in folder.glob("*.nbc")})


def compile_parts(arguments: Sequence[str], table: Mapping[str, Callable[[], None]]) -> None:
    """What one of these processes does: the parts that are named, one after the other; it ends the process."""
    go = threading.Event()
    threading.Thread(target=_listen, args=(go,), daemon=True).start()
    if "--spare" in arguments and hasattr(os, "nice"):
        os.nice(_NICE)
    gc.disable()  # compilers make many objects and little garbage; looking for it took a tenth of the time
    for place, compile_part in enumerate([table[part] for part in arguments if part != "--spare"]):
        if place > 0:
            print(flush=True)
            go.wait()
            go.clear()
        compile_part()
    # Nothing is left to be done, and taking all of it apart takes a second.
    os._exit(0 if KernelCache.all_saved else _NOT_KEPT)


def _listen(go: threading.Event) -> None:
    """The planner holds the other end of stdin; when it ends, so does this process."""
    while os.read(0, 1):
        go.set()
    os._exit(1)
