"""The rehearsal of the open plan: its shared drive, settings stored in the plan, and reasons that withdraw it."""

from __future__ import annotations

import logging

from app.drives.drive_process import Tell
from app.drives.drive_record import HAND, DriveRecord
from app.drives.shared_drive import SharedDrive
from app.drives.shared_drives import DriveKey, SharedDrives
from app.kit.errors import PlanLocked
from app.kit.kept import Kept, Same
from app.kit.values import Position
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.plans.operations.document import SetPlanSettings
from app.plans.service import Plan
from app.tabs.drive_tab import DriveTab
from app.tabs.rehearse.drive_figures import DriveFigures
from app.tabs.rehearse.preparation import PlanKey, PreparedRehearsal, plan_key, prepare
from app.tabs.rehearse.tool_snapshot import ToolSnapshot
from app.workspace.workspace import Workspace
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.runtime.control_mode import FREEHAND

ENDED = "The drive ended"

_LOG = logging.getLogger(__name__)

RehearsalRecord = DriveRecord[PreparedRehearsal, ToolSnapshot]
RehearsalDrive = SharedDrive[PreparedRehearsal, ToolSnapshot]
RehearsalDrives = SharedDrives[PreparedRehearsal, ToolSnapshot]


class RehearsalSession(DriveTab[PreparedRehearsal, ToolSnapshot]):
    """A tab that drives the open plan. Owned by the session's thread; others read :attr:`drive` alone."""

    def __init__(self, workspace: Workspace, shared: RehearsalDrives) -> None:
        super().__init__(workspace, shared)
        self._services = workspace.services
        self._registered: Kept[str] = Kept()  # key of the plan's registration
        self._keys: Kept[PlanKey] = Kept()
        self._uncertainty: SurfaceUncertainty | None = None  # of the bone that the margin is kept to
        self._has_ct = False
        self.so_far = DriveFigures()
        self._changed = False  # the plan differs from what is driven
        self._stopped_for = ""  # why the robot was paused at the last tick
        self._unkept: dict[str, float] = {}  # settings that could not be stored in the plan at the last attempt
        self._plan_edited = False  # the plan in the store was changed by this client
        workspace.plan.on_opened(self._plan_opened)

    @property
    def _plan_id(self) -> str | None:
        return None if self.key is None else self.key.document_id

    @property
    def wanted(self) -> RehearsalOptions:
        """The options of the next start or reset."""
        return NO_OPTIONS if self._plan_id is None else self._services.rehearsal_options.of(self._plan_id)

    @property
    def in_force(self) -> RehearsalOptions:
        """The options that the next start has; nothing holds a tool in a free hand."""
        return NO_OPTIONS if self.now.control.mode == FREEHAND else self.wanted.in_force

    # -- which drive

    def _plan_opened(self) -> None:
        """Go to the drive of the plan that is open now."""
        plan, drive = self.workspace.plan.current, self.drive
        now = self.now if drive is None else drive.read(self.client)
        self.go_to(None if plan is None else DriveKey(plan.case_id, plan.id))
        if drive is not None and not self._drives.has(drive) and now.snapshot is not None and now.snapshot.steps:
            self.workspace.note(f"{ENDED}." if now.unrecorded else f"{ENDED}; its run is in Review.")
        if plan is not None:
            case = self._services.cases.get(plan.case_id)
            self._uncertainty, self._has_ct = case.uncertainty, bool(case.volumes)

    def leave_drive(self) -> None:
        super().leave_drive()
        self._changed = False
        self._unkept = {}

    def made_of(self) -> PlanKey | None:
        plan = self.workspace.plan.current
        return None if plan is None else self._key(plan)

    def open(self, drive: RehearsalDrive, words: str = "Placing the robot at the entry …") -> None:
        """Place the robot for the present plan and options."""
        plan, options, control, preset = self.need_plan(), self.in_force, drive.control, drive.preset
        if len(plan.content.points) < 2:
            raise PlanError("a rehearsal needs a path of two points at least.")

        def prepared(tell: Tell) -> PreparedRehearsal:  # takes a moment: nothing to tell
            return prepare(self._services, plan, options, control, preset)

        drive.open(self._key(plan), prepared, self.workspace.executor, words)

    def need_plan(self) -> Plan:
        """The open plan. Raises PlanError where there is none."""
        plan = self.workspace.plan.current
        if plan is None:
            raise PlanError("open a plan first.")
        return plan

    def read(self, take_words: bool = False) -> RehearsalRecord:
        """Read the drive; take_words: with the process's messages to the holder, which are returned once."""
        shown = self.now.snapshot
        now = super().read(take_words)
        if now.snapshot is not shown and self.active:
            self.so_far.take(now.snapshot, None if now.prepared is None else now.prepared.planned)
        return now

    def places(self) -> list[Position]:
        """The grip."""
        if self.now.snapshot is None:
            return []
        x, y, z = (float(value) for value in self.now.snapshot.grip)
        return [(x, y, z)]

    @property
    def driven(self) -> PreparedRehearsal | None:
        """The driven and displayed plan, where that is not the present one."""
        return self.now.prepared if self._changed and self.active else None

    def _compare(self, now: RehearsalRecord) -> None:
        """Check whether the robot was placed for the present plan."""
        plan = self.workspace.plan.current
        self._changed = now.prepared is not None and not (plan is not None and now.is_for(self._key(plan)))

    def _withdrawn(self, now: RehearsalRecord) -> str:
        """Why the robot is not driven: the plan uses another registration now, or one that cannot
        be used; '' where it uses the one by which the robot was placed.
        """
        plan, placed = self.workspace.plan.current, now.made_of
        if plan is None or now.state != "ready" or not isinstance(placed, PlanKey):
            return ""
        if placed.plan_id != plan.id or placed.registered == self._key(plan).registered:
            return ""
        try:
            self._services.planning.registration(plan)
        except PlanError as error:
            return f"{error} The robot is not driven until then."
        return "The plan goes by another registration than the robot was placed by. ‘Reset to entry’ places it anew."

    def _stop_where_withdrawn(self, now: RehearsalRecord) -> str:
        """Pause the robot if its registration is withdrawn; returns words for the user, '' for none."""
        words = self._withdrawn(now) if self._changed and now.snapshot is not None and now.snapshot.running else ""
        if words and not self._stopped_for:  # read again before a robot is stopped
            self._registered = Kept()
            words = self._withdrawn(now)
        if words and self.drive is not None:
            self.drive.halt()
        said, self._stopped_for = self._stopped_for, words
        return "" if words == said else words

    def _key(self, plan: Plan) -> PlanKey:
        """The inputs of a rehearsal of the plan; its registration is read again once something was stored."""
        stored = self._services.store.changes.of(self._services.registrations.kind.name)
        of = (plan.id, plan.content.registration, stored)
        registered = self._registered.get(of, lambda: self._services.planning.registration_key(plan))
        how = (HAND, None) if self.drive is None else (self.drive.control, self.drive.preset)
        return self._keys.get((Same(plan), registered, *how), lambda: plan_key(plan, registered, *how))

    def give_up(self) -> None:
        """Pause the robot, release the handle, and store the settings that took effect in the plan."""
        drive, accepted = self.drive, {} if self.drive is None else self.drive.read(self.client).accepted
        try:
            super().give_up()
        finally:
            if drive is not None and self._keep_settings(drive, accepted):  # last: it waits for the disk
                _LOG.warning("a window that is gone had changed settings that its plan did not keep")

    def come_back(self) -> None:
        self._unkept = {}
        super().come_back()

    def hear(self) -> list[str]:
        """Read the process's events, and store changed settings in the plan; returns words for the user."""
        words = super().hear()
        if self.drive is not None and self.now.accepted != self._unkept:
            words += self._keep_settings(self.drive, self.now.accepted)
            self.read()  # it may be the rehearsal of the plan just stored
        return words

    def _keep_settings(self, drive: RehearsalDrive, accepted: dict[str, float]) -> list[str]:
        """Store the settings that took effect in the plan, unless it is locked; returns words if that fails.

        If the store refuses, it is tried again with the next change, or by the next client that has the handle.
        """
        self._unkept, words = {}, list[str]()
        if not accepted or self._plan_id is None:
            return words
        try:
            before = self._services.plans.get(self._plan_id)
            after = self._services.plans.do(self._plan_id, SetPlanSettings(settings=accepted))
        except PlanLocked:
            words.append("The plan is locked: the changed settings hold for this rehearsal only.")
        except VfixError as error:
            self._unkept = accepted
            return [f"The settings hold for this rehearsal only. The plan could not keep them: {error}"]
        else:
            drive.made_of_changed(self._key(before), self._key(after))
            self._plan_edited = True
        drive.kept(accepted)
        return words
