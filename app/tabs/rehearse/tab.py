"""Rehearse: the shared drive of the open plan, whether this client holds its handle, and what it shows of it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from app.drives.plan_drive import PlanDrive
from app.kit.kept import Kept, Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.scene.centre import CentreNodes
from app.scene.tip_limits import DepthStopNodes, TubeNodes
from app.tabs.drive_tab import NOT_HELD, NOT_PLACED
from app.tabs.rehearse import SPEC
from app.tabs.rehearse import commands as c
from app.tabs.rehearse.drive_nodes import DriveNodes
from app.tabs.rehearse.drive_session import RehearsalDrive, RehearsalDrives, RehearsalRecord, RehearsalSession
from app.tabs.rehearse.hints import rehearse_hint
from app.tabs.rehearse.options import CentrePlaces, options_section, place_of
from app.tabs.rehearse.preparation import PreparedRehearsal
from app.tabs.rehearse.sections import NearnessView, OptionsSection, RehearsalSection
from app.tabs.rehearse.tool_snapshot import ToolSnapshot
from app.tabs.rehearse.truth import LiveTruth
from app.tabs.rehearse.view import (
    FREE_APPROACH,
    approach_section,
    details_section,
    is_certified,
    nearness_section,
    rehearsal_section,
    settings_section,
    tool_section,
)
from app.workspace.fixed_drive import FIXED
from app.workspace.layers import Layer
from app.workspace.plan_items import curve_layer, curve_section, entries, items_layer, plan_items
from app.workspace.workspace import Workspace
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, PlanError, VfixError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.robots import PlacedRobot
from vfix_engine.runtime.control_mode import FREEHAND, Control
from vfix_engine.runtime.requests import SetTask
from vfix_engine.worlds.freehand.snapshot import FreehandSnapshot
from vfix_engine.worlds.rigid.requests import ApproachPoint

UNCERTIFIED = f"{FREEHAND}, without the certificate"  # as others are told who follow the tool (HAZ-41)
NEAR_S = 1.0 / 15.0  # between two poses whose distances to protected structures are measured


class RehearseTab(RehearsalSession):
    """Owned by the session's thread; only :attr:`drive` is read from others."""

    spec = SPEC
    first_view = "nose"

    def __init__(self, workspace: Workspace, shared: RehearsalDrives) -> None:
        super().__init__(workspace, shared)
        self._centre = CentrePlaces(workspace.services, workspace.executor, workspace.post)
        self._told_of: ToolSnapshot | None = None  # the pose that others were told last
        self.truth = LiveTruth()
        self._near: ToolSnapshot | None = None  # the pose whose distances to structures are shown
        self._told = NO_OPTIONS  # the options as they were when everything was published last

    # -- entering and leaving the tab

    def enter(self) -> None:
        """Open the anatomy along the path, look at it, and put the robot at its entry where nobody else has it."""
        plan = self.workspace.plan.current
        self.workspace.case.open_up([] if plan is None else [item.position for item in plan_items(plan)])
        self.workspace.camera.look_from("nose")
        drive = self.drive
        if drive is None or plan is None or len(plan.content.points) < 2 or drive.is_for(self._key(plan)):
            return
        if drive.lease.take(self.client):
            self.open(drive)

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        """Raises PlanError where no plan is open, and ControlError where this client may not."""
        if isinstance(command, c.SetOptions):
            self._set_options(command)
        elif isinstance(command, c.SetMode):
            self._set_mode(command)
        elif isinstance(command, c.SetApproach):
            self._approach(command)
        elif isinstance(command, c.ChooseControl):
            self._set_control(command)
        elif isinstance(command, c.SetErrors):
            self.truth.choose(command)
        else:
            self.need_plan()
            super().handle(command)

    def _set_options(self, command: c.SetOptions) -> None:
        plan = self.need_plan()
        if not self.read().may_prepare:
            raise ControlError(NOT_HELD)
        place = place_of(command.centre_point, command.centre_mm)
        wanted = RehearsalOptions(
            soft_tissue=command.soft_tissue,
            remote_centre=command.remote_centre,
            speed_limit=command.speed_limit,
            tube_mm=command.tube_mm,
            stop_mm=command.stop_mm,
            centre=place,
        )
        if self.fixed is not None and wanted.in_force != NO_OPTIONS:
            raise ControlError(FIXED)
        self._services.rehearsal_options.choose(plan.id, wanted)

    def _set_mode(self, command: c.SetMode) -> None:
        """Another mode; the target is one of the robot that is there."""
        drive, prepared = self._need_placed()
        index = 0 if command.mode != "inspect" else prepared.target_index(command.target_id)
        drive.apply(self.client, SetTask(command.mode, index))

    def _approach(self, command: c.SetApproach) -> None:
        """The tip goes to a place of the path, and follows it from there."""
        drive, prepared = self._need_placed()
        if prepared.free:
            raise ControlError(FREE_APPROACH)
        at, length = command.at_mm, prepared.path.length
        if at is None:
            at = prepared.path_mm(command.point)
        if at > length:
            raise ControlError(f"the path ends at {length:.1f} mm; choose a place before that.")
        drive.apply(self.client, ApproachPoint(at))

    def _need_placed(self) -> tuple[RehearsalDrive, PreparedRehearsal]:
        """The drive and what stands there. Raises ControlError if nothing does, or this client may not instruct it."""
        drive = self.need_drive()
        self.need_instructor()
        if self.now.prepared is None:
            raise ControlError(NOT_PLACED)
        return drive, self.now.prepared

    def _set_control(self, command: c.ChooseControl) -> None:
        """Another control mode: at once where the same process has it, else the drive ends and another one stands at
        the entry.
        """
        drive, now = self.need_drive(), self.read()
        if not (now.may_instruct if now.state == "ready" else now.may_prepare):
            raise ControlError(NOT_HELD)
        before, preset, control = drive.control, drive.preset, Control(command.mode, command.device)
        if self.fixed is not None and self.fixed.how != PlanDrive(control, command.preset):
            raise ControlError(FIXED)
        drive.choose(control, command.preset)
        now = self.read()  # what came before the choice was made is told it here, what comes later begins with it
        try:
            if (before.mode == FREEHAND, preset) != (control.mode == FREEHAND, command.preset):
                if now.state != "absent":
                    self._run_when_ready = False
                    self.open(drive)
            elif now.state in ("ready", "silent") and control.mode != FREEHAND:
                drive.change_control(self.client, control)
        except VfixError:
            drive.choose(before, preset)  # what stands there goes on as it was
            raise
        finally:
            self.read()

    def start(self, drive: RehearsalDrive) -> None:
        """Never by a registration that is not the plan's any more: at the entry the robot is placed anew, else it
        stays there. What stands at the entry with other options is placed anew, too.
        """
        self._registered = Kept()  # read now, not when something was stored last
        now = self.read()
        at_entry = now.snapshot is None or now.snapshot.steps == 0
        withdrawn = self._withdrawn(now)
        if now.state == "ready" and at_entry and (withdrawn or not self._has_wanted(now)):
            self._services.planning.registration(self.need_plan())
            self.open(drive)
            self._run_when_ready = True
        elif withdrawn:
            raise PlanError(withdrawn)
        else:
            super().start(drive)

    def reset(self, drive: RehearsalDrive) -> None:
        if self._has_wanted(self.read()):
            super().reset(drive)
        else:
            self.open(drive)

    def _has_wanted(self, now: RehearsalRecord) -> bool:
        """Whether what stands here has the options as they are wanted."""
        return now.prepared is not None and now.prepared.options == self.in_force

    # -- each tick

    def tick(self) -> bool:
        """Read the newest snapshot, and tell the user what the control process has said."""
        super().tick()
        self.truth.follow(self.now.snapshot, self.now.prepared)
        edited, self._plan_edited = self._plan_edited, False
        if self._services.live.wanted:
            self._tell_tool(self.now)
        drawn, told, self._told = self.driven, self._told, self.wanted
        self._compare(self.now)
        if words := self._stop_where_withdrawn(self.now):
            self.workspace.note(words, error=True)
        return edited or self.driven is not drawn or told != self._told

    def _tell_tool(self, now: RehearsalRecord) -> None:
        """Say where the tool is, for those who are connected to the planner; the client that drives says it."""
        if now.mine and now.snapshot is not None and now.prepared is not None and now.snapshot is not self._told_of:
            self._told_of = now.snapshot
            pose, robot, snapshot = np.eye(4), now.prepared.robot, now.snapshot
            if isinstance(snapshot, FreehandSnapshot):
                pose[:3, :3], pose[:3, 3] = snapshot.rotation, snapshot.tip
            elif robot is not None:
                pose[:3, :3], pose[:3, 3] = robot.tip_pose(snapshot.q)
            self._services.live.show_tool(pose, now.control.mode if is_certified(now) else UNCERTIFIED)

    def run_when_ready(self, drive: RehearsalDrive) -> None:
        """A robot that came with other options comes again; one whose registration has changed stays."""
        if self.workspace.plan.current is not None and not self._has_wanted(self.now):
            self.open(drive)
            return
        self._registered = Kept()  # it may have changed while the robot came
        if words := self._withdrawn(self.now):
            self._run_when_ready = False
            self.workspace.note(words, error=True)
        else:
            super().run_when_ready(drive)

    # -- what the page and the scene show

    def hint(self) -> str:
        plan, now = self.workspace.plan.current, self.now
        points, targets = (0, 0) if plan is None else (len(plan.content.points), len(plan.content.targets))
        mode, phase = ("path", "") if now.snapshot is None else (now.snapshot.mode, now.snapshot.phase)
        free = self.drive is not None and now.holder is None
        doubtful = False
        # Another margin than that of the dry run has another verdict, which the panel tells.
        if now.prepared is not None and now.prepared.planned is not None and not self._other_margin(now):
            doubtful = now.prepared.planned.doubtful
        blocked = self._withdrawn(now) if self._changed else ""
        state, changed = now.shown_state, self._changed
        return rehearse_hint(
            points, state, now.mine, free, mode, phase, targets, changed, doubtful, blocked, is_certified(now)
        )

    def _other_margin(self, now: RehearsalRecord) -> bool:
        """Whether the margin was changed since the drive was prepared."""
        return now.prepared is not None and _settings(now).margin_mm != now.prepared.settings.margin_mm

    def subject(self) -> object:
        """The drive itself is read with every tick. Of a plan without robot and limits on its path little is told."""
        plan, wanted = self.workspace.plan.current, self.wanted
        along = wanted.remote_centre or wanted.tube_mm is not None or wanted.stop_mm is not None
        if plan is not None and self.now.prepared is None and not along:
            return wanted, self.fixed, plan.id, len(plan.content.points) < 2
        return wanted, self.fixed, Same(plan), self._services.store.changes.of(self._services.registrations.kind.name)

    def refresh(self) -> None:
        self._compare(self.read())
        self.truth.know(self._services, self.workspace.plan.current)
        if self.active or self.wanted.remote_centre:
            self._centre.ask(self.workspace.plan.current)

    def sections(self) -> Sections:
        """The :class:`RehearsalSections`."""
        now, driven, snapshot = self.now, self.driven, self.now.snapshot
        settings = _settings(now), now.answered, now.refusal, self._uncertainty, is_certified(now)
        sections: dict[str, Section[object]] = {
            "rehearsal": Section((*self.drive_key(), self._changed), lambda: self._rehearsal(now)),
            "driven": Section(Same(driven), lambda: None if driven is None else entries(driven.items)),
            "details": Section(Same(snapshot), lambda: details_section(snapshot)),
            "settings": Section(settings, lambda: settings_section(*settings)),
            "options": self._options(now),
            "approach": Section(
                (Same(now.prepared), now.may_instruct, now.holder is None), lambda: approach_section(now)
            ),
            "tool": Section(Same(snapshot), lambda: tool_section(snapshot)),
            "nearness": self._nearness(now),
            "truth": self.truth.section(_settings(now), now.mine),
        }
        if driven is not None:
            sections["curve"] = Section(Same(driven), lambda: curve_section(driven.curve))
        return sections

    def _rehearsal(self, now: RehearsalRecord) -> RehearsalSection:
        section = rehearsal_section(now, self.before, self.so_far)
        self.finish(section)
        section["plan_changed"] = self._changed
        return section

    def _nearness(self, now: RehearsalRecord) -> Section[list[NearnessView]]:
        """Only while it is in sight, and of a tool that runs fifteen times a second: it takes milliseconds each."""
        before, snapshot = self._near, now.snapshot if self.active else None
        if before is not None and snapshot is not None and snapshot.running:
            snapshot = before if 0.0 <= snapshot.t - before.t < NEAR_S else snapshot
        self._near = snapshot
        margin = _settings(now).kept_mm if is_certified(now) else 0.0
        zones = () if now.prepared is None else now.prepared.protected
        return Section((Same(snapshot), Same(zones), margin), lambda: nearness_section(snapshot, zones, margin))

    def _options(self, now: RehearsalRecord) -> Section[OptionsSection]:
        plan, wanted = self.workspace.plan.current, self.wanted
        in_force = None if now.prepared is None else now.prepared.options
        free, fixed = now.holder is None, self.fixed is not None
        key = Same(plan), wanted, in_force, now.may_prepare, free, fixed, Same(self._centre.known), self._has_ct

        def build() -> OptionsSection:
            centre = None if plan is None or len(plan.content.points) < 2 else self._centre.section(wanted.centre)
            return options_section(wanted, in_force, centre, self._has_ct, now.may_prepare, free, fixed)

        return Section(key, build)

    def layers(self) -> list[Layer[Any]]:
        """The robot while the tab is active; points and curve of what is driven instead of the plan's."""
        if not self.active:
            return []
        layers: list[Layer[Any]] = []
        driven, now = self.driven, self.now
        if driven is not None:
            layers += [
                items_layer(driven.items, None, locked=True),
                curve_layer(Same(driven), lambda: (driven.curve, None)),
            ]
        if now.snapshot is not None and now.prepared is not None:
            layers.append(self._robot_layer(now.snapshot, now.prepared.robot, now.mine))
        layers += self.truth.layers()
        return layers + self._limits_layers(now.prepared)

    def _limits_layers(self, prepared: PreparedRehearsal | None) -> list[Layer[Any]]:
        """What holds the tip: of the robot that stands there, otherwise as the next start will have it."""
        known = self._centre.known
        path: SplinePath | None
        if prepared is not None:
            options, path, centre = prepared.options, prepared.path, prepared.centre
        else:
            options, path = self.in_force, None if known is None else known.path
            centre = self._centre.centre(options.centre) if options.remote_centre else None
        layers: list[Layer[Any]] = []
        if options.tube_mm is not None and path is not None:
            show_tube = partial(TubeNodes.show, path=path, radius=options.tube_mm)
            layers.append(Layer("rehearse.tube", (Same(path), options.tube_mm), TubeNodes, show_tube))
        if options.stop_mm is not None and path is not None:
            show_stop = partial(DepthStopNodes.show, path=path, past_mm=options.stop_mm)
            layers.append(Layer("rehearse.stop", (Same(path), options.stop_mm), DepthStopNodes, show_stop))
        if centre is not None and centre.into is not None:
            point, into = centre.point, centre.into
            key = (*point.tolist(), *into.tolist())
            show = partial(CentreNodes.show, point=point, into=into, radius=centre.tolerance_mm)
            layers.append(Layer("rehearse.centre", key, CentreNodes, show))
        return layers

    def _robot_layer(self, now: ToolSnapshot, robot: PlacedRobot | None, mine: bool) -> Layer[DriveNodes]:
        """The tool and the robot, which a free hand does not have."""
        hand = self._hand
        key = (now.t, now.steps, now.mode, now.running, mine, tuple(now.force), hand)

        def show(nodes: DriveNodes) -> None:
            tool = (now.segments_start, now.segments_end, now.radius)
            links = None if robot is None else robot.link_placements(now.q)
            nodes.show(links, tool, now.grip, now.force, mine)
            nodes.hand.show_sight(now.tip, now.virtual_point if now.mode == "inspect" else None)
            blocked = None if isinstance(now, FreehandSnapshot) or not (now.held or now.slowed) else now.blocking_point
            nodes.hand.show_blocked(blocked)

        visuals = () if robot is None else robot.robot.visuals
        return Layer("rehearse.drive", key, lambda view: DriveNodes(view, visuals), show, Same(robot))


def _settings(now: RehearsalRecord) -> ControlSettings:
    """Those in force; those that a plan begins with where there is no robot."""
    return now.settings if isinstance(now.settings, ControlSettings) else ControlSettings()
