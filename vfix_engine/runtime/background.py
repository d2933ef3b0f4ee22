"""Background work that takes longer than a step: requested after one step, adopted before a later one.

There is one worker with one job at a time: when it is free it gets the request of the newest state; none are queued.
An adoption is an input of the run like a command: it is recorded with its step and its content.
"""

from __future__ import annotations

import sys
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any, NamedTuple, Protocol

from ..error_places import error_places
from .outbox import Outbox
from .system import Background, SystemSpec, Worker

MADE = 0  # request number in the answer that the worker was built, or why it could not; requests count from 1


class PackedResult:
    """A worker's answer as it came over the pipe; sent on and unpickled it is the result, which nobody packs again."""

    def __init__(self, answer: bytes):
        self._answer = answer

    def __reduce__(self) -> tuple[Any, ...]:
        return _result_of, (self._answer,)


def _result_of(answer: bytes) -> Any:
    return ForkingPickler.loads(answer)[1]


class Adoption(NamedTuple):
    """A finished result; ``steps``: of the state that requested it. packed: the result for a log in another process."""

    result: Any
    steps: int
    packed: PackedResult | None = None


class Workers(Protocol):
    """Executor of background work: a process, the calling thread, or none."""

    @property
    def free(self) -> bool:
        """Whether ``ask`` may be called."""
        ...

    @property
    def lost(self) -> str:
        """Reason why the worker has ended; '' while it runs or if there never was one."""
        ...

    @property
    def failed(self) -> str:
        """Reason of the last failed job; '' if none failed."""
        ...

    def ask(self, request: Background) -> None:
        """Start this job."""
        ...

    def take(self, steps: int) -> Adoption | None:
        """Return the result once, when it is available; ``steps``: of the present state."""
        ...

    def forget(self) -> None:
        """Discard the job in progress, because the system was reset."""
        ...


class NoWorker:
    """Null implementation for worlds without background work."""

    free, lost, failed = False, "", ""

    def ask(self, request: Background) -> None:
        raise RuntimeError("there is no worker")

    def take(self, steps: int) -> Adoption | None:
        return None

    def forget(self) -> None:
        pass


class InlineWorker:
    """Works synchronously in the caller's thread; the result is adopted at a fixed simulated age.

    The same inputs give the same run on every machine: for scripts, studies and tests.

    Args:
        work: the spec's worker; age_steps: control periods from the request to its adoption, at least 1.
    """

    lost = failed = ""

    def __init__(self, work: Worker, age_steps: int):
        self._work, self._age = work, max(age_steps, 1)
        self._ready: Adoption | None = None

    @property
    def free(self) -> bool:
        return self._ready is None

    def ask(self, request: Background) -> None:
        self._ready = Adoption(self._work(request.inputs), request.steps)

    def take(self, steps: int) -> Adoption | None:
        ready = self._ready
        if ready is None or steps < ready.steps + self._age:
            return None
        self._ready = None
        return ready

    def forget(self) -> None:
        self._ready = None


class WorkerLink:
    """The control process's end of the pipe to its worker process; no method blocks.

    lost: reason why the worker has ended, '' while it runs; the system then continues without results.
    made: set once the worker has been built, or is lost: before that it answers nothing.
    failed: reason of the last failed job; the next one is requested as usual.
    """

    def __init__(self, pipe: Connection):
        self._pipe, self._outbox = pipe, Outbox(pipe)
        self._asked: int | None = None  # steps of the state that the worker processes
        self._number = self._wanted_from = 0
        self._found: tuple[int, Any, str, bytes] | None = None
        self.lost = self.failed = ""
        self.made = threading.Event()
        threading.Thread(target=self._listen, name="vfix-worker-link", daemon=True).start()

    @property
    def free(self) -> bool:
        return self._asked is None and not self.lost

    def ask(self, request: Background) -> None:
        self._number, self._asked = self._number + 1, request.steps
        self._outbox.put((self._number, request.inputs))

    def take(self, steps: int) -> Adoption | None:
        if self._found is None or self._asked is None:
            return None
        (number, result, error, answer), self._found = self._found, None
        asked, self._asked = self._asked, None
        self.failed = error or self.failed
        wanted = number >= self._wanted_from and not error
        return Adoption(result, asked, PackedResult(answer)) if wanted else None

    def forget(self) -> None:
        self._wanted_from = self._number + 1

    def _listen(self) -> None:
        try:
            while True:
                answer = self._pipe.recv_bytes()
                number, result, error = ForkingPickler.loads(answer)
                if number == MADE:
                    self.lost = error
                    if error:
                        return
                    self.made.set()
                    continue
                self._found = (number, result, error, answer)
        except (EOFError, OSError):
            self.lost = "the worker process ended"
        except Exception as error:  # the result cannot be unpickled
            self.lost = f"the worker process cannot be understood ({type(error).__name__})"
        finally:
            self.made.set()


def work(spec: SystemSpec, pipe: Connection) -> None:
    """Run the worker process: build the spec's worker, say so, and answer requests until the pipe closes.

    After a failed job the worker is built again, because its internal state is unknown.
    """
    worker: Worker | None = None
    with suppress(EOFError, OSError):  # the pipe is closed: no more requests
        while True:
            if worker is None:
                try:
                    worker = spec.worker()
                except Exception as error:
                    pipe.send((MADE, None, _failure("the worker process failed", error)))
                    return
                pipe.send((MADE, None, ""))
            number, inputs = pipe.recv()
            try:
                answer = ForkingPickler.dumps((number, worker(inputs), ""))
            except Exception as error:
                worker, answer = None, ForkingPickler.dumps((number, None, _failure("background work failed", error)))
            pipe.send_bytes(answer)


def _failure(what: str, error: Exception) -> str:
    print(error_places(error), file=sys.stderr)  # goes to the log of the parent process
    return f"{what} ({type(error).__name__}: {error})"
