"""The loop inside the control process: hand input in, certified steps, snapshots out."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from ..control import ControlSettings
from ..errors import VfixError
from .clock import FixedRateClock
from .events import Event
from .handle import Handle
from .mailbox import Mailbox
from .rehearsal import Command, Rehearsal
from .snapshot import Snapshot
from .wire import HandInput, snapshot_to_bytes

PUBLISH_S = 1 / 120  # snapshots are for the eye
REST_S = 0.005  # nap of a loop that nobody drives


class ControlLoop:
    """One rehearsal at its fixed rate while a hand drives it, at rest otherwise."""

    def __init__(self, rehearsal: Rehearsal, out: Mailbox, into: Mailbox, pipe: Connection):
        self._rehearsal, self._out, self._in, self._pipe = rehearsal, out, into, pipe
        self._state = rehearsal.start("path" if rehearsal.scene.path is not None else "free")
        self._clock = FixedRateClock(rehearsal.settings.dt_s)
        self._handle = Handle()
        self._input = HandInput()
        self._input_seen = 0
        self._keys_beat_at = -np.inf
        self._running = False
        self._open = True
        self._published_at = -np.inf
        self._publish(rehearsal.snapshot(self._state), force=True)

    def run(self) -> None:
        """Until the pipe closes."""
        resting = True
        while self._open:
            self._obey()
            now = time.monotonic()
            self._read_hand(now)
            if not (self._running and self._driven(now)):
                if not resting:
                    self._publish(self._rehearsal.snapshot(self._state), force=True)
                resting = True
                time.sleep(REST_S)
                continue
            if resting:
                self._clock.restart()
                resting = False
            self._clock.wait()
            self._tick(time.monotonic())
            self._clock.worked()

    def _tick(self, now: float) -> None:
        settings, tool = self._rehearsal.settings, self._state.tool
        grip = self._rehearsal.scene.tool.grip(tool.tip.rotation, tool.tip.position)
        force = self._handle.force(grip, settings.stiffness_n_per_mm, settings.force_cap_n, now)
        keys = self._keys_alive(now)
        command = Command(force, self._input.drive if keys else 0, self._input.twist if keys else 0)
        self._state, snapshot = self._rehearsal.step(self._state, command)
        self._publish(snapshot)

    def _driven(self, now: float) -> bool:
        return self._handle.active(now) or (self._keys_alive(now) and bool(self._input.drive or self._input.twist))

    def _keys_alive(self, now: float) -> bool:
        return self._handle.fresh(self._keys_beat_at, now)

    def _read_hand(self, now: float) -> None:
        news = self._in.read(self._input_seen)
        if news is None:
            return
        self._input_seen = news[0]
        before, self._input = self._input, HandInput.from_bytes(news[1])
        if self._input.beats != before.beats:
            self._keys_beat_at = now
            self._handle.beat(now)
        if self._input.moves != before.moves:
            if self._input.pressed and self._input.grip is not None:
                self._handle.press(np.array(self._input.grip), now)
            else:
                self._handle.release(now)

    def _obey(self) -> None:
        """Commands from the page; what cannot be done is said, never half done."""
        try:
            while self._pipe.poll():
                verb, *values = self._pipe.recv()
                try:
                    self._do(verb, values)
                except VfixError as error:
                    self._pipe.send(Event("note", str(error)))
                if verb == "settings":
                    self._pipe.send(Event("settings", json.dumps(self._rehearsal.settings.to_dict())))
        except (EOFError, OSError):
            self._open = False

    def _do(self, verb: str, values: list[Any]) -> None:
        if verb == "run":
            self._running = True
        elif verb == "pause":
            self._running = False
        elif verb == "reset":
            self._running = False
            self._handle = Handle()
            self._state = self._rehearsal.start("path" if self._rehearsal.scene.path is not None else "free")
        elif verb == "mode":
            self._state = self._rehearsal.with_mode(self._state, *values)
        elif verb == "settings":
            self._change_settings(values[0])
        self._publish(self._rehearsal.snapshot(self._state), force=True)

    def _change_settings(self, settings: ControlSettings) -> None:
        """New settings at the same pose; a margin that the pose does not keep is refused."""
        rehearsal = Rehearsal(self._rehearsal.scene, settings)
        tool = rehearsal.controller.start(self._state.tool.q)
        self._rehearsal, self._state = rehearsal, replace(self._state, tool=tool)
        self._clock = FixedRateClock(settings.dt_s)

    def _publish(self, snapshot: Snapshot, force: bool = False) -> None:
        now = time.monotonic()
        if force or now - self._published_at >= PUBLISH_S:
            self._published_at = now
            told = replace(snapshot, running=self._running, timing=self._clock.timing())
            self._out.write(snapshot_to_bytes(told))
