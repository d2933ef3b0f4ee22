"""Drive on the server: the shared drive of the open route, keys and requests of its hand, the robot in the scene."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from app.drives import commands as drives
from app.drives.shared_drives import DriveKey, SharedDrives
from app.drives.view import details_section
from app.kit.errors import NotFound
from app.kit.kept import Same
from app.lumen.document import StoredRoute
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.scene.lumen import PathwayNodes
from app.scene.robot import ToolNodes
from app.tabs.drive import SPEC
from app.tabs.drive import commands as c
from app.tabs.drive.preparation import PreparedSnake, prepare
from app.tabs.drive.view import scope_section, snake_section
from app.tabs.drive_tab import NOT_HELD, DriveTab
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace
from vfix_engine.errors import ControlError
from vfix_engine.runtime.requests import Straighten
from vfix_engine.worlds.snake import LookRound
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

KIND = "route"


class LumenDriveTab(DriveTab[PreparedSnake, SnakeSnapshot]):
    """Owned by the session's thread; only :attr:`drive` is read from others."""

    spec = SPEC
    first_view = "anterior"

    def __init__(self, workspace: Workspace, shared: SharedDrives[PreparedSnake, SnakeSnapshot]) -> None:
        super().__init__(workspace, shared)
        self._routes = workspace.services.lumen_routes
        self._route: StoredRoute | None = None
        self._held = [0, 0]  # keys: to the side, and along the lumen
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
        return None if self._route is None else self._routes.paths.key(self._route)

    def prepare(self) -> PreparedSnake:
        route = self._route
        if route is None:
            raise ControlError("make a route first.")
        return prepare(self.workspace.services, route)

    def enter(self) -> None:
        """Put the robot at the entry where nobody else has it."""
        drive, route = self.drive, self._route
        complete = route is not None and route.content.entry is not None and route.content.end is not None
        if drive is not None and complete and not drive.is_for(self.made_of()) and drive.lease.take(self.client):
            self.open(drive)

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        if not isinstance(command, c.TurnCamera):
            super().handle(command)
            return
        drive = self.need_drive()
        if not self.read().mine:
            raise ControlError(NOT_HELD)
        drive.apply(self.client, Straighten() if command.type == "camera.straighten" else LookRound())

    def handle_now(self, command: ClientMessage) -> None:
        """Keys are axes of this robot: along the lumen, and the camera to a side."""
        drive = self.drive
        if isinstance(command, drives.Push) and drive is not None:
            self._held[command.type == "drive"] = command.direction
            drive.axes(self.client, self._held[0], 0.0, self._held[1])
        else:
            super().handle_now(command)

    # -- what the page and the scene show

    def subject(self) -> object:
        return self.workspace.opened.id(KIND), self.workspace.services.store.changes.of(KIND)

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
        figures = Same(now.snapshot), Same(now.prepared), now.settings
        return {
            "rehearsal": Section((*self.drive_key(), self.changed), self._section),
            "details": Section(Same(now.snapshot), lambda: details_section(now.snapshot)),
            "snake": Section(figures, lambda: snake_section(now)),
            "scope": Section(
                (told, Same(case), Same(route), Same(known), live),
                lambda: scope_section(case.id, case.content_hash, route, known, live) if case and told else None,
            ),
        }

    def _section(self) -> Any:
        section = self.drive_section()
        if self.changed and section["state"] in ("ready", "paused"):
            section["words"] = "The route has changed. Reset takes it as it is now."
        return section

    @property
    def changed(self) -> bool:
        """Whether the route is another one than what stands there was prepared from."""
        return self.now.prepared is not None and not self.now.is_for(self.made_of())

    def layers(self) -> list[Layer[Any]]:
        """The robot, and its pathway, while the tab is active."""
        now, prepared = self.now.snapshot, self.now.prepared
        if not self.active or now is None or prepared is None:
            return []
        capsules, path = np.asarray(now.capsules), prepared.path
        ends = capsules[:, :3], capsules[:, 3:6], capsules[:, 6]
        line = path.lumen.centreline.curve.points
        return [
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

    def hint(self) -> str:
        now, route = self.now, self._route
        if route is None:
            return "Make a route first, in Route."
        if now.shown_state == "starting":
            return "The robot comes to the entry."
        if now.shown_state == "running" and now.mine:
            return "Wheel in the picture inserts; drag turns the camera."
        return "Press Start, then turn the wheel in the picture."
