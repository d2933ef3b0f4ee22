"""All workspaces of the planner: tabs come, go, and find their state again when they come back."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Protocol

import viser

from app.services import Services
from app.session.rehearsals import RehearsalRooms
from app.session.workspace import Workspace

MAX_WORKSPACES = 24
LEASE_GRACE_S = 6.0  # a page that lost its connection keeps the handle for so long


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
    """Every workspace is in use."""


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
        with self._lock:
            entry = self._entries.get(tab)
            if entry is not None and entry.connected:
                raise TabTaken
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
        """The page is gone: the hand lets go at once, the handle itself after a grace (HAZ-11)."""
        with self._lock:
            entry = self._entries.get(tab)
            if entry is None:
                return
            entry.connected, entry.seen_at = False, time.monotonic()
        entry.workspace.hand_gone()
        timer = threading.Timer(LEASE_GRACE_S, self._give_up_lease, (tab,))
        timer.daemon = True
        timer.start()

    def _give_up_lease(self, tab: str) -> None:
        with self._lock:
            entry = self._entries.get(tab)
            away = entry is not None and not entry.connected and time.monotonic() - entry.seen_at >= LEASE_GRACE_S - 0.5
        if entry is not None and away:
            entry.workspace.give_up_handle()

    def _make_room(self) -> None:
        while len(self._entries) >= MAX_WORKSPACES:
            idle = [tab for tab, entry in self._entries.items() if not entry.connected]
            if not idle:
                raise TooManyTabs
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
