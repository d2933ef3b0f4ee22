"""One system and its present state: steps, requests and adoptions, in the order in which they are recorded."""

from __future__ import annotations

from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from ..arrays import Array
from .background import NoWorker, PackedResult, Workers
from .command import COMMAND_SIZE, Command, command_to_row
from .operator import Act
from .requests import Note, Request, Reset
from .settings import WorldSettings
from .system import System

S = TypeVar("S")


class Log(Protocol):
    """Destination of a recorded run; see ``run.RunWriter`` and ``ring.RingLog``."""

    def tick(self, line: Array) -> None:
        """Record one step: the applied command, then the system's row; the array is reused."""
        ...

    def event(self, kind: str, content: Any) -> None:
        """Record an event that occurred before the next step."""
        ...


class Driver(Generic[S]):
    """Steps a system; the clock belongs to the loop.

    Args:
        workers: executor of background work; None: no background work.
        log: destination of every step and event; None: nothing is recorded, and no row is computed.
    """

    def __init__(self, system: System[S], workers: Workers | None = None, log: Log | None = None):
        self.system, self._workers, self.log = system, workers or NoWorker(), log
        self._line = np.zeros(COMMAND_SIZE + len(system.row_layout))
        self._row = self._line[COMMAND_SIZE:]
        self.state: S = system.start()
        self.adopted = False  # whether the last poll adopted a result

    @property
    def settings(self) -> WorldSettings:
        """Settings in force."""
        return self.system.settings(self.state)

    @property
    def lost(self) -> str:
        """Reason why there is no more background work, '' while there is."""
        return self._workers.lost

    @property
    def failed(self) -> str:
        """Reason of the last failed background job, '' if none failed."""
        return self._workers.failed

    def step(self, command: Command) -> S:
        """Advance by one control period."""
        self.poll()
        self.state = state = self.system.step(self.state, command)
        if self.log is not None:
            command_to_row(command, self._line)
            self.system.row(state, self._row)
            self.log.tick(self._line)
        return state

    def act(self, act: Act) -> S:
        """Carry out what an operator does: its requests, then one control period. Raises as ``apply``."""
        for request in act.requests:
            self.apply(request)
        return self.step(act.command)

    def apply(self, request: Request) -> S:
        """Apply a request between two steps; if it raises, the state is unchanged.

        Raises:
            ControlError, InputError: see ``System.apply``; StartRefused: the start of a reset is refused.
        """
        if isinstance(request, Reset):
            self.state = self.system.start()
            self._workers.forget()
        elif not isinstance(request, Note):
            self.state = self.system.apply(self.state, request)
        if self.log is not None:
            self.log.event("request", request)
        return self.state

    def poll(self) -> None:
        """Adopt a finished result of the worker, and give it the next job."""
        workers = self._workers
        done = workers.take(self.system.steps(self.state))
        self.adopted = done is not None
        if done is not None:
            self.adopt(*done)
        if workers.free:
            request = self.system.background(self.state)
            if request is not None:
                workers.ask(request)

    def adopt(self, result: Any, asked_at: int, packed: PackedResult | None = None) -> None:
        """Adopt a worker's result into the state.

        asked_at: steps of the state that requested it. packed: the same for a log in another process, if there is one.
        """
        system = self.system
        if self.log is not None:
            self.log.event("adopt", {"result": result if packed is None else packed, "steps": asked_at})
        age = (system.steps(self.state) - asked_at) * system.period_s(self.state)
        self.state = system.adopt(self.state, result, age)
