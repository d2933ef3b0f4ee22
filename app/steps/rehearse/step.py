"""Rehearse: the shared drive of the open plan, whether this client holds its handle, and what it shows of it."""

from __future__ import annotations

import logging
import time
from typing import Any

from app.messages.client import Client
from app.messages.fields import Command
from app.scene.drive import DriveNodes
from app.scene.hand import GripDrag
from app.services import Services
from app.services.errors import PlanLocked
from app.services.plans import Plan
from app.steps.base import Step
from app.steps.rehearse import SPEC
from app.steps.rehearse import commands as c
from app.steps.rehearse.hints import rehearse_hint
from app.steps.rehearse.options import Options, options_section
from app.steps.rehearse.preparation import Prepared, plan_key, prepare
from app.steps.rehearse.sections import OptionsSection, RehearsalSections, RehearsalState
from app.steps.rehearse.shared_drive import SharedDrive
from app.steps.rehearse.shared_drives import SharedDrives
from app.steps.rehearse.view import details_section, rehearsal_section, settings_section, tool_section
from app.views.layers import Layer
from app.views.plan_items import Position, curve_layer, curve_section, entries, items_layer, plan_items
from app.views.views import Views
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.imaging.surface_uncertainty import SurfaceUncertainty
from vfix_engine.robots import PlacedRobot
from vfix_engine.simulation.snapshot import Snapshot

_LOG = logging.getLogger(__name__)
_HAND_LOST = "The window was late, so the hand let go: press again"
_NOT_HELD = "only the window that holds the handle can do that; you can watch, or take over when it lets go."


class RehearseStep(Step):
    """Owned by the session's thread; only :attr:`drive` is read from others."""

    spec = SPEC
    ticks = True
    first_view = "nose"

    @classmethod
    def make_shared(cls, services: Services) -> SharedDrives:
        return SharedDrives()

    def __init__(self, views: Views, shared: SharedDrives) -> None:
        super().__init__(views)
        self._services, self._drives = views.services, shared
        self._plan_id: str | None = None
        self._uncertainty: SurfaceUncertainty | None = None  # of the bone that the margin is kept to
        self._has_ct = False
        self.drive: SharedDrive | None = None
        self.snapshot: Snapshot | None = None
        self._before: Snapshot | None = None  # the one that was read before it
        self._taken_ms = 0  # when the snapshot was taken over
        self._hand: GripDrag | None = None  # on the grip, set on the scene's thread
        self._changed = False  # the plan is another one than what is driven
        self._run_when_ready = False
        self._unkept: dict[str, float] = {}  # settings that the plan could not keep when it was tried last
        self._plan_edited = False  # the plan in the store has changed by what was done here
        views.plan.on_opened(self._plan_opened)

    @property
    def _client(self) -> Client:
        return self.views.client

    def available(self) -> bool:
        return self.views.plan.id is not None

    # -- which drive

    def _plan_opened(self) -> None:
        """Go to the drive of the plan that is open now."""
        self._leave_drive()
        plan = self.views.plan.current
        if plan is not None:
            self._plan_id = plan.id
            case = self._services.cases.get(plan.case_id)
            self._uncertainty, self._has_ct = case.uncertainty, bool(case.volumes)
            self.drive = self._drives.enter(plan.id, self._client)

    def _leave_drive(self) -> None:
        self.abandon()
        self.drive = self.snapshot = self._before = self._plan_id = None
        self._run_when_ready = self._changed = False
        self._unkept = {}

    def close(self) -> None:
        self._leave_drive()

    @property
    def mine(self) -> bool:
        return self.drive is not None and self.drive.lease.held_by(self._client)

    @property
    def state(self) -> RehearsalState:
        """What the page shows: the drive's state, and in it whether the robot runs."""
        if self.drive is None:
            return "absent"
        state = self.drive.state
        if state != "ready" or self.snapshot is None:
            return "starting" if state == "ready" else state
        if self.snapshot.running:
            return "running"
        return "paused" if self.snapshot.steps > 0 else "ready"

    def places(self) -> list[Position]:
        """The grip."""
        if self.snapshot is None:
            return []
        x, y, z = (float(value) for value in self.snapshot.grip)
        return [(x, y, z)]

    def driven(self) -> Prepared | None:
        """What is driven and shown, where that is not the plan as it is now."""
        return self.drive.prepared if self.drive is not None and self._changed and self.active else None

    def _compare(self) -> None:
        """Look whether the robot was placed for the plan as it is now."""
        plan = self.views.plan.current
        if (drive := self.drive) is None or drive.prepared is None:
            self._changed = False
        else:
            self._changed = plan is None or not drive.is_for(plan_key(plan))

    def give_up(self) -> None:
        """The robot pauses where it is and the handle is free."""
        self._run_when_ready = False
        if self.drive is None:
            return
        drive, accepted = self.drive, self.drive.accepted(self._client)
        try:
            drive.pause(self._client)
        finally:  # a process that has just ended cannot be paused; the handle is free all the same
            drive.leave(self._client)
            for words in self._keep_settings(drive, accepted):  # last: it waits for the disk
                _LOG.warning("%s", words)  # nobody is there to read it

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
            self.drive, self.snapshot = drive, None

    # -- entering and leaving the step

    def enter(self) -> None:
        """Open the anatomy along the path, look at it, and put the robot at its entry where nobody else has it."""
        plan = self.views.plan.current
        self.views.case.open_up([] if plan is None else [item.position for item in plan_items(plan)])
        self.views.camera.look_from("nose")
        drive = self.drive
        if drive is None or plan is None or len(plan.points) < 2 or drive.is_for(plan_key(plan)):
            return
        if drive.lease.take(self._client):
            self._open(drive, plan)

    def leave(self) -> None:
        if self.drive is not None:
            self.drive.release(self._client)
            self.drive.pause(self._client)

    # -- commands

    def handle(self, command: Command) -> None:
        """Raises PlanError where this client may not."""
        if isinstance(command, c.DriveCommand):
            self._drive(command.type)
        elif isinstance(command, c.SetOptions):
            self._switch(command)
        elif self.drive is not None:
            if not self.drive.may_instruct(self._client):
                raise PlanError(_NOT_HELD)
            if isinstance(command, c.SetMode):
                self.drive.set_mode(self._client, command.mode, command.target_id)
            elif isinstance(command, c.SetRehearsalSettings):
                self.drive.change_settings(self._client, command.values)

    def _switch(self, command: c.SetOptions) -> None:
        if self.drive is None:
            raise PlanError("open a plan first.")
        if not self.drive.may_switch(self._client):
            raise PlanError(_NOT_HELD)
        self.drive.options = Options(command.soft_tissue, command.remote_centre, command.speed_limit)

    def _drive(self, name: str) -> None:
        """Start, pause, reset, or end a process that hangs."""
        drive, plan = self.drive, self.views.plan.current
        if drive is None or plan is None:
            raise PlanError("open a plan first.")
        if name == "rehearsal.start":
            self._start(drive, plan)
        elif name == "rehearsal.end":
            self._take(drive)
            drive.close()
        elif name == "rehearsal.pause":
            self._run_when_ready = False
            drive.halt()
        elif not drive.lease.held_by(self._client):
            raise PlanError(_NOT_HELD)
        else:
            self._reset(drive, plan)

    def _take(self, drive: SharedDrive) -> None:
        if not drive.lease.take(self._client):
            raise PlanError(_NOT_HELD)

    def _start(self, drive: SharedDrive, plan: Plan) -> None:
        """A robot that stands goes on along what it was placed for; one that is not there comes and runs then."""
        self._take(drive)
        at_entry = self.snapshot is None or self.snapshot.steps == 0
        if drive.state == "ready" and at_entry and drive.options_in_force != drive.options:
            self._open(drive, plan)
        elif drive.state == "ready":
            drive.run(self._client)
            return
        elif not drive.is_for(plan_key(plan)):
            self._open(drive, plan)
        self._run_when_ready = True

    def _reset(self, drive: SharedDrive, plan: Plan) -> None:
        if drive.is_for(plan_key(plan)) and drive.options_in_force == drive.options:
            drive.reset(self._client)
        else:
            self._open(drive, plan)

    def _open(self, drive: SharedDrive, plan: Plan) -> None:
        if len(plan.points) < 2:
            raise PlanError("a rehearsal needs a path of two points at least.")
        options = drive.options
        drive.open(plan_key(plan), lambda: prepare(self._services, plan, options), self.views.executor)

    # -- the hand: each is a write into the control process's shared memory; called on other threads

    def handle_now(self, command: Command) -> None:
        drive = self.drive
        if drive is None:
            return
        if isinstance(command, c.Push):
            (drive.drive if command.type == "drive" else drive.twist)(self._client, command.direction)
        elif isinstance(command, c.HandCommand):
            match command.type:
                case "heartbeat":
                    drive.heartbeat(self._client)
                case "grip.release":
                    drive.release_grip(self._client)
                case "rehearsal.take":
                    drive.lease.take(self._client)
                case "rehearsal.let_go":
                    drive.leave(self._client)

    def gripped(self, drag: GripDrag) -> None:
        self._hand = None if drag.phase == "end" else drag
        drive = self.drive
        if drive is None:
            return
        if drag.phase == "end":
            drive.release_grip(self._client)
        else:
            drive.set_grip(self.views.client, drag.position, takes_hold=drag.phase == "start")

    def release_now(self) -> None:
        if self.drive is not None:
            self.drive.release(self._client)

    # -- each tick

    @property
    def lively(self) -> bool:
        """A robot is there or comes."""
        return self.drive is not None and self.drive.state != "absent"

    def tick(self) -> bool:
        """Read the newest snapshot, and tell the user what the control process has said."""
        for words in self._read():
            self.views.note(words, error=True)
        edited, self._plan_edited = self._plan_edited, False
        self.views.stale |= edited
        drawn = self.driven()
        self._compare()
        return edited or self.driven() is not drawn

    def _read(self) -> list[str]:
        drive = self.drive
        if drive is None:
            return []
        drive.check()
        words, accepted = drive.take_words(self._client), drive.accepted(self._client)
        if accepted != self._unkept:
            words += self._keep_settings(drive, accepted)
        before, self.snapshot = self.snapshot, drive.snapshot()
        if self.snapshot is not before:
            self._taken_ms = int(1000 * time.time())
        self._before = before if before is not self.snapshot else self._before
        if before is None and self.snapshot is not None and self.active:
            self.views.camera.look_from("nose")  # the robot has come
        if self._run_when_ready and drive.state == "ready":
            self._run_when_ready = False
            drive.run(self._client)
        elif drive.state == "failed":
            self._run_when_ready = False
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
            drive.plan_changed(plan_key(before), plan_key(after))
            self._plan_edited = True
        drive.kept(accepted)
        return words

    # -- what the page and the scene show

    def hint(self) -> str:
        plan = self.views.plan.current
        points, targets = (0, 0) if plan is None else (len(plan.points), len(plan.targets))
        mode, done = ("path", False) if self.snapshot is None else (self.snapshot.mode, self.snapshot.phase == "done")
        free = self.drive is not None and self.drive.lease.holder is None
        return rehearse_hint(points, self.state, self.mine, free, mode, done, targets, self._changed)

    def sections(self, fresh: bool) -> RehearsalSections:
        self._compare()
        drive, driven = self.drive, self.driven()
        holder = drive is not None and drive.lease.holder is not None
        words = "" if drive is None else drive.words
        section = rehearsal_section(self.snapshot, self.state, words, self.mine, holder, self._before)
        if "tip" in section:
            section["taken_ms"] = self._taken_ms if self.state == "running" else None
        section["can_take"] = not holder and self._client.may_hold
        section["plan_changed"] = self._changed
        if drive is not None and drive.hand_lost(self._client) and "holding" in section:
            section["holding"] = _HAND_LOST
        section["target_id"] = drive.target_id if drive is not None and section.get("mode") == "inspect" else None
        settings, answered, refusal = ControlSettings(), 0, ""
        if drive is not None:
            settings, answered, refusal = drive.settings, drive.settings_answered, drive.settings_refusal
        warning = "" if self._uncertainty is None else self._uncertainty.warning(settings.margin_mm)
        sections: RehearsalSections = {
            "rehearsal": section,
            "driven": None if driven is None else entries(driven.items),
            "details": details_section(self.snapshot),
            "settings": settings_section(settings, answered, refusal, warning),
            "options": self._options(),
            "tool": tool_section(self.snapshot),
        }
        if driven is not None:
            sections["curve"] = curve_section(driven.curve)
        return sections

    def _options(self) -> OptionsSection:
        drive, plan = self.drive, self.views.plan.current
        wanted, in_force, may = Options(), None, False
        if drive is not None:
            wanted, in_force, may = drive.options, drive.options_in_force, drive.may_switch(self._client)
        points = 0 if plan is None else len(plan.points)
        return options_section(wanted, in_force, points, self._has_ct, may)

    def layers(self) -> list[Layer[Any]]:
        """The robot while the step is active; points and curve of what is driven instead of the plan's."""
        if not self.active:
            return []
        layers: list[Layer[Any]] = []
        driven = self.driven()
        if driven is not None:
            layers += [
                items_layer(driven.items, None, locked=True),
                curve_layer(id(driven), lambda: (driven.curve, None)),
            ]
        robot = None if self.drive is None else self.drive.robot
        if self.snapshot is not None and robot is not None:
            layers.append(self._robot_layer(self.snapshot, robot))
        return layers

    def _robot_layer(self, now: Snapshot, robot: PlacedRobot) -> Layer[DriveNodes]:
        mine, hand = self.mine, self._hand
        key = (now.t, now.steps, now.mode, now.running, mine, tuple(now.force), hand)

        def show(nodes: DriveNodes) -> None:
            tool = (now.segments_start, now.segments_end, now.radius)
            nodes.show(robot.link_placements(now.q), tool, now.grip, now.force, mine)
            nodes.hand.show_sight(now.tip, now.virtual_point if now.mode == "inspect" else None)
            nodes.hand.show_blocked(now.blocking_point if now.held or now.slowed else None)

        return Layer("rehearse.drive", key, lambda view: DriveNodes(view, robot.robot.visuals), show, id(robot))
