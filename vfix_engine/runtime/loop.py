"""The loop of the control process for any system: operator input in, certified steps, snapshots out."""

from __future__ import annotations

import gc
import json
import os
import sys
import time
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from ..errors import VfixError
from .clock import SPIN_S, FixedRateClock
from .command import no_command
from .driver import Driver
from .events import Event
from .hand import Hand, HandInput
from .mailbox import Mailbox
from .outbox import Outbox
from .priority import RealTimePriority
from .requests import Note, Request, Reset, SetControl, SetSettings
from .snapshot import Snapshot
from .wire import snapshot_to_bytes

PUBLISH_S = 1 / 120  # period of snapshots, which are for display
REST_S = 0.005  # sleep of an idle loop
SIGN_S = 0.1  # period of snapshots at rest, which show that the loop is alive
TROUBLES = 8  # distinct failures of background work that are reported; a message with a number is new each time
ANSWERS = 2  # largest number of events caused by one command
GREEDY_SHARE = 0.7  # fraction of the period; longer steps leave too little time to the rest of the machine
LITTER = 20_000  # objects allocated and not freed while driving before a collection of the youngest generation


class ControlLoop:
    """Runs one system at its fixed rate while the operator drives it or it moves, and idles otherwise.

    The loop owns heartbeats, the attenuation of the hand's force, and the clock; a system gets attenuated commands.
    While driving it has a real-time priority if permitted, spins during the last part of every wait, and does not
    collect garbage: everything that can wait is done at rest.
    """

    def __init__(
        self,
        driver: Driver[Any],
        out: Mailbox,
        into: Mailbox,
        commands: Connection,
        events: Outbox,
        priority: RealTimePriority,
        hand: Hand | None = None,
    ):
        self._driver, self._system = driver, driver.system
        self._out, self._in = out, into
        self._commands, self._events, self._priority = commands, events, priority
        self._clock = _clock(self._system.period_s(driver.state))
        self._hand = hand or Hand()
        self._input_seen = 0
        self._running = False
        self._timed = False  # steps count also at rest
        self._driving = False
        self._led = False  # the last step was made with the operator's command
        self._open, self._told = True, set[str]()
        self._published_at = self._obeyed_at = -np.inf
        self._publish(force=True)

    def run(self) -> None:
        """Loop until it is told to end, or the pipe closes."""
        while self._open:
            now = time.monotonic()
            if not self._driving or now - self._obeyed_at >= PUBLISH_S:  # polling the pipe costs 10 µs
                self._obeyed_at = now
                self._obey()
            self._read_hand(now)
            driven = self._running and self._hand.input.active(now)
            timed = self._running and self._timed
            if driven or timed or self._led or not self._system.at_rest(self._driver.state, self._running):
                self._drive()
                self._clock.wait()
                self._tick(time.monotonic(), driven)
                self._clock.worked()
            else:
                self._rest()
                self._driver.poll()
                self._publish(SIGN_S)
                time.sleep(REST_S)
        self._rest()

    def _drive(self) -> None:
        """Start a sequence of ticks."""
        if not self._driving:
            self._driving = True
            gc.disable()
            self._priority.take()
            self._clock.restart()

    def _rest(self) -> None:
        """Do postponed work while the system is at rest without input."""
        if self._driving:
            self._driving = False
            self._priority.give_back()
            self._publish(force=True)
            gc.enable()
            gc.collect()

    def _tick(self, now: float, driven: bool) -> None:
        """Make one step with the operator's command, or without one while the system decelerates or its world moves.

        The step after the last command has none: whoever reads the steps knows that nothing is held any more.
        """
        self._led = driven
        command, system, state = no_command(), self._system, self._driver.state
        if driven:
            command = self._hand.command(system.grip(state), now, system.camera(state))
        self._driver.step(command)
        self._publish(2.0 * PUBLISH_S if self._driver.adopted else PUBLISH_S)  # no tick does both if it can wait

    def _read_hand(self, now: float) -> None:
        news = self._in.read(self._input_seen)
        if news is not None:
            self._input_seen = news[0]
            self._hand.hear(HandInput.from_bytes(news[1]), now)

    def _obey(self) -> None:
        """Handle one message from the page; a failure is reported and has no partial effect.

        One message per tick, so that a flood of them cannot delay ticks, and none while their sender does not read
        answers.
        """
        self._open = self._open and not self._events.ended
        self._tell(self._driver.lost, "it goes on without its results")
        self._tell(self._driver.failed, "its result is missing, and the next one is asked for")
        try:
            if self._open and self._events.free_slots >= ANSWERS and self._commands.poll():
                self._do(self._commands.recv())
        except (EOFError, OSError):
            self._open = False

    def _tell(self, trouble: str, what_now: str) -> None:
        """Report each failure of background work once."""
        if not trouble or trouble in self._told or len(self._told) >= TROUBLES:
            return
        if self._events.put(Event("note", f"{trouble}; {what_now}")):
            self._told.add(trouble)

    def _do(self, message: str | Request) -> None:
        """Carry out one of the verbs 'run', 'pause', 'record' and 'end', or a request to the system."""
        if isinstance(message, Request):
            self._apply(message)
        elif message == "record":
            self._events.put(Event("record", json.dumps(self._clock.record().to_dict())))
        elif message == "end":
            self._open = False
        else:
            if message == "run" and not self._running:
                self._hand.go_on(time.monotonic())
            self._running = message == "run"
        self._publish(force=True)

    def _apply(self, request: Request) -> None:
        if isinstance(request, Reset):
            self._running = self._timed = self._led = False
        try:
            self._driver.apply(request)
            if isinstance(request, Note):
                self._timed = self._timed or request.timed
            if isinstance(request, SetControl):
                self._hand.choose(request.control, time.monotonic())
        except VfixError as error:
            self._events.put(Event("note", str(error)))
        if isinstance(request, SetSettings):
            period = self._system.period_s(self._driver.state)
            if period != self._clock.period:
                self._clock = _clock(period)
            self._events.put(Event("settings", json.dumps(self._driver.settings.to_dict())))

    def _publish(self, every: float = PUBLISH_S, force: bool = False) -> None:
        """Publish a snapshot if the last one is older than ``every`` seconds."""
        now = time.monotonic()
        if not force and now - self._published_at < every:
            return
        self._published_at = now
        snapshot: Snapshot = self._system.snapshot(self._driver.state)
        timing = replace(self._clock.timing(force), real_time=self._priority.held, without_why=self._priority.words)
        self._out.write(snapshot_to_bytes(replace(snapshot, running=self._running, timing=timing)))
        if self._driving:
            if self._clock.busy_share > GREEDY_SHARE:
                self._priority.give_up()
            if gc.get_count()[0] > LITTER:
                gc.collect(0)


def _clock(period: float) -> FixedRateClock:
    """Create a clock that spins only if another core is available to the other processes."""
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return FixedRateClock(period, spin=SPIN_S if cores > 1 else 0.0)
