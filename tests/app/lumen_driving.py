"""A client in the Drive tab with a robot in a real control process, and the runs that its drives leave."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from session_doubles import CLIENT, Heard, Now, sections_of

from app.drives import commands as drives
from app.drives.shared_drives import SharedDrives
from app.lumen.document import StoredRoute
from app.messages.client import Client
from app.messages.fields import ClientMessage
from app.services import Services
from app.tabs.drive.tab import LumenDriveTab
from app.workspace.workspace import Workspace

INSERT = drives.Push(type="drive", direction=1)
PATIENCE_S = 240.0  # the kernels of a snake may have to be compiled


class Driving:
    """A client in the Drive tab with a route of a tube open."""

    def __init__(self, services: Services, shared: SharedDrives[Any, Any], client: Client = CLIENT) -> None:
        self.heard = Heard()
        self.workspace = Workspace(client, services, Now(), lambda request: request(), self.heard)
        self.tab = LumenDriveTab(self.workspace, shared)
        self.tab.active = True

    def open(self, route: StoredRoute) -> None:
        self.workspace.open_case(route.case_id)
        self.workspace.opened.set("route", route.id)

    def shown(self) -> dict[str, Any]:
        self.tab.tick()
        return sections_of(self.tab)

    def until(self, what: Callable[[dict[str, Any]], Any], hold: ClientMessage | None = None) -> dict[str, Any]:
        """Wait for what the page shows. hold: pressed anew, as a held key is, since a slow machine lets go."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            self.tab.handle_now(hold or drives.HoldCommand(type="heartbeat"))
            if what(shown := self.shown()):
                return shown
            time.sleep(0.02)
        raise AssertionError(f"it does not come; the page shows {self.shown()}")


def stored(services: Services, route: StoredRoute, count: int = 1) -> list[Any]:
    """The runs of a route, once there are so many."""
    waited = threading.Event()
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        runs = services.runs.list(plan_id=route.id)
        if len(runs) >= count:
            return list(runs)
        waited.wait(0.05)
    raise AssertionError("the run was not stored")
