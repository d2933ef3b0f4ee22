"""The loop inside the control process: hand input in, certified steps, snapshots out."""

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

from ..control import ControlSettings
from ..errors import VfixError
from ..runtime.clock import SPIN_S, FixedRateClock
from ..runtime.events import Event
from ..runtime.handle import Handle
from ..runtime.mailbox import Mailbox
from ..runtime.outbox import Outbox
from ..runtime.priority import RealTimePriority
from .rehearsal import Command, Rehearsal
from .snapshot import Snapshot
from .wire import HandInput, snapshot_to_bytes

PUBLISH_S = 1 / 120  # snapshots are for the eye
REST_S = 0.005  # nap of a loop that nobody drives
SIGN_S = 0.1  # at rest a snapshot this often says that the loop is alive
ANSWERS = 2  # events that one command can cause
STILL = 1e-9  # joint speed in mm/s and rad/s that is none
GREEDY_SHARE = 0.7  # of the period: steps that take more leave too little to the rest of the machine
LITTER = 20_000  # objects made and not freed while driving, after which the youngest are looked through


class ControlLoop:
    """One rehearsal at its fixed rate while a hand drives it, at rest otherwise.

    While it drives it has a real-time priority where it may, spins away the last part of every wait, and collects no
    garbage: no tick pays for what can wait until the hand rests.
    """

    def __init__(
        self,
        rehearsal: Rehearsal,
        out: Mailbox,
        into: Mailbox,
        commands: Connection,
        events: Outbox,
        priority: RealTimePriority,
    ):
        self._rehearsal, self._out, self._in = rehearsal, out, into
        self._commands, self._events, self._priority = commands, events, priority
        self._state = rehearsal.start("path" if rehearsal.scene.path is not None else "free")
        self._clock = _clock(rehearsal.settings.dt_s)
        self._handle = Handle()
        self._input = HandInput()
        self._input_seen = 0
        self._running = False
        self._driving = False
        self._open = True
        self._published_at = self._obeyed_at = -np.inf
        self._publish(rehearsal.snapshot(self._state), force=True)

    def run(self) -> None:
        """Until it is told to end, or the pipe closes."""
        while self._open:
            now = time.monotonic()
            if not self._driving or now - self._obeyed_at >= PUBLISH_S:  # a look into the pipe costs 10 µs
                self._obeyed_at = now
                self._obey()
            self._read_hand(now)
            led = self._running and self._driven(now)
            if led or self._moving():
                self._drive()
                self._clock.wait()
                self._tick(time.monotonic(), led)
                self._clock.worked()
            else:
                self._rest()
                if now - self._published_at >= SIGN_S:
                    self._publish(self._rehearsal.snapshot(self._state))
                time.sleep(REST_S)
        self._rest()

    def _drive(self) -> None:
        """Begin a stretch of ticks."""
        if not self._driving:
            self._driving = True
            gc.disable()
            self._priority.take()
            self._clock.restart()

    def _rest(self) -> None:
        """The tool stands and nobody drives: time for all that had to wait."""
        if self._driving:
            self._driving = False
            self._priority.give_back()
            self._publish(self._rehearsal.snapshot(self._state), force=True)
            gc.enable()
            gc.collect()

    def _moving(self) -> bool:
        """The tool still has speed, which it loses within the joints' accelerations."""
        return bool(np.abs(self._state.tool.velocity).max() > STILL)

    def _tick(self, now: float, led: bool) -> None:
        """One step: the hand's command, or none where the tool only comes to rest."""
        if led:
            settings, tool = self._rehearsal.settings, self._state.tool
            grip = self._rehearsal.scene.tool.grip(tool.tip.rotation, tool.tip.position)
            hand = self._input
            force = self._handle.force(grip, settings.stiffness_n_per_mm, settings.force_cap_n, now)
            keys = hand.keys.share(now)
            command = Command(hand.hand.share(now) * force, keys * hand.drive, keys * hand.twist)
        else:
            command = Command(np.zeros(3))
        self._state, snapshot = self._rehearsal.step(self._state, command)
        self._publish(snapshot)

    def _driven(self, now: float) -> bool:
        return self._input.hand.active(now) or self._input.keys.active(now)

    def _read_hand(self, now: float) -> None:
        news = self._in.read(self._input_seen)
        if news is None:
            return
        self._input_seen = news[0]
        before, self._input = self._input, HandInput.from_bytes(news[1])
        if self._input.moves != before.moves:
            self._handle.move(np.array(self._input.grip), now, onwards=before.hand.active(now))

    def _obey(self) -> None:
        """A command from the page; what cannot be done is said, never half done.

        One at a time, so that a flood of them stops no ticks, and none from whoever does not read the answers.
        """
        self._open = self._open and not self._events.ended
        try:
            if self._open and self._events.room >= ANSWERS and self._commands.poll():
                verb, *values = self._commands.recv()
                try:
                    self._do(verb, values)
                except VfixError as error:
                    self._events.put(Event("note", str(error)))
                if verb == "settings":
                    self._events.put(Event("settings", json.dumps(self._rehearsal.settings.to_dict())))
                elif verb == "record":
                    self._events.put(Event("record", json.dumps(self._clock.record().to_dict())))
        except (EOFError, OSError):
            self._open = False

    def _do(self, verb: str, values: list[Any]) -> None:
        if verb == "end":
            self._open = False
        elif verb == "run":
            self._running = True
        elif verb == "pause":
            self._running = False
        elif verb == "reset":
            self._running = False
            self._state = self._rehearsal.start("path" if self._rehearsal.scene.path is not None else "free")
        elif verb == "mode":
            self._state = self._rehearsal.with_mode(self._state, *values)
        elif verb == "settings":
            self._change_settings(values[0])
        self._publish(self._rehearsal.snapshot(self._state), force=True)

    def _change_settings(self, settings: ControlSettings) -> None:
        """New settings at the same pose and speed; a margin that the pose does not keep is refused."""
        rehearsal = Rehearsal(self._rehearsal.scene, settings)
        rehearsal.controller.start(self._state.tool.q)
        self._rehearsal = rehearsal
        if settings.dt_s != self._clock.period:
            self._clock = _clock(settings.dt_s)

    def _publish(self, snapshot: Snapshot, force: bool = False) -> None:
        now = time.monotonic()
        if not force and now - self._published_at < PUBLISH_S:
            return
        self._published_at = now
        timing = replace(self._clock.timing(force), real_time=self._priority.held, without_why=self._priority.words)
        self._out.write(snapshot_to_bytes(replace(snapshot, running=self._running, timing=timing)))
        if self._driving:
            if self._clock.busy_share > GREEDY_SHARE:
                self._priority.give_up()
            if gc.get_count()[0] > LITTER:
                gc.collect(0)


def _clock(period: float) -> FixedRateClock:
    """A clock that spins only where another core is left to everybody else."""
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return FixedRateClock(period, spin=SPIN_S if cores > 1 else 0.0)
