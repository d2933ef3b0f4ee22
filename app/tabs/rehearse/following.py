"""Which drive a client is at: the shared one of its open plan, with what was read of it last."""

from __future__ import annotations

import logging
import time

from app.kit.errors import PlanLocked
from app.kit.kept import Kept
from app.kit.values import Position
from app.messages.client import Client
from app.planning.rehearsal_options import NO_SWITCHES, Switches
from app.plans.service import Plan
from app.services import Services
from app.tabs.base import Tab
from app.tabs.rehearse.drive_record import NO_DRIVE, DriveRecord
from app.tabs.rehearse.driven import SoFar
from app.tabs.rehearse.preparation import PlanKey, Prepared, plan_key
from app.tabs.rehearse.shared_drive import SharedDrive
from app.tabs.rehearse.shared_drives import SharedDrives
from app.workspace.workspace import Workspace
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

_LOG = logging.getLogger(__name__)


class DriveFollower(Tab):
    """A step that is at the drive of the open plan. Owned by the session's thread; others read :attr:`drive` alone."""

    @classmethod
    def make_shared(cls, services: Services) -> SharedDrives:
        return SharedDrives()

    def __init__(self, workspace: Workspace, shared: SharedDrives) -> None:
        super().__init__(workspace, shared)
        self._services, self._drives = workspace.services, shared
        self._registered: Kept[str] = Kept()  # key of the plan's registration
        self.reads = 0  # of new snapshots: changes with whatever is told of one beside those before it
        self._plan_id: str | None = None
        self._uncertainty: SurfaceUncertainty | None = None  # of the bone that the margin is kept to
        self._has_ct = False
        self.drive: SharedDrive | None = None
        self.now = NO_DRIVE  # the drive as it was read last
        self._before: RigidSnapshot | None = None  # the one that was read before it
        self.so_far = SoFar()
        self._taken_ms = 0  # when the snapshot was taken over
        self._changed = False  # the plan is another one than what is driven
        self._run_when_ready = False
        self._stopped_for = ""  # why the robot was paused at the last tick
        self._unkept: dict[str, float] = {}  # settings that the plan could not keep when it was tried last
        self._plan_edited = False  # the plan in the store has changed by what was done here
        workspace.plan.on_opened(self._plan_opened)

    @property
    def _client(self) -> Client:
        return self.workspace.client

    @property
    def wanted(self) -> Switches:
        """The switches of the next start or reset."""
        return NO_SWITCHES if self._plan_id is None else self._services.switches.of(self._plan_id)

    # -- which drive

    def _plan_opened(self) -> None:
        """Go to the drive of the plan that is open now."""
        self._leave_drive()
        plan = self.workspace.plan.current
        if plan is not None:
            self._plan_id = plan.id
            case = self._services.cases.get(plan.case_id)
            self._uncertainty, self._has_ct = case.uncertainty, bool(case.volumes)
            self.drive = self._drives.enter(plan.id, self._client)

    def _leave_drive(self) -> None:
        self.abandon()
        self.drive = self._before = self._plan_id = None
        self.now = NO_DRIVE
        self._run_when_ready = self._changed = False
        self._unkept = {}

    def close(self) -> None:
        self._leave_drive()

    def read(self, take_words: bool = False) -> DriveRecord:
        """Read the drive; take_words: with what the process has said to the holder, which is said once."""
        before, drive = self.now.snapshot, self.drive
        self.now = now = NO_DRIVE if drive is None else drive.read(self._client, take_words)
        if now.snapshot is not before:
            self._taken_ms, self._before, self.reads = int(1000 * time.time()), before, self.reads + 1
            if before is None and self.active:
                self.workspace.camera.look_from("nose")  # the robot has come
            if self.active:
                self.so_far.take(now.snapshot, None if now.prepared is None else now.prepared.planned)
        return now

    def places(self) -> list[Position]:
        """The grip."""
        if self.now.snapshot is None:
            return []
        x, y, z = (float(value) for value in self.now.snapshot.grip)
        return [(x, y, z)]

    @property
    def driven(self) -> Prepared | None:
        """What is driven and shown, where that is not the plan as it is now."""
        return self.now.prepared if self._changed and self.active else None

    def _compare(self, now: DriveRecord) -> None:
        """Look whether the robot was placed for the plan as it is now."""
        plan = self.workspace.plan.current
        self._changed = now.prepared is not None and not (plan is not None and now.is_for(self._key(plan)))

    def _withdrawn(self, now: DriveRecord) -> str:
        """Why the robot that stands here is not driven: the plan goes by another registration now, or by none that can
        be used; '' where it goes by the one that the robot was placed by.
        """
        plan, placed = self.workspace.plan.current, now.plan_key
        if plan is None or now.state != "ready" or not isinstance(placed, PlanKey):
            return ""
        if placed.plan_id != plan.id or placed.registered == self._key(plan).registered:
            return ""
        try:
            self._services.planning.registration(plan)
        except PlanError as error:
            return f"{error} The robot is not driven until then."
        return "The plan goes by another registration than the robot was placed by. ‘Reset to entry’ places it anew."

    def _stop_where_withdrawn(self, now: DriveRecord) -> str:
        """The robot pauses where its registration has gone under it; returns words for the user, '' for none."""
        words = self._withdrawn(now) if self._changed and now.snapshot is not None and now.snapshot.running else ""
        if words and not self._stopped_for:  # read anew before somebody's robot is stopped
            self._registered = Kept()
            words = self._withdrawn(now)
        if words and self.drive is not None:
            self.drive.halt()
        said, self._stopped_for = self._stopped_for, words
        return "" if words == said else words

    def _key(self, plan: Plan) -> PlanKey:
        """What a rehearsal of the plan depends on; its registration is read anew once something was stored."""
        stored = self._services.store.changes.of(self._services.registrations.kind.name)
        of = (plan.id, plan.registration, stored)
        return plan_key(plan, self._registered.get(of, lambda: self._services.planning.registration_key(plan)))

    def give_up(self) -> None:
        """The robot pauses where it is and the handle is free."""
        self._run_when_ready = False
        if self.drive is None:
            return
        drive, accepted = self.drive, self.drive.read(self._client).accepted
        try:
            drive.pause(self._client)
        finally:  # a process that has just ended cannot be paused; the handle is free all the same
            drive.leave(self._client)
            if self._keep_settings(drive, accepted):  # last: it waits for the disk
                _LOG.warning("a window that is gone had changed settings that its plan did not keep")

    def abandon(self) -> None:
        """The handle is free, and a robot that nobody watches is sent home."""
        if self.drive is not None:
            self.drive.leave(self._client)
            self._drives.leave(self.drive, self._client)

    def come_back(self) -> None:
        """Back to the drive of the plan, which may be another one by now."""
        if self._plan_id is None:
            return
        self._unkept = {}
        drive = self._drives.enter(self._plan_id, self._client)
        if drive is not self.drive:
            self.drive, self.now = drive, NO_DRIVE

    def _hear(self) -> list[str]:
        """Hear what the process has said and read the drive; returns words for the user."""
        drive = self.drive
        if drive is None:
            return []
        drive.check()
        now = self.read(take_words=True)
        words = list(now.words_for_holder)
        if now.accepted != self._unkept:
            words += self._keep_settings(drive, now.accepted)
            self.read()  # it may be the rehearsal of the plan that was stored just now
        return words

    def _keep_settings(self, drive: SharedDrive, accepted: dict[str, float]) -> list[str]:
        """The plan keeps the settings that came into force, unless it is locked; returns words where it does not.

        Where the store refuses, it is tried again with the next change, or by the next window that has the handle.
        """
        self._unkept, words = {}, list[str]()
        if not accepted or self._plan_id is None:
            return words
        try:
            before = self._services.plans.get(self._plan_id)
            after = self._services.plans.editor(self._plan_id).set_settings(accepted)
        except PlanLocked:
            words.append("The plan is locked: the changed settings hold for this rehearsal only.")
        except VfixError as error:
            self._unkept = accepted
            return [f"The changed settings hold for this rehearsal only, the plan could not keep them: {error}"]
        else:
            drive.plan_changed(self._key(before), self._key(after))
            self._plan_edited = True
        drive.kept(accepted)
        return words
