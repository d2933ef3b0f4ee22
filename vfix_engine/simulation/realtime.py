"""The control process: one rehearsal at a fixed rate with its own clock, away from the page."""

from __future__ import annotations

import atexit
import gc
import multiprocessing
import signal
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..control import ControlSettings
from ..errors import ControlError, VfixError
from ..geometry.mesh import TriangleMesh
from ..geometry.path import SplinePath
from ..geometry.places import FARTHEST_MM
from ..geometry.proximity import ProximityTree
from ..robots import RobotModel, Tool
from ..runtime.events import Event
from ..runtime.mailbox import Mailbox
from ..runtime.outbox import Outbox
from ..runtime.priority import RealTimePriority
from .control_loop import ControlLoop
from .preparation import warm_up
from .rehearsal import Rehearsal
from .scene import Scene
from .snapshot import Snapshot
from .wire import INPUT_BYTES, SNAPSHOT_BYTES, HandInput, snapshot_from_bytes

Array = NDArray[np.float64]

START_TIMEOUT_S = 120.0  # the first start after an installation compiles the kernels
CLOSE_TIMEOUT_S = 0.5  # a process that has not ended by itself by then is killed
LAST_WORD_S = 0.5  # for a process that ends to say why
UNANSWERED = "the control process does not answer, or nobody reads its events; close the rehearsal and start it again"
CLOSED = "the rehearsal is closed"
ENDED = "the control process ended; start the rehearsal again"


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
    """A rehearsal in a process of its own; every method may be called from any thread.

    None waits for the process but ``wait_ready`` and ``close``, not even for one that is stopped or hangs.
    """

    def __init__(self, scene: SceneSpec, settings: ControlSettings, real_time: bool = True):
        """real_time: take a real-time priority while somebody drives, where the system allows it."""
        self._lock = threading.Lock()
        self._starting = threading.Lock()  # taken before _lock; start and close are never at work side by side
        self._out, self._in = Mailbox.create(SNAPSHOT_BYTES), Mailbox.create(INPUT_BYTES)
        context = multiprocessing.get_context("spawn")
        self._pipe, self._theirs = context.Pipe()
        self._process = context.Process(
            target=_main,
            args=(self._out.name, self._in.name, self._theirs, real_time),
            name="vfix-control",
            daemon=True,
        )
        self._outbox = Outbox(self._pipe)
        self._first = (scene, settings)
        self._input = HandInput()
        self._latest: Snapshot | None = None
        self._seen = 0
        self._heard_at = time.monotonic()
        self._closed = self._end_told = False

    def start(self) -> None:
        """Start the process; it says 'ready' when it can be driven.

        Raises:
            ControlError: it has been closed.
        """
        with self._starting:
            if self._closed:
                raise ControlError(CLOSED)
            self._process.start()
            self._theirs.close()
            atexit.register(self.close)  # before multiprocessing waits for it, in vain where it is stopped
            self._outbox.put(self._first)

    def wait_ready(self, timeout: float = START_TIMEOUT_S) -> None:
        """Wait until it can be driven.

        Raises:
            ControlError: it refused to start (the reason is in the message) or did not answer in time.
        """
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            alive = self.alive  # asked first: what an ending process has said is heard before its end
            for event in self.events():
                if event.kind == "ready":
                    return
                if event.kind in ("refused", "failed"):
                    raise ControlError(event.text)
            if not alive:
                raise ControlError("the control process ended before it was ready; start the rehearsal again")
            time.sleep(0.01)
        raise ControlError(f"the control process was not ready within {timeout:.0f} s")

    @property
    def alive(self) -> bool:
        """Whether the control process runs and has not been closed."""
        return not self._closed and self._process.is_alive()

    def set_grip(self, position: ArrayLike) -> None:
        """The hand takes the grip to (3,) in LPS mm; also a heartbeat. What is no place of a tool is ignored."""
        grip = np.asarray(position, dtype=float)
        if grip.shape != (3,) or not (np.abs(grip) <= FARTHEST_MM).all():
            return
        place = (float(grip[0]), float(grip[1]), float(grip[2]))
        self._put(lambda i, now: replace(i, grip=place, moves=i.moves + 1, hand=i.hand.press(now)))

    def heartbeat(self) -> None:
        """The button or key is still down; a hand that has been silent for 100 ms has to take hold anew."""
        self._put(lambda i, now: replace(i, hand=i.hand.beat(now), keys=i.keys.beat(now)))

    def release(self) -> None:
        """The hand lets go of everything."""
        self._put(lambda i, now: replace(i, drive=0, twist=0, hand=i.hand.release(now), keys=i.keys.release(now)))

    def drive(self, direction: int) -> None:
        """Along the path: −1 back, 0 stop, +1 forward; needs heartbeats like the grip."""
        self._put(lambda i, now: _key(replace(i, drive=_sign(direction)), direction, now))

    def twist(self, direction: int) -> None:
        """About the shaft: −1, 0, +1; needs heartbeats like the grip."""
        self._put(lambda i, now: _key(replace(i, twist=_sign(direction)), direction, now))

    def run(self) -> None:
        """Let the clock tick; the tool moves when a hand moves it."""
        self._send("run")

    def pause(self) -> None:
        """Stop the clock where it is; ``run`` goes on from there."""
        self._send("pause")

    def reset(self) -> None:
        """Back to the entry, paused; the hand has to take hold anew."""
        self.release()
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
                self._seen, self._heard_at = news[0], time.monotonic()
                self._latest = snapshot_from_bytes(news[1])
            return self._latest

    @property
    def hand_lost(self) -> bool:
        """A hand or key that nobody let go of was not heard of for so long that it no longer counts."""
        now = time.monotonic()
        return self._input.hand.lost(now) or self._input.keys.lost(now)

    @property
    def silence_s(self) -> float:
        """Seconds since the last snapshot. Once it is ready, one comes every ``SIGN_S`` at least, or the loop hangs."""
        self.snapshot()
        return time.monotonic() - self._heard_at

    def events(self) -> list[Event]:
        """What the process has said since the last call; that it has ended is said once, why before that."""
        with self._lock:
            found: list[Event] = []
            try:
                while not (self._closed or self._end_told) and self._pipe.poll():
                    found.append(self._pipe.recv())
            except (EOFError, OSError):
                self._end_told = True
                found.append(Event("failed", ENDED))
            return found

    def close(self) -> None:
        """End the process within a second, by force where it does not end by itself, and free its mailboxes."""
        with self._starting:
            with self._lock:
                if self._closed:
                    return
                self._closed = True
            atexit.unregister(self.close)
            if self._process.pid is not None:
                self._outbox.put(("end",))
                self._process.join(CLOSE_TIMEOUT_S)
                if self._process.is_alive():
                    self._process.kill()
                    self._process.join()
            self._outbox.end()
            self._outbox.join()
            self._pipe.close()
            self._theirs.close()
            self._out.close()
            self._in.close()

    def _put(self, change: Callable[[HandInput, float], HandInput]) -> None:
        with self._lock:
            if not self._closed:
                self._input = change(self._input, time.monotonic())
                self._in.write(self._input.to_bytes())

    def _send(self, verb: str, *values: Any) -> None:
        with self._lock:
            if self._closed:
                raise ControlError(CLOSED)
            if not self._process.is_alive():
                raise ControlError(ENDED)
            if not self._outbox.put((verb, *values)):
                raise ControlError(UNANSWERED)


def _sign(direction: int) -> int:
    return (direction > 0) - (direction < 0)


def _key(hand: HandInput, direction: int, now: float) -> HandInput:
    """After a key went down, or up where the direction is 0: then it is held only as long as another one is."""
    if direction:
        return replace(hand, keys=hand.keys.press(now))
    return hand if hand.drive or hand.twist else replace(hand, keys=hand.keys.release(now))


def _main(out: str, into: str, pipe: Connection, real_time: bool) -> None:
    """The process's main: builds the scene, says so, and loops until it is told to end or its pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the planner, which closes this pipe
    events = Outbox(pipe)
    try:
        scene, settings = pipe.recv()
        rehearsal = Rehearsal(scene.build(), settings)
        warm_up(rehearsal)
        priority = RealTimePriority(real_time)
        loop = ControlLoop(rehearsal, Mailbox.attach(out), Mailbox.attach(into), pipe, events, priority)
        gc.collect()
        gc.freeze()  # what is here stays: no later collection looks through it
        events.put(Event("ready"))
        loop.run()
    except VfixError as error:
        events.put(Event("refused", str(error)))
    except EOFError:
        pass  # closed before it began
    except Exception as error:
        traceback.print_exc()  # to the planner's log
        words = f"the control process failed ({type(error).__name__}: {error}); start the rehearsal again"
        events.put(Event("failed", words))
    events.flush(LAST_WORD_S)
