"""The control process: one rehearsal at a fixed rate with its own clock, away from the page."""

from __future__ import annotations

import gc
import multiprocessing
import signal
import threading
import time
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..control import ControlSettings
from ..errors import ControlError, VfixError
from ..geometry.mesh import TriangleMesh
from ..geometry.path import SplinePath
from ..geometry.proximity import ProximityTree
from ..robots import RobotModel, Tool
from .control_loop import ControlLoop
from .events import Event
from .mailbox import Mailbox
from .preparation import warm_up
from .priority import RealTimePriority
from .rehearsal import Rehearsal
from .scene import Scene
from .snapshot import Snapshot
from .wire import INPUT_BYTES, SNAPSHOT_BYTES, HandInput, snapshot_from_bytes

Array = NDArray[np.float64]

START_TIMEOUT_S = 120.0  # the first start after an installation compiles the kernels
CLOSE_TIMEOUT_S = 2.0


@dataclass(frozen=True)
class SceneSpec:
    """A scene as plain arrays and names, to be sent to another process; see Scene for the meaning."""

    vertices: Array
    faces: NDArray[np.int32]
    robot: str
    tool: str
    base: Array
    q_start: Array
    path_points: Array | None
    targets: Array
    target_names: tuple[str, ...]

    def build(self) -> Scene:
        """The scene itself; the proximity tree is built here."""
        path = None if self.path_points is None else SplinePath(self.path_points)
        tree = ProximityTree(TriangleMesh(self.vertices, self.faces))
        robot, tool = RobotModel.load(self.robot), Tool.load(self.tool)
        return Scene(tree, robot, tool, self.base, self.q_start, path, self.targets, self.target_names)


class RehearsalProcess:
    """A rehearsal in a process of its own; every method may be called from any thread."""

    def __init__(self, scene: SceneSpec, settings: ControlSettings, real_time: bool = True):
        """real_time: take a real-time priority while somebody drives, where the system allows it."""
        self._lock = threading.Lock()
        self._out, self._in = Mailbox.create(SNAPSHOT_BYTES), Mailbox.create(INPUT_BYTES)
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_main,
            args=(scene, settings, self._out.name, self._in.name, theirs, real_time),
            name="vfix-control",
            daemon=True,
        )
        self._theirs = theirs
        self._input = HandInput()
        self._latest: Snapshot | None = None
        self._seen = 0
        self._closed = False

    def start(self) -> None:
        """Start the process; it says 'ready' when it can be driven."""
        self._process.start()
        self._theirs.close()

    def wait_ready(self, timeout: float = START_TIMEOUT_S) -> None:
        """Wait until it can be driven.

        Raises:
            ControlError: it refused to start (the reason is in the message) or did not answer in time.
        """
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            for event in self.events():
                if event.kind == "ready":
                    return
                if event.kind in ("refused", "failed"):
                    raise ControlError(event.text)
            if not self.alive:
                raise ControlError("the control process ended before it was ready; start the rehearsal again")
            time.sleep(0.01)
        raise ControlError(f"the control process was not ready within {timeout:.0f} s")

    @property
    def alive(self) -> bool:
        """Whether the control process runs and has not been closed."""
        return not self._closed and self._process.is_alive()

    def set_grip(self, position: ArrayLike) -> None:
        """The hand holds the grip at (3,) in LPS mm; also a heartbeat. Numbers that are none are ignored."""
        grip = np.asarray(position, dtype=float)
        if grip.shape != (3,) or not np.isfinite(grip).all():
            return
        place = (float(grip[0]), float(grip[1]), float(grip[2]))
        self._put(lambda i: replace(i, grip=place, pressed=True, moves=i.moves + 1, beats=i.beats + 1))

    def heartbeat(self) -> None:
        """The button or key is still down; a hand that has been silent for 100 ms has to take hold anew."""
        self._put(lambda i: replace(i, beats=i.beats + 1))

    def release(self) -> None:
        """The hand lets go of everything."""
        self._put(lambda i: replace(i, grip=None, pressed=False, drive=0, twist=0, moves=i.moves + 1))

    def drive(self, direction: int) -> None:
        """Along the path: −1 back, 0 stop, +1 forward; needs heartbeats like the grip."""
        self._put(lambda i: replace(i, drive=_sign(direction), presses=i.presses + (direction != 0)))

    def twist(self, direction: int) -> None:
        """About the shaft: −1, 0, +1; needs heartbeats like the grip."""
        self._put(lambda i: replace(i, twist=_sign(direction), presses=i.presses + (direction != 0)))

    def run(self) -> None:
        """Let the clock tick; the tool moves when a hand moves it."""
        self._send("run")

    def pause(self) -> None:
        """Stop the clock where it is; ``run`` goes on from there."""
        self._send("pause")

    def reset(self) -> None:
        """Back to the entry, paused."""
        self._send("reset")

    def set_mode(self, mode: str, target_index: int | None = None) -> None:
        """Another of ``rehearsal.MODES``; ``target_index`` is the target of 'inspect', the first by default."""
        self._send("mode", mode, 0 if target_index is None else int(target_index))

    def set_settings(self, settings: ControlSettings) -> None:
        """Takes effect at once; margin and rate included."""
        self._send("settings", settings)

    def ask_record(self) -> None:
        """Ask how the clock has kept its period since the start; the answer is an event of the kind 'record'."""
        self._send("record")

    def snapshot(self) -> Snapshot | None:
        """The newest snapshot, or None before the first."""
        with self._lock:
            if self._closed:
                return self._latest
            news = self._out.read(self._seen)
            if news is not None:
                self._seen = news[0]
                self._latest = snapshot_from_bytes(news[1])
            return self._latest

    def events(self) -> list[Event]:
        """What the process has said since the last call."""
        with self._lock:
            found: list[Event] = []
            try:
                while not self._closed and self._pipe.poll():
                    found.append(self._pipe.recv())
            except (EOFError, OSError):
                found.append(Event("failed", "the control process ended; start the rehearsal again"))
            return found

    def close(self) -> None:
        """End the process and free its mailboxes."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._pipe.close()  # the process ends when its pipe does
            if self._process.pid is not None:
                self._process.join(CLOSE_TIMEOUT_S)
                if self._process.is_alive():
                    self._process.kill()
                    self._process.join()
            self._out.close()
            self._in.close()

    def _put(self, change: Any) -> None:
        with self._lock:
            if not self._closed:
                self._input = change(self._input)
                self._in.write(self._input.to_bytes())

    def _send(self, verb: str, *values: Any) -> None:
        with self._lock:
            if self._closed:
                raise ControlError("the rehearsal is closed")
            try:
                self._pipe.send((verb, *values))
            except OSError as error:
                raise ControlError("the control process ended; start the rehearsal again") from error


def _sign(direction: int) -> int:
    return (direction > 0) - (direction < 0)


def _main(scene: SceneSpec, settings: ControlSettings, out: str, into: str, pipe: Connection, real_time: bool) -> None:
    """The process's main: builds the scene, says so, and loops until its pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the planner, which closes this pipe
    try:
        rehearsal = Rehearsal(scene.build(), settings)
        warm_up(rehearsal)
        priority = RealTimePriority(real_time)
        loop = ControlLoop(rehearsal, Mailbox.attach(out), Mailbox.attach(into), pipe, priority)
    except VfixError as error:
        pipe.send(Event("refused", str(error)))
        return
    gc.collect()
    gc.freeze()  # what is here stays: no later collection looks through it
    pipe.send(Event("ready"))
    loop.run()
