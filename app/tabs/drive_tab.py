"""A tab that drives: which shared drive its client is at, who holds the handle, and the hand on it; for any world."""

from __future__ import annotations

import time
from typing import Any, Generic, TypeVar

from app.drives import commands as c
from app.drives.drive_process import Tell
from app.drives.drive_record import DriveRecord
from app.drives.prepared_drive import PreparedDrive
from app.drives.sections import DriveSection
from app.drives.shared_drive import SharedDrive
from app.drives.shared_drives import DriveKey, SharedDrives
from app.drives.summed_axes import Axes, SummedAxes
from app.drives.view import HAND_LOST, drive_section, motion
from app.kit.kept import Same
from app.messages.client import Client
from app.messages.fields import ClientMessage
from app.scene.hand import GripDrag
from app.services import Services
from app.tabs.base import Tab
from app.workspace.fixed_drive import FIXED, FixedDrive
from app.workspace.workspace import Workspace
from vfix_engine.errors import ControlError
from vfix_engine.runtime.snapshot import Snapshot

P = TypeVar("P", bound=PreparedDrive[Any])
T = TypeVar("T", bound=Snapshot)

NOT_PLACED = "nothing is in place yet. Press Start, and wait until it is."
NOT_HELD = "only the window that holds the handle can do that; you can watch, or take over when it lets go."


class DriveTab(Tab, Generic[P, T]):
    """Owned by the session's thread; others read :attr:`drive` alone.

    P is the type of what a drive is prepared as, T that of its snapshots.
    A subclass calls :meth:`go_to` when another case or document is open, and says in :meth:`prepare` what is driven.
    """

    ticks = True

    @classmethod
    def make_shared(cls, services: Services) -> SharedDrives[P, T]:
        return SharedDrives()

    def __init__(self, workspace: Workspace, shared: SharedDrives[P, T]) -> None:
        super().__init__(workspace, shared)
        self._drives = shared
        self.key: DriveKey | None = None  # of what is open
        self.drive: SharedDrive[P, T] | None = None
        self.now: DriveRecord[P, T] = DriveRecord()  # the drive as it was read last
        self.before: T | None = None  # the snapshot that was read before the one of now
        self.reads = 0  # of new snapshots
        self._taken_ms = 0  # when the snapshot was taken over
        self._run_when_ready = False
        self._axes = SummedAxes()
        self.buttons = 0  # bit mask of what is held beside the axes
        self._hand: GripDrag | None = None  # on the grip, set on the scene's thread

    @property
    def client(self) -> Client:
        return self.workspace.client

    @property
    def busy(self) -> bool:
        """Whether the robot comes, moves or has failed."""
        return self.now.shown_state not in ("absent", "ready", "paused")

    @property
    def fixed(self) -> FixedDrive | None:
        """What a trial of a study that goes on fixes of the drive of what is open."""
        fixed, key = self.workspace.fixed, self.key
        return fixed if fixed is not None and key is not None and fixed.document_id == key.document_id else None

    # -- what a subclass says

    def prepare(self, tell: Tell) -> P:
        """What is open, ready to be driven. Called on another thread. Raises VfixError with the reason.

        tell: shows how far it is; raises ControlError once nobody waits for it.
        """
        raise NotImplementedError

    def made_of(self) -> object:
        """What :meth:`prepare` depends on: another key, another drive."""
        return self.key

    # -- which drive

    def go_to(self, key: DriveKey | None) -> None:
        """Go to the drive of what is open now; None: to none."""
        self.leave_drive()
        self.key = key
        if key is not None:
            self.drive = self._drives.enter(key, self.client)

    def leave_drive(self) -> None:
        """Let go of the drive, which is ended where nobody else is in it."""
        self._axes.clear()
        self.buttons = 0
        self.abandon()
        self.key = self.drive = self.before = None
        self.now = DriveRecord()
        self._run_when_ready = False

    def close(self) -> None:
        self.leave_drive()

    def read(self, take_words: bool = False) -> DriveRecord[P, T]:
        """Read the drive; take_words: with what the process has said to the holder, which is said once."""
        before, drive = self.now.snapshot, self.drive
        self.now = now = DriveRecord() if drive is None else drive.read(self.client, take_words)
        if now.snapshot is not before:
            self._taken_ms, self.before, self.reads = int(1000 * time.time()), before, self.reads + 1
            if before is None and self.active:
                self.workspace.camera.look_from(self.first_view)  # the robot has come
        return now

    def give_up(self) -> None:
        """The robot pauses where it is and the handle is free."""
        self._run_when_ready = False
        if self.drive is not None:
            try:
                self.drive.pause(self.client)
            finally:  # a process that has just ended cannot be paused; the handle is free all the same
                self.drive.leave(self.client)

    def abandon(self) -> None:
        """The handle is free, and a robot that nobody watches is sent home."""
        if self.drive is not None:
            self.drive.leave(self.client)
            self._drives.leave(self.drive, self.client)

    def come_back(self) -> None:
        """Back to the drive of what is open, which may be another one by now."""
        if self.key is not None and (drive := self._drives.enter(self.key, self.client)) is not self.drive:
            self.drive, self.now = drive, DriveRecord()

    def leave(self) -> None:
        if self.drive is not None:
            self.drive.release(self.client)
            self.drive.pause(self.client)

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        """Raises ControlError where this client may not."""
        drive = self.need_drive()
        if isinstance(command, c.DriveCommand):
            self._drive(drive, command.type)
        elif isinstance(command, c.Comment):
            drive.comment(command.text)
        elif isinstance(command, c.SetDriveSettings):
            if self.fixed is not None:
                raise ControlError(FIXED)
            self.need_instructor()
            if self.now.prepared is None:  # they would be lost
                raise ControlError(NOT_PLACED)
            drive.change_settings(self.client, command.values)

    def need_drive(self) -> SharedDrive[P, T]:
        """The drive of what is open. Raises ControlError where nothing is."""
        if self.drive is None:
            raise ControlError("open a case that can be driven first.")
        return self.drive

    def need_instructor(self) -> None:
        """Raise ControlError unless this client may change mode and settings."""
        if not self.read().may_instruct:
            raise ControlError(NOT_HELD)

    def _drive(self, drive: SharedDrive[P, T], name: str) -> None:
        """Start, pause, reset, or end a process that hangs."""
        if name == "rehearsal.pause":
            self._run_when_ready = False
            drive.halt()
        elif name == "rehearsal.end":
            self.take(drive)
            drive.close()
        elif name == "rehearsal.start":
            self.take(drive)
            self.start(drive)
        elif not drive.lease.held_by(self.client):
            raise ControlError(NOT_HELD)
        else:
            self.reset(drive)

    def take(self, drive: SharedDrive[P, T]) -> None:
        """Take the handle. Raises ControlError where another client holds it."""
        if not drive.lease.take(self.client):
            raise ControlError(NOT_HELD)

    def start(self, drive: SharedDrive[P, T]) -> None:
        """A robot that stands goes on; one that is not there comes, and runs then."""
        now = self.read()
        if now.state == "ready":
            drive.run(self.client)
            return
        if not now.is_for(self.made_of()):
            self.open(drive)
        self._run_when_ready = True

    def reset(self, drive: SharedDrive[P, T]) -> None:
        """Back to the start."""
        if self.read().is_for(self.made_of()):
            drive.reset(self.client)
        else:
            self.open(drive)

    def open(self, drive: SharedDrive[P, T], words: str = "Starting …") -> None:
        """Prepare what is open now and start its process."""
        drive.open(self.made_of(), self.prepare, self.workspace.executor, words)

    def run_when_ready(self, drive: SharedDrive[P, T]) -> None:
        """Start was pressed before the robot had come, and it is there now."""
        self._run_when_ready = False
        drive.run(self.client)

    # -- the hand: each is a write into the control process's shared memory; called on other threads

    def handle_now(self, command: ClientMessage) -> None:
        """Raises ControlError where this client does not hold the handle; letting go is never refused."""
        drive = self.need_drive()
        lets_go = isinstance(command, c.HoldCommand) and command.type in ("grip.release", "rehearsal.let_go")
        takes = isinstance(command, c.HoldCommand) and command.type == "rehearsal.take"
        if not (lets_go or takes or drive.lease.held_by(self.client)):
            raise ControlError(NOT_HELD)
        if isinstance(command, c.Push):
            (drive.drive if command.type == "drive" else drive.twist)(self.client, command.direction)
        elif isinstance(command, c.MoveAxes):
            self.push_axes(drive, "device", (command.camera_x, command.camera_y, command.insert))
        elif isinstance(command, c.MoveMaster):
            drive.master(self.client, command.position, command.clutch)
        elif isinstance(command, c.DeflectRate):
            drive.rate(self.client, command.axes)
        elif isinstance(command, c.HoldCommand):
            match command.type:
                case "heartbeat":
                    drive.heartbeat(self.client)
                case "grip.release":
                    drive.release_grip(self.client)
                case "rehearsal.take":
                    self.take(drive)
                case "rehearsal.let_go":
                    drive.leave(self.client)

    def push_axes(self, drive: SharedDrive[P, T], source: str, axes: Axes) -> None:
        """Camera to the right and down, and insertion, by one source: added to those of the others."""
        drive.axes(self.client, *self._axes.push(source, axes), self.buttons)

    def gripped(self, drag: GripDrag) -> None:
        self._hand = None if drag.phase == "end" else drag
        drive = self.drive
        if drive is None:
            return
        if drag.phase == "end":
            drive.release_grip(self.client)
        else:
            drive.set_grip(self.client, drag.position, takes_hold=drag.phase == "start", turns=drag.turns)

    def release_now(self) -> None:
        self._axes.clear()
        if self.drive is not None:
            self.drive.release(self.client)

    # -- each tick

    @property
    def lively(self) -> bool:
        """A robot is there or comes."""
        return self.drive is not None and self.drive.state != "absent"

    def tick(self) -> bool:
        """Read the newest snapshot, and tell the user what the control process has said."""
        for words in self.hear():
            self.workspace.note(words, error=True)
        if self._run_when_ready and self.drive is not None:
            if self.now.state == "ready":
                self.run_when_ready(self.drive)
            elif self.now.state == "failed":
                self._run_when_ready = False
        return False

    def hear(self) -> list[str]:
        """Hear what the process has said and read the drive; returns words for the user."""
        if self.drive is None:
            return []
        self.drive.check()
        return list(self.read(take_words=True).words_for_holder)

    # -- what the page shows

    def drive_key(self) -> tuple[object, ...]:
        """Changes with whatever :meth:`drive_section` tells, and with the snapshots that were read before."""
        now = self.now
        told = now.state, now.words, now.fraction, now.mine, now.holder, now.unrecorded, now.requested, now.hand_lost
        how = now.control, now.preset, now.comments
        return self.reads, Same(now.snapshot), Same(now.prepared), *told, *how, self.client

    def drive_section(self) -> DriveSection:
        """The drive as every world has it; see :meth:`with_hand` for what a world adds."""
        section = drive_section(self.now)
        if self.now.snapshot is not None and section["state"] in ("ready", "running", "paused"):
            section.update(motion(self.now.snapshot))  # type: ignore[typeddict-item]
        self.finish(section)
        return section

    def finish(self, section: DriveSection) -> None:
        """What depends on this client, and on when the snapshot was read."""
        if "tip" in section:
            section["taken_ms"] = self._taken_ms if section["state"] == "running" else None
        if self.now.hand_lost and "holding" in section:
            section["holding"] = HAND_LOST
        section["can_take"] = self.now.holder is None and self.client.may_hold
