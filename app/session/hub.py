"""All workspaces of the planner: tabs come, go, and find their state again when they come back."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import viser

from app.services import Services
from app.session.rehearsals import RehearsalRooms

if TYPE_CHECKING:
    from app.session.workspace import Workspace

MAX_PAGES = 16  # open at a time, each with a scene
MAX_WORKSPACES = 24  # with those whose page is away
LEASE_GRACE_S = 6.0  # a page that lost its connection keeps the handle for so long
ABANDONED_S = 600.0  # and its rehearsal for so long


@dataclass
class _Entry:
    workspace: Workspace
    connected: bool = False
    seen_at: float = field(default_factory=time.monotonic)


class SceneTabs(Protocol):
    """What the hub needs of the scene's server, which lies above it in the gateway."""

    def client_for(self, tab: str) -> viser.ClientHandle | None: ...

    def on_tab_connected(self, callback: Callable[[str, viser.ClientHandle], None]) -> None: ...

    def on_tab_gone(self, callback: Callable[[str], None]) -> None: ...


class TabTaken(Exception):
    """Another connection already speaks for this tab."""


class TooManyTabs(Exception):
    """As many pages are open as may be."""


class SessionHub:
    """Thread-safe registry of workspaces by tab."""

    def __init__(self, services: Services, scene_server: SceneTabs, warming: Callable[[], str]) -> None:
        """warming: words for what the planner still gets ready, empty once it is."""
        self._services, self._scene_server, self._warming = services, scene_server, warming
        self._rooms = RehearsalRooms()
        self._executor = ThreadPoolExecutor(max_workers=2, thread_name_prefix="session-work")
        self._lock = threading.Lock()
        self._entries: dict[str, _Entry] = {}
        scene_server.on_tab_connected(self._scene_connected)
        scene_server.on_tab_gone(self._scene_gone)

    def connect(self, tab: str, wanted: dict[str, str]) -> Workspace:
        """The workspace of a tab, new or as it was left. Raises TabTaken or TooManyTabs."""
        from app.session.workspace import Workspace  # imported here: slow to load, with all of the scene

        with self._lock:
            entry = self._entries.get(tab)
            if entry is not None and entry.connected:
                raise TabTaken
            if sum(known.connected for known in self._entries.values()) >= MAX_PAGES:
                raise TooManyTabs
            if entry is not None:
                entry.connected = True
                entry.workspace.page_back()
                return entry.workspace
            self._make_room()
            workspace = Workspace(tab, self._services, self._rooms, self._executor, self._warming)
            self._entries[tab] = _Entry(workspace, connected=True)
        workspace.start(wanted)
        client = self._scene_server.client_for(tab)
        if client is not None:
            workspace.scene_connected(client)
        return workspace

    def disconnect(self, tab: str) -> None:
        """The page is gone: the hand lets go at once, the handle after a grace (HAZ-11), the robot stays for long."""
        with self._lock:
            entry = self._entries.get(tab)
            if entry is None:
                return
            entry.connected, entry.seen_at = False, time.monotonic()
        entry.workspace.hand_gone()
        self._wait_for(entry)

    def _wait_for(self, entry: _Entry) -> None:
        """Give up by and by what a page had that does not come back; each time it is asked again whether it did."""
        seen_at, workspace = entry.seen_at, entry.workspace

        def still_away() -> bool:
            with self._lock:
                return not entry.connected and entry.seen_at == seen_at

        def give_up_handle() -> None:
            if still_away():
                workspace.give_up_handle(still_away)
                _later(ABANDONED_S - LEASE_GRACE_S, give_up_rehearsal)

        def give_up_rehearsal() -> None:
            workspace.give_up_rehearsal(still_away)

        _later(LEASE_GRACE_S, give_up_handle)

    def _make_room(self) -> None:
        while len(self._entries) >= MAX_WORKSPACES:
            idle = [tab for tab, entry in self._entries.items() if not entry.connected]
            oldest = min(idle, key=lambda tab: self._entries[tab].seen_at)
            self._entries.pop(oldest).workspace.close()

    def _workspace(self, tab: str) -> Workspace | None:
        with self._lock:
            entry = self._entries.get(tab)
            return None if entry is None else entry.workspace

    def _scene_connected(self, tab: str, client: viser.ClientHandle) -> None:
        workspace = self._workspace(tab)
        if workspace is not None:
            workspace.scene_connected(client)

    def _scene_gone(self, tab: str) -> None:
        workspace = self._workspace(tab)
        if workspace is not None:
            workspace.scene_gone()

    def close(self) -> None:
        """End every workspace and every control process."""
        with self._lock:
            entries = list(self._entries.values())
            self._entries.clear()
        for entry in entries:
            entry.workspace.close()
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._rooms.close()


def _later(seconds: float, action: Callable[[], None]) -> None:
    timer = threading.Timer(seconds, action)
    timer.daemon = True
    timer.start()
