"""Rehearse: the shared drive of the open plan, whether this client holds its handle, and what it shows of it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from app.kit.kept import Kept, Same
from app.messages.fields import Command
from app.messages.sections import Section, Sections
from app.planning.rehearsal_options import NO_SWITCHES, Switches
from app.plans.service import Plan
from app.scene.centre import CentreNodes
from app.scene.drive import DriveNodes
from app.scene.hand import GripDrag
from app.tabs.rehearse import SPEC
from app.tabs.rehearse import commands as c
from app.tabs.rehearse.drive_record import DriveRecord
from app.tabs.rehearse.following import DriveFollower
from app.tabs.rehearse.hints import rehearse_hint
from app.tabs.rehearse.preparation import prepare
from app.tabs.rehearse.sections import OptionsSection, RehearsalSection
from app.tabs.rehearse.shared_drive import SharedDrive
from app.tabs.rehearse.shared_drives import SharedDrives
from app.tabs.rehearse.switches import CentrePlaces, options_section, place_of
from app.tabs.rehearse.view import details_section, rehearsal_section, settings_section, tool_section
from app.workspace.layers import Layer
from app.workspace.plan_items import curve_layer, curve_section, entries, items_layer, plan_items
from app.workspace.workspace import Workspace
from vfix_engine.errors import PlanError
from vfix_engine.robots import PlacedRobot
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

_HAND_LOST = "The window was late, so the hand let go: press or drag again"
_NOT_HELD = "only the window that holds the handle can do that; you can watch, or take over when it lets go."


class RehearseTab(DriveFollower):
    """Owned by the session's thread; only :attr:`drive` is read from others."""

    spec = SPEC
    ticks = True
    first_view = "nose"

    def __init__(self, workspace: Workspace, shared: SharedDrives) -> None:
        super().__init__(workspace, shared)
        self._hand: GripDrag | None = None  # on the grip, set on the scene's thread
        self._centre = CentrePlaces(workspace.services, workspace.executor, workspace.post)
        self._told_of: RigidSnapshot | None = None  # the pose that others were told last
        self._told = NO_SWITCHES  # the switches as they were when everything was published last

    def available(self) -> bool:
        return self.workspace.plan.id is not None

    # -- entering and leaving the step

    def enter(self) -> None:
        """Open the anatomy along the path, look at it, and put the robot at its entry where nobody else has it."""
        plan = self.workspace.plan.current
        self.workspace.case.open_up([] if plan is None else [item.position for item in plan_items(plan)])
        self.workspace.camera.look_from("nose")
        drive = self.drive
        if drive is None or plan is None or len(plan.points) < 2 or drive.is_for(self._key(plan)):
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
            if not self.read().may_instruct:
                raise PlanError(_NOT_HELD)
            if isinstance(command, c.SetMode):
                self.drive.set_mode(self._client, command.mode, command.target_id)
            elif isinstance(command, c.SetRehearsalSettings):
                self.drive.change_settings(self._client, command.values)

    def _switch(self, command: c.SetOptions) -> None:
        if self.drive is None or self._plan_id is None:
            raise PlanError("open a plan first.")
        if not self.read().may_switch:
            raise PlanError(_NOT_HELD)
        place = place_of(command.centre_point, command.centre_mm)
        wanted = Switches(command.soft_tissue, command.remote_centre, command.speed_limit, place)
        self._services.switches.turn(self._plan_id, wanted)

    def _drive(self, name: str) -> None:
        """Start, pause, reset, or end a process that hangs."""
        drive, plan = self.drive, self.workspace.plan.current
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
        """A robot that stands goes on along what it was placed for; one that is not there comes and runs then.

        Never by a registration that is not the plan's any more: at the entry it is placed anew, else it stays there.
        """
        self._take(drive)
        self._registered = Kept()  # read now, not when something was stored last
        now = self.read()
        at_entry = now.snapshot is None or now.snapshot.steps == 0
        withdrawn = self._withdrawn(now)
        if now.state == "ready" and at_entry and (withdrawn or now.switches != self.wanted.in_force):
            self._services.planning.registration(plan)
            self._open(drive, plan)
        elif withdrawn:
            raise PlanError(withdrawn)
        elif now.state == "ready":
            drive.run(self._client)
            return
        elif not now.is_for(self._key(plan)):
            self._open(drive, plan)
        self._run_when_ready = True

    def _reset(self, drive: SharedDrive, plan: Plan) -> None:
        now = self.read()
        if now.is_for(self._key(plan)) and now.switches == self.wanted.in_force:
            drive.reset(self._client)
        else:
            self._open(drive, plan)

    def _open(self, drive: SharedDrive, plan: Plan) -> None:
        if len(plan.points) < 2:
            raise PlanError("a rehearsal needs a path of two points at least.")
        switches = self.wanted.in_force
        drive.open(self._key(plan), lambda: prepare(self._services, plan, switches), self.workspace.executor)

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
            drive.set_grip(self.workspace.client, drag.position, takes_hold=drag.phase == "start")

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
        for words in self._hear():
            self.workspace.note(words, error=True)
        edited, self._plan_edited = self._plan_edited, False
        if self._run_when_ready:
            self._run_if_ready(self.now)
        if self._services.live.wanted:
            self._tell_tool(self.now)
        drawn, told, self._told = self.driven, self._told, self.wanted
        self._compare(self.now)
        if words := self._stop_where_withdrawn(self.now):
            self.workspace.note(words, error=True)
        return edited or self.driven is not drawn or told != self._told

    def _tell_tool(self, now: DriveRecord) -> None:
        """Say where the tool is, for those who are connected to the planner; the client that drives says it."""
        if now.mine and now.snapshot is not None and now.robot is not None and now.snapshot is not self._told_of:
            self._told_of = now.snapshot
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = now.robot.tip_pose(now.snapshot.q)
            self._services.live.show_tool(pose)

    def _run_if_ready(self, now: DriveRecord) -> None:
        """Start was pressed before the robot had come; one that came with other switches comes again."""
        drive, plan = self.drive, self.workspace.plan.current
        if drive is None:
            return
        if now.state == "ready" and plan is not None and now.switches != self.wanted.in_force:
            self._open(drive, plan)
        elif now.state == "ready":
            self._run_when_ready = False
            self._registered = Kept()  # it may have changed while the robot came
            if words := self._withdrawn(now):
                self.workspace.note(words, error=True)
            else:
                drive.run(self._client)
        elif now.state == "failed":
            self._run_when_ready = False

    # -- what the page and the scene show

    def hint(self) -> str:
        plan, now = self.workspace.plan.current, self.now
        points, targets = (0, 0) if plan is None else (len(plan.points), len(plan.targets))
        mode, phase = ("path", "") if now.snapshot is None else (now.snapshot.mode, now.snapshot.phase)
        free = self.drive is not None and now.holder is None
        ends = ""
        # Another margin than that of the dry run has another verdict, which the panel tells.
        if now.prepared is not None and now.prepared.planned is not None and not self._other_margin(now):
            ends = now.prepared.planned.ends_words
        blocked = self._withdrawn(now) if self._changed else ""
        state, changed = now.shown_state, self._changed
        return rehearse_hint(points, state, now.mine, free, mode, phase, targets, changed, ends, blocked)

    def _other_margin(self, now: DriveRecord) -> bool:
        """Whether the margin was changed since the drive was prepared."""
        return now.prepared is not None and now.settings.margin_mm != now.prepared.settings.margin_mm

    def refresh(self) -> None:
        self._compare(self.read())
        wanted = self.wanted
        if self.active or wanted.remote_centre:
            self._centre.ask(self.workspace.plan.current)

    def sections(self) -> Sections:
        """The :class:`RehearsalSections`."""
        now, driven, snapshot = self.now, self.driven, self.now.snapshot
        settings = now.settings, now.answered, now.refusal, self._uncertainty
        sections: dict[str, Section[object]] = {
            "rehearsal": self._rehearsal(now),
            "driven": Section(Same(driven), lambda: None if driven is None else entries(driven.items)),
            "details": Section(Same(snapshot), lambda: details_section(snapshot)),
            "settings": Section(settings, lambda: settings_section(*settings)),
            "options": self._options(now),
            "tool": Section(Same(snapshot), lambda: tool_section(snapshot)),
        }
        if driven is not None:
            sections["curve"] = Section(Same(driven), lambda: curve_section(driven.curve))
        return sections

    def _rehearsal(self, now: DriveRecord) -> Section[RehearsalSection]:
        told = now.state, now.words, now.mine, now.holder, now.unrecorded, now.target_id, now.hand_lost
        key = self.reads, Same(now.snapshot), *told, self._client, self._changed
        return Section(key, lambda: self._rehearsal_view(now))

    def _rehearsal_view(self, now: DriveRecord) -> RehearsalSection:
        section = rehearsal_section(now, self._before, self.so_far)
        if "tip" in section:
            section["taken_ms"] = self._taken_ms if section["state"] == "running" else None
        if now.hand_lost and "holding" in section:
            section["holding"] = _HAND_LOST
        section["can_take"] = now.holder is None and self._client.may_hold
        section["plan_changed"] = self._changed
        return section

    def _options(self, now: DriveRecord) -> Section[OptionsSection]:
        plan, wanted, known = self.workspace.plan.current, self.wanted, self._centre.known
        key = Same(plan), wanted, now.switches, now.may_switch, Same(known), self._has_ct

        def build() -> OptionsSection:
            centre = None if plan is None or len(plan.points) < 2 else self._centre.section(wanted.centre)
            return options_section(wanted, now.switches, centre, self._has_ct, now.may_switch)

        return Section(key, build)

    def layers(self) -> list[Layer[Any]]:
        """The robot while the step is active; points and curve of what is driven instead of the plan's."""
        if not self.active:
            return []
        layers: list[Layer[Any]] = []
        driven, now = self.driven, self.now
        if driven is not None:
            layers += [
                items_layer(driven.items, None, locked=True),
                curve_layer(Same(driven), lambda: (driven.curve, None)),
            ]
        if now.snapshot is not None and now.robot is not None:
            layers.append(self._robot_layer(now.snapshot, now.robot, now.mine))
        centre = self._centre.centre(self.wanted.centre) if self.wanted.remote_centre else None
        if centre is not None and centre.into is not None:
            point, into = centre.point, centre.into
            key = (*point.tolist(), *into.tolist())
            show = partial(CentreNodes.show, point=point, into=into, radius=centre.tolerance_mm)
            layers.append(Layer("rehearse.centre", key, CentreNodes, show))
        return layers

    def _robot_layer(self, now: RigidSnapshot, robot: PlacedRobot, mine: bool) -> Layer[DriveNodes]:
        hand = self._hand
        key = (now.t, now.steps, now.mode, now.running, mine, tuple(now.force), hand)

        def show(nodes: DriveNodes) -> None:
            tool = (now.segments_start, now.segments_end, now.radius)
            nodes.show(robot.link_placements(now.q), tool, now.grip, now.force, mine)
            nodes.hand.show_sight(now.tip, now.virtual_point if now.mode == "inspect" else None)
            nodes.hand.show_blocked(now.blocking_point if now.held or now.slowed else None)

        return Layer("rehearse.drive", key, lambda view: DriveNodes(view, robot.robot.visuals), show, Same(robot))
