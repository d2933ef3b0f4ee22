"""Work that takes longer than a step: asked for after a step, adopted before a later one.

One worker, one piece of work at a time: whoever is free takes the newest state's request, older ones are never queued.
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

NOT_MADE = 0  # number of the answer that says that there is no worker; requests count from 1


class Adoption(NamedTuple):
    """A result that is ready: ``steps`` of the state that it was asked for."""

    result: Any
    steps: int


class Workers(Protocol):
    """Who does the work: a process, this thread, or nobody."""

    @property
    def free(self) -> bool:
        """Whether ``ask`` may be called."""
        ...

    @property
    def lost(self) -> str:
        """Why nobody works any more, '' while somebody does or nobody ever did."""
        ...

    @property
    def failed(self) -> str:
        """Why the last piece of work that could not be done could not, '' where there was none."""
        ...

    def ask(self, request: Background) -> None:
        """Begin this work."""
        ...

    def take(self, steps: int) -> Adoption | None:
        """The result, once, when it is there; ``steps``: of the present state."""
        ...

    def forget(self) -> None:
        """The system was reset: what is under way is no longer wanted."""
        ...


class NoWorker:
    """For worlds without background work."""

    free, lost, failed = False, "", ""

    def ask(self, request: Background) -> None:
        raise RuntimeError("there is no worker")

    def take(self, steps: int) -> Adoption | None:
        return None

    def forget(self) -> None:
        pass


class InlineWorker:
    """Works at once, in the caller's thread; the result is adopted at a fixed simulated age.

    The same inputs give the same run, whatever the machine: for scripts, studies and tests.

    Args:
        work: the spec's worker; age_steps: control periods from the request to its adoption, 1 at least.
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
    """The control process's end of the pipe to its worker process; no call waits for the worker.

    lost: why there is no worker any more, '' while there is one; the system goes on without results then.
    failed: why a piece of work could not be done; the next one is asked for as if nothing had been.
    """

    def __init__(self, pipe: Connection):
        self._pipe, self._outbox = pipe, Outbox(pipe)
        self._asked: int | None = None  # steps of the state under work
        self._number = self._wanted_from = 0
        self._found: tuple[int, Any, str] | None = None
        self.lost = self.failed = ""
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
        (number, result, error), self._found = self._found, None
        asked, self._asked = self._asked, None
        self.failed = error or self.failed
        return Adoption(result, asked) if number >= self._wanted_from and not error else None

    def forget(self) -> None:
        self._wanted_from = self._number + 1

    def _listen(self) -> None:
        try:
            while True:
                number, result, error = self._pipe.recv()
                if number == NOT_MADE:
                    self.lost = error
                    return
                self._found = (number, result, error)
        except (EOFError, OSError):
            self.lost = "the worker process ended"
        except Exception as error:  # a result that cannot be read back
            self.lost = f"the worker process cannot be understood ({type(error).__name__})"


def work(spec: SystemSpec, pipe: Connection) -> None:
    """The worker process: builds the spec's worker and answers requests until the pipe closes.

    After work that failed it is built anew: nobody knows what the old one remembers.
    """
    worker: Worker | None = None
    with suppress(EOFError, OSError):  # of the pipe: nobody asks any more
        while True:
            if worker is None:
                try:
                    worker = spec.worker()
                except Exception as error:
                    pipe.send((NOT_MADE, None, _failure("the worker process failed", error)))
                    return
            number, inputs = pipe.recv()
            try:
                answer = ForkingPickler.dumps((number, worker(inputs), ""))
            except Exception as error:
                worker, answer = None, ForkingPickler.dumps((number, None, _failure("background work failed", error)))
            pipe.send_bytes(answer)


def _failure(what: str, error: Exception) -> str:
    print(error_places(error), file=sys.stderr)  # to the log of whoever started it
    return f"{what} ({type(error).__name__}: {error})"
