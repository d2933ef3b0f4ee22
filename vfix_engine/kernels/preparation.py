"""Ahead-of-time compilation of a world's kernels, once per installation, in separate processes beside the planner.

A kernel is compiled at its first call, during which the interpreter is mostly blocked; in processes of their own
several are compiled at once while the planner responds. They write the compiled kernels to the folder of
kernels/kernel_cache.py, from which every later process loads them.
Each world defines what is called: a module that ends in ``compile_parts(sys.argv[1:], its parts)``.
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

MOST_S = 600.0  # timeout of a process
_LOOK_S = 0.1
_GO = b"."
_NOT_KEPT = 3  # exit status of a process that could not write all of its kernels
_NICE = 3  # of processes that others come before: a larger one makes them stand on two cores


@dataclass(frozen=True, eq=False)
class Preparation:
    """The kernels of one world.

    module: contains its parts. processes: the parts of each process; after each part but the last a process waits until
    the others have reached the same point, since a later part links their kernels. done: name of the file that marks
    completion and holds the number of kernels. kernels: that number, for the progress. spare: the processes run at low
    priority, beside those of another preparation.
    """

    module: str
    processes: tuple[tuple[str, ...], ...]
    done: str
    kernels: int
    spare: bool = False
    _idle: threading.Event = field(default_factory=threading.Event, init=False, repr=False)
    _names: set[str] = field(default_factory=set, init=False, repr=False)  # of the kernels that are ready

    def __post_init__(self) -> None:
        self._idle.set()

    def is_prepared(self) -> bool:
        """Whether there is nothing to do: everything is compiled, or compiled kernels cannot be saved in the folder."""
        folder = cache_folder()
        if os.environ.get("NUMBA_CACHE_DIR") or folder is None:
            return True
        return (folder / self.done).exists() or not os.access(folder, os.W_OK)

    def progress(self) -> float:
        """Fraction of the kernels that its processes have compiled or found, below 1 until completion."""
        return min(len(self._names) / self.kernels, 0.99)

    def prepare(self) -> None:
        """Compile everything; return on completion.

        Raises subprocess.SubprocessError if a process fails, OSError if it cannot be started; the kernels are then
        compiled at their first call.
        """
        folder = cache_folder()
        if self.is_prepared() or folder is None:
            return
        self._names.clear()
        self._idle.clear()
        try:
            if self._run_all():  # else the disk is full: the next start tries again
                with suppress(OSError):
                    (folder / self.done).write_text(str(len(self._names)))
        finally:
            self._idle.set()

    def wait(self, go_on: Callable[[], object] = bool) -> None:
        """Wait until no preparation runs in this process: compiling the same kernels twice would slow both down.

        go_on: called periodically; an exception from it ends the waiting.
        """
        while not self._idle.wait(_LOOK_S):
            go_on()

    def _run_all(self) -> bool:
        """Run all processes at once, in daemon threads; return whether all kernels were saved."""
        meeting, failures, kept = threading.Barrier(len(self.processes)), list[Exception](), list[bool]()

        def run(parts: Sequence[str]) -> None:
            try:
                kept.append(self._run_one(parts, meeting))
            except Exception as failure:  # on any failure, the other processes must not wait for this one
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
        """Run one process with its parts; return whether all of its kernels were saved."""
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
                while line := process.stdout.readline():
                    if name := line.strip().decode():
                        self._names.add(name)
                        continue
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


def compile_parts(arguments: Sequence[str], table: Mapping[str, Callable[[], None]]) -> None:
    """Main function of such a process: compile the named parts one after the other, then exit.

    It prints the name of each kernel that is ready, and an empty line between two parts.
    """
    KernelCache.told = lambda name: print(name, flush=True)
    go = threading.Event()
    threading.Thread(target=_listen, args=(go,), daemon=True).start()
    if "--spare" in arguments and hasattr(os, "nice"):
        os.nice(_NICE)
    gc.disable()  # compilers create many objects and little garbage; collection took a tenth of the time
    for place, compile_part in enumerate([table[part] for part in arguments if part != "--spare"]):
        if place > 0:
            print(flush=True)
            go.wait()
            go.clear()
        compile_part()
    # Skip the interpreter's shutdown, which takes a second.
    os._exit(0 if KernelCache.all_saved else _NOT_KEPT)


def _listen(go: threading.Event) -> None:
    """Exit when the planner, which holds the other end of stdin, exits."""
    while os.read(0, 1):
        go.set()
    os._exit(1)
