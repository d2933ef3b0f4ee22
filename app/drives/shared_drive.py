"""A drive that clients share: one control process, and the lease of its handle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

from app.drives.drive_process import DriveProcess
from app.drives.drive_record import DriveRecord
from app.drives.lease import Lease
from app.drives.live_comments import RunComment
from app.drives.prepared_drive import PreparedDrive
from app.kit.prompt_threads import PROMPT_THREADS
from app.kit.values import Position
from app.messages.client import Client
from vfix_engine.errors import ControlError
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.requests import Request
from vfix_engine.runtime.snapshot import Snapshot

P = TypeVar("P", bound=PreparedDrive[Any])
T = TypeVar("T", bound=Snapshot)


class SharedDrive(DriveProcess[P, T]):
    """One drive; its methods check the client's role and the lease. Thread-safe."""

    def __init__(self) -> None:
        super().__init__()
        self.lease = Lease()
        self.watchers: set[str] = set()

    def _held(self, client: Client) -> ControlProcess[T] | None:
        return self._live() if self.lease.held_by(client) else None

    def _instructed(self, client: Client) -> ControlProcess[T] | None:
        return self._live() if self.lease.held_by(client) or client.role == "instructs" else None

    def read(self, client: Client, take_words: bool = False) -> DriveRecord[P, T]:
        """The present record; take_words: with the process's messages to the holder, which are returned once."""
        with self._lock:
            process, holder = self._process, self.lease.holder
            mine = holder is not None and holder.id == client.id
            instructs = mine or client.role == "instructs"
            words = tuple(self._words_for_holder) if mine and take_words else ()
            if words:
                self._words_for_holder.clear()
            exchange = self._exchange
            return DriveRecord(
                state=self._state,
                words=self._words,
                fraction=self._fraction if self._state == "starting" else None,
                snapshot=None if process is None else process.snapshot(),
                prepared=self._prepared,
                made_of=self._made_of,
                requested=self._requested,
                settings=None if exchange is None else exchange.in_force,
                answered=0 if exchange is None else exchange.answered,
                refusal="" if exchange is None else exchange.refusal,
                holder=holder,
                mine=mine,
                hand_lost=mine and process is not None and process.hand_lost,
                may_instruct=instructs,
                may_prepare=instructs or (holder is None and client.may_hold),
                words_for_holder=words,
                accepted=exchange.accepted if mine and exchange is not None else {},
                unrecorded=self._unrecorded,
                control=self.control,
                preset=self.preset,
                options=self.options,
                comments=() if self._prepared is None else self._prepared.comments,
            )

    # -- the hand; quick and from any thread

    def set_grip(self, client: Client, position: Position, takes_hold: bool = True, turns: bool = False) -> None:
        """The hand is at (3,) [mm]; a hand that was released has to begin a new hold first.

        turns: it turns the tool about its tip, where the mode has that.
        """
        process = self._process  # a single read needs no lock
        if process is None or not (takes_hold or self._hand == client.id) or not self.lease.held_by(client):
            return
        self._hand = client.id
        process.set_grip(position, turns)
        PROMPT_THREADS.hear()

    def heartbeat(self, client: Client) -> None:
        """The button or key is still down. It never begins a hold: after a decay the hand has to press or to move."""
        if (process := self._held(client)) is not None:
            process.heartbeat()
            PROMPT_THREADS.hear()

    def release(self, client: Client) -> None:
        """The hand releases everything, keys included, even if there is no process at present."""
        if self._hand == client.id:
            self._hand = None
        if (process := self._held(client)) is not None:
            process.release()

    def release_grip(self, client: Client) -> None:
        """The pointer is up; pressed keys stay active if there was no hand on the grip."""
        if self._hand == client.id:
            self.release(client)

    def axes(self, client: Client, camera_x: float, camera_y: float, insert: float, buttons: int = 0) -> None:
        """Camera and insertion, from -1 to +1 of full speed, and the buttons held; they need heartbeats."""
        if (process := self._held(client)) is not None:
            process.axes(camera_x, camera_y, insert, buttons)
            PROMPT_THREADS.hear()

    def drag(self, client: Client, right_mm: float, down_mm: float, held: bool) -> None:
        """How far a drag in the picture has come, as the camera's way, and whether it is held; needs heartbeats."""
        if (process := self._held(client)) is not None:
            process.drag(right_mm, down_mm, held)
            PROMPT_THREADS.hear()

    def wheel(self, client: Client, depth_mm: float, held: bool) -> None:
        """The depth of the tip that a wheel in the picture wants, and whether it still counts; needs heartbeats."""
        if (process := self._held(client)) is not None:
            process.wheel(depth_mm, held)
            PROMPT_THREADS.hear()

    def master(self, client: Client, position: Position, clutch: bool) -> None:
        """The sum (3,) [mm] of a master's motions so far, and whether it is coupled; it needs heartbeats."""
        if (process := self._held(client)) is not None:
            process.master(position, clutch)
            PROMPT_THREADS.hear()

    def rate(self, client: Client, axes: Sequence[float]) -> None:
        """Deflection of a rate device, from -1 to +1; it needs heartbeats, and to be told again while it lasts."""
        if (process := self._held(client)) is not None:
            process.rate(axes)
            PROMPT_THREADS.hear()

    def drive(self, client: Client, direction: int) -> None:
        if (process := self._held(client)) is not None:
            process.drive(direction)
            PROMPT_THREADS.hear()

    def twist(self, client: Client, direction: int) -> None:
        if (process := self._held(client)) is not None:
            process.twist(direction)
            PROMPT_THREADS.hear()

    # -- comments

    def comment(self, text: str) -> RunComment:
        """Any client comments on the drive at its present time.

        Raises ControlError where nothing is driven or recorded, and as `LiveComments.add`.
        """
        with self._lock:
            process, prepared = self._process, self._prepared
        snapshot = None if process is None else process.snapshot()
        if process is None or snapshot is None or prepared is None or prepared.recording is None:
            raise ControlError("there is no drive that is recorded; start one, or comment on a run in Review.")
        step = process.recorded
        with self._lock:
            if self._process is not process:  # it ends, and may have said a step of 0, that of a closed one
                raise ControlError("the drive has ended; comment on its run in Review.")
        return prepared.recording.comments.add(text, round(snapshot.t, 4), step)

    # -- what the holder asks for

    def run(self, client: Client) -> None:
        if (process := self._held(client)) is not None:
            process.run()

    def halt(self) -> None:
        """Any client may pause the robot; only the holder of the handle resumes it."""
        if (process := self._live()) is not None:
            process.pause()

    def pause(self, client: Client) -> None:
        if (process := self._held(client)) is not None:
            process.pause()

    def reset(self, client: Client) -> None:
        if (process := self._held(client)) is not None:
            process.reset()

    def apply(self, client: Client, request: Request) -> None:
        """Send the process a request of its world; it reports a refusal as a note."""
        if (process := self._instructed(client)) is not None:
            process.apply(request)
            with self._lock:
                self._requested = request

    def change_control(self, client: Client, control: Control) -> None:
        """Another mode or device of this drive, at once; the world has to have it."""
        if (process := self._instructed(client)) is not None:
            process.control(control)

    def change_settings(self, client: Client, values: dict[str, float]) -> None:
        """Request other settings from the process, raises InputError for an unknown name or a value out of range."""
        process = self._instructed(client)
        with self._lock:
            settings = None if process is None or self._exchange is None else self._exchange.ask(values)
        if process is not None and settings is not None:
            self._send_settings(process, settings)

    def leave(self, client: Client) -> None:
        """The client is gone: whatever it held is released at once (HAZ-11)."""
        self.release(client)
        self.lease.let_go(client)

    def kept(self, values: dict[str, float]) -> None:
        """The document has stored these settings, or never will."""
        with self._lock:
            if self._exchange is not None:
                self._exchange.kept(values)
