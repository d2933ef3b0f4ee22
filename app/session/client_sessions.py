"""The sessions of all clients: created, kept for a while after a disconnect, and ended."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import viser

from app.kit.prompt_threads import PROMPT_THREADS
from app.services import Services
from vfix_engine.error_places import error_kind, error_places
from vfix_engine.errors import VfixError

if TYPE_CHECKING:
    from app.session.client_session import ClientSession
    from app.tabs.base import Closable

_LOG = logging.getLogger(__name__)
MAX_PAGES = 16  # open at a time, each with a scene
MAX_SESSIONS = 24  # including those whose page is disconnected
LEASE_GRACE_S = 6.0  # how long a disconnected page keeps the handle
ABANDONED_S = 600.0  # its rehearsal
CLOSE_S = 10.0  # how long the planner waits for sessions and their work when it ends
ENDED_S = 900.0  # and its selection and view
TICK_S = 0.02  # period of live sections, whose figures are shown at 50 Hz
JOBS_S = 0.1  # polling interval of jobs, which may report at every step
LOOK_S = 1.0  # polling interval for changes of the store by other processes, and for values that change seldom


@dataclass
class _Entry:
    session: ClientSession | None = None  # None while it is made
    connected: bool = False
    seen_at: float = field(default_factory=time.monotonic)
    given_up: int = 0  # stages of releasing what a disconnected page held: its handle, its rehearsal


class SceneTabs(Protocol):
    """Interface of the scene's server, which belongs to the gateway, a room above."""

    def client_for(self, tab: str) -> viser.ClientHandle | None: ...

    def on_tab_connected(self, callback: Callable[[str, viser.ClientHandle], None]) -> None: ...

    def on_tab_gone(self, callback: Callable[[str], None]) -> None: ...


class TabTaken(Exception):
    """Another connection of this client exists already."""


class TooManyTabs(Exception):
    """The limit of open pages is reached."""


class ClientSessions:
    """Thread-safe registry of sessions by client."""

    def __init__(self, services: Services, scene_server: SceneTabs, warming: Callable[[], str]) -> None:
        """warming: words for the preparation of the planner, empty once it is done."""
        self._services, self._scene_server, self._warming = services, scene_server, warming
        self._shared: dict[str, Closable | None] = {}
        self._sharing = threading.Lock()
        # A load, a dry run, a preview, cones and a start for every client: none waits for another.
        self._executor = ThreadPoolExecutor(max_workers=5 * MAX_SESSIONS, thread_name_prefix="session-work")
        self._lock = threading.Lock()
        self._entries: dict[str, _Entry] = {}
        self._look_at, self._unread = 0.0, False
        self._jobs_at, self._jobs_version = 0.0, 0
        self._stopped = threading.Event()
        self._clock = threading.Thread(target=self._run, name="session-clock", daemon=True)
        scene_server.on_tab_connected(self._scene_connected)
        scene_server.on_tab_gone(self._scene_gone)

    def start(self) -> None:
        """Let the one clock of all sessions tick."""
        self._clock.start()

    def _run(self) -> None:
        PROMPT_THREADS.enrol()
        while not self._stopped.wait(TICK_S):
            try:
                self.beat(time.monotonic())
            except Exception as error:
                _LOG.error("the clock of the sessions stumbled: %s", error_places(error))

    def beat(self, now: float) -> None:
        """One tick: connected pages get their live sections, disconnected ones cost nothing."""
        PROMPT_THREADS.rest()
        look = now >= self._look_at
        if look:
            self._look_at = now + LOOK_S
            self._look()
        jobs = self._jobs_changed(now)
        with self._lock:
            entries = list(self._entries.items())
        for client, entry in entries:
            if entry.session is None:
                continue
            if not entry.connected:
                self._wait_for(client, entry, now)
            elif look or jobs or entry.session.lively or entry.session.is_behind:
                entry.session.tick()

    def _jobs_changed(self, now: float) -> bool:
        """Whether jobs have changed since the pages were last updated."""
        version = self._services.jobs.version
        if version == self._jobs_version or now < self._jobs_at:
            return False
        self._jobs_at, self._jobs_version = now + JOBS_S, version
        return True

    def _look(self) -> None:
        """Let the store count changes by other processes; a failure is logged once."""
        try:
            self._services.store.look()
        except VfixError as error:
            if not self._unread:
                _LOG.warning("changes from elsewhere are not shown: %s", error_kind(error))
            self._unread = True
        else:
            self._unread = False

    def connect(self, client: str, wanted: dict[str, str]) -> ClientSession:
        """The session of a client, new or existing; a new one takes a while. Raises TabTaken or TooManyTabs."""
        with self._lock:
            if self._stopped.is_set():
                raise TooManyTabs
            entry = self._entries.get(client)
            if entry is not None and entry.connected:
                raise TabTaken
            if sum(known.connected for known in self._entries.values()) >= MAX_PAGES:
                raise TooManyTabs
            if entry is not None and entry.session is not None:
                entry.connected = True
                entry.session.come_back()
                return entry.session
            self._make_room()
            entry = self._entries[client] = _Entry(connected=True)  # no other connection takes the place meanwhile
        try:
            session = self._made(client)
        except BaseException:
            with self._lock:
                self._entries.pop(client, None)
            raise
        with self._lock:
            entry.session = session
            ended = self._entries.get(client) is not entry
        session.start(wanted)
        session.scene_changed()  # read now: a scene that connected while the session was made was not reported to it
        if ended:
            session.close()
        return session

    def _made(self, client: str) -> ClientSession:
        from app.session.client_session import ClientSession  # imported here: slow to load, with all of the scene

        def scene() -> viser.ClientHandle | None:
            return self._scene_server.client_for(client)

        return ClientSession(client, self._services, self._made_shared(), self._executor, self._warming, scene)

    def shared(self, tab: str) -> Any:
        """What the clients of a tab share, for the tab's own addresses; slow the first time."""
        return self._made_shared()[tab]

    def _made_shared(self) -> dict[str, Closable | None]:
        from app.session.client_session import make_shared  # imported here, as above

        with self._sharing:
            if not self._shared:
                self._shared = make_shared(self._services)
            return self._shared

    def disconnect(self, client: str) -> None:
        """The page is gone: release the hand at once, the handle after a while (HAZ-11), the robot much later."""
        with self._lock:
            entry = self._entries.get(client)
            if entry is None or entry.session is None:
                return
            entry.connected, entry.seen_at, entry.given_up = False, time.monotonic(), 0
        entry.session.page_gone()

    def _wait_for(self, client: str, entry: _Entry, now: float) -> None:
        """Release step by step what a disconnected page held; each time it is checked whether it is connected again."""
        with self._lock:  # checked and marked atomically: a page that reconnects in between would keep the mark
            seen_at, given_up, session = entry.seen_at, entry.given_up, entry.session
            known = self._entries.get(client) is entry and not entry.connected
            if session is None or not known or now - seen_at < (LEASE_GRACE_S, ABANDONED_S, ENDED_S)[given_up]:
                return
            if given_up == 2:
                del self._entries[client]
            else:
                entry.given_up += 1

        def still_away() -> bool:
            with self._lock:
                return not entry.connected and entry.seen_at == seen_at

        if given_up == 0:
            session.give_up(still_away)
        elif given_up == 1:
            session.abandon(still_away)
        else:
            session.close()

    def _make_room(self) -> None:
        while len(self._entries) >= MAX_SESSIONS:
            idle = [client for client, entry in self._entries.items() if not entry.connected]
            oldest = min(idle, key=lambda client: self._entries[client].seen_at)
            if (session := self._entries.pop(oldest).session) is not None:
                session.close()

    def _session(self, client: str) -> ClientSession | None:
        with self._lock:
            entry = self._entries.get(client)
            return None if entry is None else entry.session

    def _scene_connected(self, client: str, scene: viser.ClientHandle) -> None:
        self._scene_gone(client)  # the session reads itself which one is there

    def _scene_gone(self, client: str) -> None:
        session = self._session(client)
        if session is not None:
            session.scene_changed()

    def close(self) -> None:
        """End every session and every control process, and wait for their work on the store, up to a limit."""
        self._stopped.set()
        if self._clock.is_alive():
            self._clock.join()
        with self._lock:
            entries = list(self._entries.values())
            self._entries.clear()
        until = time.monotonic() + CLOSE_S
        sessions = [entry.session for entry in entries if entry.session is not None]
        for session in sessions:
            session.close()
        going_on = sum(not session.join(max(0.0, until - time.monotonic())) for session in sessions)
        for shared in self._shared.values():
            if shared is not None:
                shared.close()
        going_on += not self._end_work(max(0.0, until - time.monotonic()))
        if going_on:
            _LOG.warning("%d parts of the page's sessions still work while the planner ends", going_on)

    def _end_work(self, seconds: float) -> bool:
        """Begin no more work in the background, and wait for running work; False where it is still running."""
        ending = threading.Thread(target=self._executor.shutdown, kwargs={"cancel_futures": True}, daemon=True)
        ending.start()
        ending.join(seconds)
        return not ending.is_alive()
