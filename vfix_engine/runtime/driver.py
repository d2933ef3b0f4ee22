"""One system and its present state: steps, requests and adoptions, in the order that a recorder keeps."""

from __future__ import annotations

from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from ..arrays import Array
from .background import NoWorker, Workers
from .command import COMMAND_SIZE, Command, command_to_row
from .requests import Request, Reset
from .settings import WorldSettings
from .system import System

S = TypeVar("S")


class Log(Protocol):
    """Where a run is recorded; see ``run.RunWriter`` and ``ring.RingLog``."""

    def tick(self, line: Array) -> None:
        """One step: the command as applied, then the system's row; the array is used again."""
        ...

    def event(self, kind: str, content: Any) -> None:
        """Something that happened before the next step."""
        ...


class Driver(Generic[S]):
    """Steps a system; without a clock, which is the loop's.

    Args:
        workers: who does background work; None: nobody.
        log: where every step and event goes; None: nowhere, and no row is made.
    """

    def __init__(self, system: System[S], workers: Workers | None = None, log: Log | None = None):
        self.system, self._workers, self.log = system, workers or NoWorker(), log
        self._line = np.zeros(COMMAND_SIZE + len(system.row_layout))
        self._row = self._line[COMMAND_SIZE:]
        self.state: S = system.start()

    @property
    def settings(self) -> WorldSettings:
        """In force."""
        return self.system.settings(self.state)

    @property
    def lost(self) -> str:
        """Why there is no background work any more, '' while there is."""
        return self._workers.lost

    @property
    def failed(self) -> str:
        """Why a piece of background work could not be done, '' where all could."""
        return self._workers.failed

    def step(self, command: Command) -> S:
        """One control period."""
        self.poll()
        self.state = state = self.system.step(self.state, command)
        if self.log is not None:
            command_to_row(command, self._line)
            self.system.row(state, self._row)
            self.log.tick(self._line)
        return state

    def apply(self, request: Request) -> S:
        """A request between two steps; what cannot be done raises, and nothing has happened.

        Raises:
            ControlError, InputError: as ``System.apply``; StartRefused: a reset to a start that is refused.
        """
        if isinstance(request, Reset):
            self.state = self.system.start()
            self._workers.forget()
        else:
            self.state = self.system.apply(self.state, request)
        if self.log is not None:
            self.log.event("request", request)
        return self.state

    def poll(self) -> None:
        """Adopt what the worker has done, and give it the next piece of work."""
        workers = self._workers
        done = workers.take(self.system.steps(self.state))
        if done is not None:
            self.adopt(done.result, done.steps)
        if workers.free:
            request = self.system.background(self.state)
            if request is not None:
                workers.ask(request)

    def adopt(self, result: Any, asked_at: int) -> None:
        """Take a worker's result into the state; ``asked_at``: steps of the state that it was asked for."""
        system = self.system
        if self.log is not None:
            self.log.event("adopt", {"result": result, "steps": asked_at})
        age = (system.steps(self.state) - asked_at) * system.period_s(self.state)
        self.state = system.adopt(self.state, result, age)
