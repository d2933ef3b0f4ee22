"""Drive on the server: the shared drive of the open route, keys and requests of its hand, the robot in the scene."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from app.drives import commands as drives
from app.drives.drive_process import Tell
from app.drives.shared_drive import SharedDrive
from app.drives.shared_drives import DriveKey, SharedDrives
from app.drives.view import FREE, details_section
from app.kit.errors import NotFound
from app.kit.kept import Same
from app.lumen.document import StoredRoute
from app.lumen.drive_options import LumenDriveOptions
from app.lumen.tasks import TaskChoice, TaskName, tasks_in
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.scene.lumen import PathwayNodes
from app.scene.robot import ToolNodes
from app.tabs.drive import SPEC
from app.tabs.drive import commands as c
from app.tabs.drive.keys import key_axes
from app.tabs.drive.options import options_view
from app.tabs.drive.preparation import PreparedSnake, made_of, prepare
from app.tabs.drive.task import chosen_task, task_section
from app.tabs.drive.view import free_words, scope_section, snake_section, snake_settings
from app.tabs.drive_tab import NOT_HELD, DriveTab
from app.workspace.fixed_drive import FIXED
from app.workspace.layers import Layer
from app.workspace.task_view import task_layers
from app.workspace.workspace import Workspace
from vfix_engine.arrays import Array
from vfix_engine.errors import ControlError
from vfix_engine.runtime.command import BUTTON_CUT, NO_AXES
from vfix_engine.runtime.requests import Request, Straighten
from vfix_engine.worlds.snake.requests import ChooseJoint, LookRound
from vfix_engine.worlds.snake.settings import SnakeSettings
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

KIND = "route"
BOUNDS = frozenset(("bound_mm", "tip_bound_mm"))  # settings that a drive of the page keeps from its begin to its end
_GHOST = 0.25  # opacity of a control bend


class LumenDriveTab(DriveTab[PreparedSnake, SnakeSnapshot]):
    """Owned by the session's thread; only :attr:`drive` is read from others."""

    spec = SPEC
    first_view = "anterior"

    def __init__(self, workspace: Workspace, shared: SharedDrives[PreparedSnake, SnakeSnapshot]) -> None:
        super().__init__(workspace, shared)
        self._routes = workspace.services.lumen_routes
        self._route: StoredRoute | None = None
        self._shows_bends = False  # the control bends, as ghosts
        workspace.opened.on_changed(KIND, self._opened)

    # -- which route

    def _opened(self) -> None:
        self._route = self._read_route()
        case_id = self.workspace.case.case_id
        key = None if self._route is None or case_id is None else DriveKey(case_id, self._route.id)
        self.go_to(key)

    def _read_route(self) -> StoredRoute | None:
        route_id = self.workspace.opened.id(KIND)
        try:
            return None if route_id is None else self._routes.documents.get(route_id)
        except NotFound:
            return None

    def made_of(self) -> object:
        return None if self._route is None else made_of(self.workspace.services, self._route, self.options)

    @property
    def options(self) -> LumenDriveOptions:
        """What is chosen for this drive and the next one, or what a trial fixes."""
        fixed, drive = self.fixed, self.drive
        if fixed is not None and isinstance(fixed.how, LumenDriveOptions):
            return fixed.how
        return LumenDriveOptions() if drive is None or drive.options is None else drive.options

    def prepare(self, tell: Tell) -> PreparedSnake:
        route = self._route
        if route is None or self.drive is None:
            raise ControlError("make a route first.")
        options = self.options
        if self.fixed is not None:  # those of a trial stay with its robot; nobody chooses others meanwhile
            self.drive.options = options
        return prepare(self.workspace.services, route, options, tell)

    def enter(self) -> None:
        """Put the robot at the entry where nobody else has it."""
        drive, route = self.drive, self._route
        complete = route is not None and route.content.entry is not None and route.content.end is not None
        if drive is not None and complete and not drive.is_for(self.made_of()) and drive.lease.take(self.client):
            self.open(drive)

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        match command:
            case c.TurnCamera():
                self._request(Straighten() if command.type == "camera.straighten" else LookRound())
            case c.TurnJoint():
                self._request(ChooseJoint(command.joint))
            case c.ChooseArm():
                self._choose(replace(self.options, arm=command.arm))
            case c.ChooseParameters():
                self._choose(replace(self.options, preset=command.preset))
            case c.SetLinkValues():
                self._choose(
                    replace(
                        self.options,
                        bounds_mm=command.bounds_mm,
                        thresholds_mm=command.thresholds_mm,
                        springs_n_per_mm=command.springs_n_per_mm,
                    )
                )
            case c.ChooseTask():
                self._choose(replace(self.options, task=self._possible(chosen_task(command))))
            case drives.SetDriveSettings() if not BOUNDS.isdisjoint(command.values):
                raise ControlError("bounds are those of a whole drive; choose them in Values by link.")
            case c.ShowBends():
                self._shows_bends = command.on
            case _:
                super().handle(command)

    def _possible(self, task: TaskChoice | None) -> TaskChoice | None:
        """Raises ControlError for a task that cannot be made here, before the drive that goes on is ended for it."""
        if task is not None and task.task not in self._offered():
            other = "labels are traced in the body cavity" if task.task == "labels" else "polyps are viewed in a colon"
            raise ControlError(f"{other}; open that case.")
        if task is not None and task.places == "route" and not self._marks("polyp"):
            raise ControlError("the route has no polyps; put some on the wall in Route.")
        return task

    def _marks(self, kind: str) -> int:
        """Of the route."""
        return 0 if self._route is None else sum(mark.kind == kind for mark in self._route.content.marks)

    def _request(self, request: Request) -> None:
        """Ask the robot that this client holds. Raises ControlError where it does not."""
        drive = self.need_drive()
        if not self.read().mine:
            raise ControlError(NOT_HELD)
        drive.apply(self.client, request)

    def _choose(self, options: LumenDriveOptions) -> None:
        """Other options: the run ends, and the next begins at the entry.

        Raises ControlError where this client may not.
        """
        drive = self.need_drive()
        now = self.read()
        if not now.may_prepare:
            raise ControlError(NOT_HELD)
        if options == self.options:
            return
        if self.fixed is not None:
            raise ControlError(FIXED)
        drive.options = options
        if now.state != "absent":
            self._run_when_ready = False
            self.open(drive)
        self.read()

    def reset(self, drive: SharedDrive[PreparedSnake, SnakeSnapshot]) -> None:
        """Back to the entry; a task ends with its run, but is taken along to a route that has changed."""
        if self.fixed is not None:
            raise ControlError(FIXED)
        if self.options.task is None or self.changed:
            super().reset(drive)
        else:
            self._choose(replace(self.options, task=None))

    def handle_now(self, command: ClientMessage) -> None:
        """Keys are axes of this robot; a drag is the way of its camera, a wheel the depth of its tip."""
        drive = self.drive
        if isinstance(command, drives.Push | c.TiltCamera) and drive is not None:
            settings = snake_settings(self.now) or SnakeSettings()  # a record is replaced as a whole, never changed
            self.push_axes(drive, command.type, key_axes(command, settings.camera_mm_per_s))
        elif isinstance(command, c.DragCamera) and drive is not None:
            drive.drag(self.client, command.right_mm, command.down_mm, command.held)
        elif isinstance(command, c.InsertTo) and drive is not None:
            drive.wheel(self.client, command.depth_mm, command.held)
        elif isinstance(command, c.CutTool) and drive is not None:
            self.buttons = BUTTON_CUT if command.on else 0
            self.push_axes(drive, "tool", NO_AXES)
        else:
            super().handle_now(command)

    def _offered(self) -> tuple[TaskName, ...]:
        return tasks_in(self.workspace.case.case)

    # -- what the page and the scene show

    def subject(self) -> object:
        return self.fixed, self.workspace.opened.id(KIND), self.workspace.services.store.changes.of(KIND)

    def refresh(self) -> None:
        self._route = self._read_route()
        self.read()

    def sections(self) -> Sections:
        """The :class:`LumenDriveSections`."""
        now = self.read()
        case, route = self.workspace.case.case, self._route
        live = now.snapshot is not None
        known = None if route is None or not self.active else self._routes.paths.known(route)
        told = case is not None and self.active
        shown = self._shows_bends
        figures = Same(now.snapshot), Same(now.prepared), now.settings, shown
        options = self.options, now.may_prepare and self.fixed is None
        return {
            "rehearsal": Section((*self.drive_key(), self.changed), self._section),
            "details": Section(Same(now.snapshot), lambda: details_section(now.snapshot)),
            "snake": Section(figures, lambda: snake_section(now, shown)),
            "drive_options": Section(options, lambda: options_view(*options)),
            "drive_task": task_section(now, *options, route, self._offered()),
            "scope": Section(
                (told, Same(case), Same(route), Same(known), live),
                lambda: scope_section(case.id, case.content_hash, route, known, live) if case and told else None,
            ),
        }

    def _section(self) -> Any:
        section = self.drive_section()
        if self.now.snapshot is not None and section.get("holding") == FREE:
            section["holding"] = free_words(self.now.snapshot)
        if self.changed and section["state"] in ("ready", "paused"):
            do = "Cancel the trial in Study to take it." if self.fixed else "Reset takes it as it is now."
            section["words"] = f"The route has changed. {do}"
        return section

    @property
    def changed(self) -> bool:
        """Whether the route is another one than what stands there was prepared from."""
        return self.now.prepared is not None and not self.now.is_for(self.made_of())

    def layers(self) -> list[Layer[Any]]:
        """The robot, and its pathway, while the tab is active."""
        now, prepared = self.now.snapshot, self.now.prepared
        task = None if prepared is None else prepared.task
        if not self.active or now is None or prepared is None:
            return []
        capsules, path = np.asarray(now.capsules), prepared.path
        ends = capsules[:, :3], capsules[:, 3:6], capsules[:, 6]
        line = path.lumen.centreline.curve.points
        ghosts = self._ghosts(now.control_bends, float(capsules[0, 6]))
        return [
            *ghosts,
            *([] if task is None else task_layers(task.moment, Same(task))),
            Layer(
                "drive.pathway",
                Same(path),
                lambda view: PathwayNodes(view, path.surface),
                partial(PathwayNodes.show, centreline=line, rings=[]),
                Same(path),
            ),
            Layer(
                "drive.robot",
                Same(now),
                lambda view: ToolNodes(view.scene, "/robot/snake"),
                lambda nodes: nodes.place(*ends),
                Same(prepared),
            ),
        ]

    def _ghosts(self, bends: Array, radius_mm: float) -> list[Layer[Any]]:
        """The control bends as translucent robots, where they are shown."""
        if not self._shows_bends or not bends.size:
            return []
        starts, ends = bends[:, :-1].reshape(-1, 3), bends[:, 1:].reshape(-1, 3)
        return [
            Layer(
                "drive.bends",
                bends.tobytes(),
                lambda view: ToolNodes(view.scene, "/robot/bend", _GHOST),
                lambda nodes: nodes.place(starts, ends, np.full(len(starts), radius_mm)),
                Same(self.now.prepared),
            )
        ]

    def hint(self) -> str:
        now, route = self.now, self._route
        if route is None:
            return "Make a route first, in Route."
        if now.shown_state == "starting":
            return "The robot comes to the entry."
        fixed = "labels" in self._offered()  # on a base in the cavity
        if fixed and now.shown_state != "running":
            return f"Press {'Continue' if now.shown_state == 'paused' else 'Start'}, then drag in the picture."
        if fixed and now.mine:
            return "Drag or arrow keys turn the camera; hold X to cut."
        if now.shown_state == "running" and now.mine:
            return "Wheel or W S insert; a drag or arrow keys turn."
        if now.shown_state == "paused":
            return "Press Continue: the robot goes on from where it is."
        return "Press Start, then turn the wheel in the picture."
