"""The control process: one system at a fixed rate with its own clock, isolated from the page."""

from __future__ import annotations

import atexit
import multiprocessing
import multiprocessing.process
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Generic, TypeVar
from weakref import WeakSet

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ControlError
from ..validate import FARTHEST_MM
from .child_process import control_main, worker_main
from .control_mode import Control, checked_control
from .events import Event
from .hand import INPUT_BYTES, HandInput, share
from .mailbox import Mailbox
from .outbox import Outbox
from .requests import Request, Reset, SetControl
from .ring import Ring, RowReader, written_rows
from .run_recorder import FarEnd, RunRecorder
from .snapshot import Snapshot
from .system import SystemSpec
from .virtual_coupling import NOBODY
from .wire import SnapshotReader, snapshot_bytes

T = TypeVar("T", bound=Snapshot)

START_TIMEOUT_S = 120.0  # without a word of a process that starts; one that compiles kernels tells each
CLOSE_TIMEOUT_S = 0.5  # after this a process that has not ended is killed
UNANSWERED = "the control process does not answer, or nobody reads its events; close the rehearsal and start it again"
CLOSED = "the rehearsal is closed"
ENDED = "the control process ended; start the rehearsal again"


class ControlProcess(Generic[T]):
    """A system in a process of its own; every method is thread-safe.

    Only ``wait_ready`` and ``close`` block; the others return at once even if the process is stopped or hangs.

    Args:
        spec: of the system; T is the type of its snapshots.
        real_time: use a real-time priority while the operator drives, if the system permits it.
        record: folder to which the whole run is written; None: no recording.
        control: mode and device at the start; None: those of the world. preset: name in the run's manifest.

    Raises:
        InputError: the world cannot be driven in that mode.
    """

    def __init__(
        self,
        spec: SystemSpec,
        real_time: bool = True,
        record: Path | None = None,
        control: Control | None = None,
        preset: str | None = None,
    ):
        if control is not None:
            checked_control(spec.world, control)
        self._lock = threading.Lock()
        self._starting = threading.Lock()  # acquired before _lock; start and close never run concurrently
        self._out, self._in = Mailbox.create(snapshot_bytes(spec.snapshot_numbers)), Mailbox.create(INPUT_BYTES)
        context = multiprocessing.get_context("spawn")
        self._pipe, self._theirs = context.Pipe()
        self._passed_on: list[Connection] = [self._theirs]  # closed here once the child processes have them
        self._worker: multiprocessing.process.BaseProcess | None = None
        to_worker: Connection | None = None
        if spec.has_worker:
            to_worker, to_control = context.Pipe()
            self._passed_on += [to_worker, to_control]
            self._worker = context.Process(target=worker_main, args=(spec, to_control), name="vfix-worker", daemon=True)
        self._ring = Ring.memory()
        self._readers: WeakSet[RowReader] = WeakSet()
        self._recorder = None
        if record is not None:
            self._recorder = RunRecorder(record, spec, context.Pipe(), self._ring, control, preset)
        log = FarEnd(self._ring.name, None if self._recorder is None else self._recorder.far)
        self._process = context.Process(
            target=control_main,
            args=(self._out.name, self._in.name, self._theirs, real_time, to_worker, log, control),
            name="vfix-control",
            daemon=True,
        )
        self._outbox = Outbox(self._pipe)
        self._spec = spec
        self._reader: SnapshotReader[T] = SnapshotReader(spec.snapshot_type)  # type: ignore[arg-type]
        self._input = HandInput()
        self._latest: T | None = None
        self._seen = 0
        self._heard_at = time.monotonic()
        self._closed = self._end_reported = False
        self._unrecorded_told = set[str]()
        self._unheard: list[Event] = []  # that came together with 'ready'

    def start(self) -> None:
        """Start the process; it sends 'ready' when it can be driven.

        Raises:
            ControlError: it has been closed.
        """
        with self._starting:
            if self._closed:
                raise ControlError(CLOSED)
            self._process.start()
            if self._worker is not None:
                self._worker.start()
            for end in self._passed_on:
                end.close()
            atexit.register(self.close)  # before multiprocessing's handler, which waits forever for a stopped process
            self._outbox.put(self._spec)
            if self._recorder is not None:
                self._recorder.start()

    def wait_ready(self, timeout: float = START_TIMEOUT_S, heard: Callable[[int], None] | None = None) -> None:
        """Wait until the system can be driven, as long as the process is heard of.

        Args:
            timeout: s since the process was heard of last; the compilation of a kernel is a sign of it.
            heard: called with the number of kernels compiled so far, whenever it changes.

        Raises:
            ControlError: it refused to start (the message has the reason) or was silent for so long.
        """
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            alive = self.alive  # read first, so that the events of an ending process are seen before its end
            said = self._said()
            for number, event in enumerate(said, 1):
                if event.kind == "ready":
                    self._unheard = said[number:]
                    return
                if event.kind == "compiled":
                    deadline = time.monotonic() + timeout
                    if heard is not None:
                        heard(int(event.text))
                if event.kind in ("refused", "failed"):
                    raise ControlError(event.text)
            if not alive:
                raise ControlError("the control process ended before it was ready; start the rehearsal again")
            time.sleep(0.01)
        raise ControlError(f"the control process is not ready, and has said nothing for {timeout:.0f} s")

    @property
    def recording_thread(self) -> threading.Thread | None:
        """The thread of this process that writes the run; None without recording."""
        return None if self._recorder is None else self._recorder.thread

    @property
    def alive(self) -> bool:
        """Whether the control process runs and has not been closed."""
        return not self._closed and self._process.is_alive()

    def set_grip(self, position: ArrayLike, turns: bool = False) -> None:
        """Move the grip to (3,) in LPS mm; also a heartbeat. Implausible positions are ignored.

        turns: the hand turns the tool about its tip, in a free hand and with a rate device.
        """
        grip = np.asarray(position, dtype=float)
        if grip.shape != (3,) or not (np.abs(grip) <= FARTHEST_MM).all():
            return
        place = (float(grip[0]), float(grip[1]), float(grip[2]))
        self._put(lambda i, now: replace(i, grip=place, moves=i.moves + 1, turns=turns, hand=i.hand.press(now)))

    def heartbeat(self) -> None:
        """Confirm that the button or key is still down; after 100 ms without this the hand must press again."""
        self._put(HandInput.beaten)

    def release(self) -> None:
        """Release all inputs."""
        self._put(HandInput.released)

    def drive(self, direction: int) -> None:
        """Drive along the path: −1 back, 0 stop, +1 forward; needs heartbeats like the grip."""
        self._put(lambda i, now: _key(replace(i, drive=_sign(direction)), direction, now))

    def twist(self, direction: int) -> None:
        """Rotate about the shaft: −1, 0, +1; needs heartbeats like the grip."""
        self._put(lambda i, now: _key(replace(i, twist=_sign(direction)), direction, now))

    def axes(self, camera_x: float, camera_y: float, insert: float, buttons: int = 0) -> None:
        """Set camera and insertion, from -1 to +1 of full speed, and buttons held; needs heartbeats as a grip does."""
        values = (share(camera_x), share(camera_y), share(insert))
        self._put(lambda i, now: _stick(replace(i, axes=values, buttons=int(buttons)), now))

    def drag(self, right_mm: float, down_mm: float, held: bool) -> None:
        """Tell how far a drag in the picture has come, as the way of the camera, and whether it is held.

        Needs heartbeats. An implausible way ends it.
        """
        plausible = abs(right_mm) <= FARTHEST_MM and abs(down_mm) <= FARTHEST_MM  # False of NaN
        way = (float(right_mm), float(down_mm))
        self._put(lambda i, now: i.pulled(way, bool(held) and plausible, now))

    def wheel(self, depth_mm: float, held: bool) -> None:
        """Tell the depth of the tip that a wheel in the picture wants, and whether that still counts.

        Needs heartbeats. An implausible depth ends it; another insertion does, too.
        """
        plausible = abs(depth_mm) <= FARTHEST_MM  # False of NaN
        self._put(lambda i, now: i.wheeled(float(depth_mm), bool(held) and plausible, now))

    def master(self, position: ArrayLike, clutch: bool) -> None:
        """Tell the sum (3,) in LPS mm of a master's motions so far, and whether it is coupled; needs heartbeats.

        Implausible positions open the clutch.
        """
        place = np.asarray(position, dtype=float)
        if place.shape != (3,) or not (np.abs(place) <= FARTHEST_MM).all():
            place, clutch = np.array(self._input.master), False
        at = (float(place[0]), float(place[1]), float(place[2]))
        self._put(lambda i, now: i.led(at, bool(clutch), now))

    def rate(self, axes: Sequence[float]) -> None:
        """Deflect a rate device: three translations and three rotations, from -1 to +1, in the frame of ``Grip.axes``.

        Needs heartbeats, and to be told again within 0.25 s; six zeros release it.
        """
        x, y, z, turn_x, turn_y, turn_z = axes
        self._put(lambda i, now: i.deflected((x, y, z, turn_x, turn_y, turn_z), now))

    def control(self, control: Control) -> None:
        """Change mode and device between two steps; refused with a note where the world has none such."""
        self._send(SetControl(control))

    def run(self) -> None:
        """Start the clock; the robot moves when the operator or its world moves it."""
        self._send("run")

    def pause(self) -> None:
        """Stop the clock; ``run`` continues from there."""
        self._send("pause")

    def reset(self) -> None:
        """Return to the start, paused; the hand must press again."""
        self.release()
        self._send(Reset())

    def apply(self, request: Request) -> None:
        """Send a typed request; a failure is reported by an event of the kind 'note'."""
        self._send(request)

    def ask_record(self) -> None:
        """Request statistics of the clock since the start; the answer is an event of the kind 'record'."""
        self._send("record")

    def snapshot(self) -> T | None:
        """Return the newest snapshot, or None before the first."""
        with self._lock:
            if self._closed:
                return self._latest
            news = self._out.read(self._seen)
            if news is not None:
                self._seen, self._heard_at = news[0], time.monotonic()
                self._latest = self._reader.read(news[1])
            return self._latest

    def rows(self) -> RowReader:
        """Open a reader of every step's command and row from now on, at control rate and in batches; one per thread.

        Raises:
            ControlError: it is not ready, or has been closed.
        """
        with self._lock:
            if self._closed:
                raise ControlError(CLOSED)
            try:
                reader = RowReader(self._ring.name)
            except ValueError as error:
                raise ControlError(f"the control process has no rows yet: {error}") from None
            self._readers.add(reader)
            return reader

    @property
    def recorded(self) -> int:
        """Number of steps so far that its run has, or will have once they are written. 0 once it is closed."""
        with self._lock:
            lost = 0 if self._recorder is None else self._recorder.lost
            return 0 if self._closed else written_rows(self._ring) - lost

    @property
    def hand_lost(self) -> bool:
        """Whether a hand or key that was not released has timed out."""
        return self._input.lost(time.monotonic())

    @property
    def silence_s(self) -> float:
        """Seconds since the last snapshot. After 'ready' it exceeds ``SIGN_S`` only if the loop hangs."""
        self.snapshot()
        return time.monotonic() - self._heard_at

    def events(self) -> list[Event]:
        """Events of the process and its recorder since the last call; each end is reported once, after its reason."""
        unheard, self._unheard = self._unheard, []
        found, recorder = unheard + self._said(), self._recorder
        if recorder is not None and recorder.failed:
            self._tell_unrecorded(found, "failed", recorder.failed)
        elif recorder is not None and recorder.lost:
            self._tell_unrecorded(found, "lost", "steps are missing, which came faster than they could be written")
        return found

    def _tell_unrecorded(self, found: list[Event], kind: str, words: str) -> None:
        if kind not in self._unrecorded_told:
            self._unrecorded_told.add(kind)
            found.append(Event("unrecorded", words))

    def _said(self) -> list[Event]:
        """Events of the process."""
        with self._lock:
            found: list[Event] = []
            try:
                while not (self._closed or self._end_reported) and self._pipe.poll():
                    found.append(self._pipe.recv())
            except (EOFError, OSError):
                self._end_reported = True
                found.append(Event("failed", ENDED))
            return found

    def close(self) -> None:
        """End the process within a second, killing it if necessary, and free its mailboxes."""
        with self._starting:
            with self._lock:
                if self._closed:
                    return
                self._closed = True
            atexit.unregister(self.close)
            if self._process.pid is not None:
                self._outbox.put("end")
                self._process.join(CLOSE_TIMEOUT_S)
                if self._process.is_alive():
                    self._process.kill()
                    self._process.join()
            if self._worker is not None and self._worker.pid is not None:
                self._worker.kill()  # it holds nothing that must be saved
                self._worker.join()
            self._outbox.end()
            self._outbox.join()
            self._pipe.close()
            for end in self._passed_on:
                end.close()
            if self._recorder is not None:
                self._recorder.close()
            for reader in self._readers:
                reader.ended = True
            self._ring.close()
            self._ring.unlink()
            self._out.close()
            self._in.close()

    def _put(self, change: Callable[[HandInput, float], HandInput]) -> None:
        with self._lock:
            if not self._closed:
                self._input = change(self._input, time.monotonic())
                self._in.write(self._input.to_bytes())

    def _send(self, message: str | Request) -> None:
        with self._lock:
            if self._closed:
                raise ControlError(CLOSED)
            if not self._process.is_alive():
                raise ControlError(ENDED)
            if not self._outbox.put(message):
                raise ControlError(UNANSWERED)


def _sign(direction: int) -> int:
    return (direction > 0) - (direction < 0)


def _key(hand: HandInput, direction: int, now: float) -> HandInput:
    """Update the holds after a key event; with direction 0, a key up, the hold lasts only while another key is down."""
    if direction:
        return replace(hand, keys=hand.keys.press(now))
    return hand if hand.drive or hand.twist else replace(hand, keys=hand.keys.release(now))


def _stick(hand: HandInput, now: float) -> HandInput:
    """Update the hold after an axis or button event; at zero it is released."""
    if any(hand.axes) or hand.buttons:
        return replace(hand, stick=hand.stick.press(now))
    return replace(hand, stick=NOBODY)
