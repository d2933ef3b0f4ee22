"""All workspaces of the planner: tabs come, go, and find their state again when they come back."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import viser

from app.services import Services
from app.steps.rehearse.shared_drive import SharedDrives
from vfix_engine.errors import VfixError

if TYPE_CHECKING:
    from app.session.client_session import ClientSession

_LOG = logging.getLogger(__name__)
MAX_PAGES = 16  # open at a time, each with a scene
MAX_WORKSPACES = 24  # with those whose page is away
LEASE_GRACE_S = 6.0  # a page that lost its connection keeps the handle for so long
ABANDONED_S = 600.0  # its rehearsal for so long
ENDED_S = 900.0  # and what it had selected and looked at for so long
TICK_S = 0.05  # a robot is shown at 20 Hz
LOOK_S = 1.0  # between looks whether the store has changed, and at what changes seldom


@dataclass
class _Entry:
    workspace: ClientSession
    connected: bool = False
    seen_at: float = field(default_factory=time.monotonic)
    given_up: int = 0  # how much of what an absent page had is given up: its handle, its rehearsal


class SceneTabs(Protocol):
    """What the hub needs of the scene's server, which lies above it in the gateway."""

    def client_for(self, tab: str) -> viser.ClientHandle | None: ...

    def on_tab_connected(self, callback: Callable[[str, viser.ClientHandle], None]) -> None: ...

    def on_tab_gone(self, callback: Callable[[str], None]) -> None: ...


class TabTaken(Exception):
    """Another connection already speaks for this tab."""


class TooManyTabs(Exception):
    """As many pages are open as may be."""


class ClientSessions:
    """Thread-safe registry of workspaces by tab."""

    def __init__(self, services: Services, scene_server: SceneTabs, warming: Callable[[], str]) -> None:
        """warming: words for what the planner still gets ready, empty once it is."""
        self._services, self._scene_server, self._warming = services, scene_server, warming
        self._rooms = SharedDrives()
        # A load, a dry run and a start for every tab: what is slow for one keeps none of the others waiting.
        self._executor = ThreadPoolExecutor(max_workers=3 * MAX_WORKSPACES, thread_name_prefix="session-work")
        self._lock = threading.Lock()
        self._entries: dict[str, _Entry] = {}
        self._look_at, self._stored, self._unread = 0.0, -1, False
        self._stopped = threading.Event()
        self._clock = threading.Thread(target=self._run, name="session-clock", daemon=True)
        scene_server.on_tab_connected(self._scene_connected)
        scene_server.on_tab_gone(self._scene_gone)

    def start(self) -> None:
        """Let the one clock of all workspaces tick."""
        self._clock.start()

    def _run(self) -> None:
        while not self._stopped.wait(TICK_S):
            try:
                self.beat(time.monotonic())
            except Exception:
                _LOG.exception("the clock of the workspaces stumbled")

    def beat(self, now: float) -> None:
        """One tick: pages that are there are shown what changes by itself, those that are away cost nothing."""
        look = now >= self._look_at
        changed = False
        if look:
            self._look_at = now + LOOK_S
            changed = self._store_changed()
        with self._lock:
            entries = list(self._entries.items())
        for tab, entry in entries:
            if not entry.connected:
                self._wait_for(tab, entry, now)
            elif look or entry.workspace.lively:
                entry.workspace.tick(changed)

    def _store_changed(self) -> bool:
        """Whether anything was stored since the last look; a store that cannot be asked is logged once."""
        before = self._stored
        try:
            self._stored = self._services.store.data_version()
        except VfixError as error:
            if not self._unread:
                _LOG.warning("pages are not told what changes elsewhere: %s", error)
            self._unread = True
            return False
        self._unread = False
        return self._stored != before

    def connect(self, tab: str, wanted: dict[str, str]) -> ClientSession:
        """The workspace of a tab, new or as it was left. Raises TabTaken or TooManyTabs."""
        from app.session.client_session import ClientSession  # imported here: slow to load, with all of the scene

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
            workspace = ClientSession(tab, self._services, self._rooms, self._executor, self._warming)
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
            entry.connected, entry.seen_at, entry.given_up = False, time.monotonic(), 0
        entry.workspace.hand_gone()

    def _wait_for(self, tab: str, entry: _Entry, now: float) -> None:
        """Give up by and by what a page had that does not come back; each time it is asked again whether it did."""
        with self._lock:  # asked and marked in one: a page that comes back in between would keep the mark
            seen_at, given_up, workspace = entry.seen_at, entry.given_up, entry.workspace
            known = self._entries.get(tab) is entry and not entry.connected
            if not known or now - seen_at < (LEASE_GRACE_S, ABANDONED_S, ENDED_S)[given_up]:
                return
            if given_up == 2:
                del self._entries[tab]
            else:
                entry.given_up += 1

        def still_away() -> bool:
            with self._lock:
                return not entry.connected and entry.seen_at == seen_at

        if given_up == 0:
            workspace.give_up_handle(still_away)
        elif given_up == 1:
            workspace.give_up_rehearsal(still_away)
        else:
            workspace.close()

    def _make_room(self) -> None:
        while len(self._entries) >= MAX_WORKSPACES:
            idle = [tab for tab, entry in self._entries.items() if not entry.connected]
            oldest = min(idle, key=lambda tab: self._entries[tab].seen_at)
            self._entries.pop(oldest).workspace.close()

    def _workspace(self, tab: str) -> ClientSession | None:
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
        self._stopped.set()
        if self._clock.is_alive():
            self._clock.join()
        with self._lock:
            entries = list(self._entries.values())
            self._entries.clear()
        for entry in entries:
            entry.workspace.close()
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._rooms.close()
