"""One client's session: its views and tabs, and a thread of its own that answers its requests in order."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from typing import Any, Literal

import viser

from app.kit.prompt_threads import PROMPT_THREADS
from app.messages.client import Client, ClientRole
from app.messages.fields import ClientMessage
from app.operations.messages import OperationMessage
from app.scene.dragging import DragEvent
from app.scene.view import SceneEvents, SceneView
from app.services import Services
from app.session.commands import SetTab
from app.session.display import Display
from app.session.inbox import Inbox
from app.tabs.base import Closable, Tab
from app.tabs.registry import load, specs
from app.workspace.workspace import Workspace
from vfix_engine.error_places import error_places
from vfix_engine.errors import ControlError, InputError, VfixError

Reply = Callable[[bool, Any], None]
Note = Callable[[str, bool], None]
FIRST_TAB = "plan"  # where a client begins that has a case open
_LOG = logging.getLogger(__name__)


def make_shared(services: Services) -> dict[str, Closable | None]:
    """What the clients of each tab share, by the tab's name."""
    return {spec.name: load(spec).make_shared(services) for spec in specs()}


class ClientSession:
    """State of one client on the server; it outlives a lost connection."""

    def __init__(
        self,
        client: str,
        services: Services,
        shared: Mapping[str, Closable | None],
        executor: Executor,
        warming: Callable[[], str],
        scene: Callable[[], viser.ClientHandle | None] = lambda: None,
    ) -> None:
        """shared: of :func:`make_shared`. warming: words for what the planner still gets ready, empty once it is.

        scene: the client's scene as it is now; None while there is none.
        """
        self.client, self._services = client, services
        self._scene = scene
        self._attached: viser.ClientHandle | None = None
        self.note: Note = lambda words, error: None
        self._inbox = Inbox()
        self.workspace = Workspace(
            Client(client), services, executor, self.post, lambda words, error: self.note(words, error)
        )
        self.tabs: dict[str, Tab] = {}
        self._tabs_of: dict[type, list[Tab]] = {}  # those of a drive belong to every tab that drives
        self._tab_of_kind: dict[str, Tab] = {}
        for spec in specs():
            tab = self.tabs[spec.name] = load(spec)(self.workspace, shared[spec.name])
            self._tab_of_kind |= dict.fromkeys(spec.documents, tab)
            for kind in spec.commands:
                self._tabs_of.setdefault(kind, []).append(tab)
        self.active = self.tabs.get(FIRST_TAB) or next(iter(self.tabs.values()))
        self.active.active = True
        self._display = Display(services, self.workspace, self.tabs.values(), warming, self._guarded)
        self.view_model = self._display.model
        self.workspace.camera.places = lambda: [place for tab in self.tabs.values() for place in tab.places()]
        self.workspace.on_case_opened(lambda plan_id: self._case_opened())
        self._thread = threading.Thread(target=self._run, name=f"session-{client[:6]}", daemon=True)

    # -- from other threads: queue only, but for what a hand does

    def post(self, request: Callable[[], Any]) -> None:
        """Queue work of the planner itself, such as an answer from the background; it may be about any tab."""

        def about_any() -> None:
            self._display.touch_all()
            request()

        self._inbox.put(about_any)

    def start(self, wanted: Mapping[str, str]) -> None:
        """Begin work; ``wanted`` names the case, plan and tab to open, where the client remembers them."""
        self.post(lambda: self._open_first(wanted))
        self._thread.start()

    def close(self) -> None:
        """The thread ends after what waits already, and the tabs with it."""
        self._inbox.close()

    def join(self, seconds: float) -> bool:
        """Wait after :meth:`close`; whether it has ended within so many seconds."""
        if self._thread.ident is not None:
            self._thread.join(seconds)
        return not self._thread.is_alive()

    def tick(self) -> None:
        """The planner's clock: what changes by itself is looked at, and the store where others have changed it."""
        self._inbox.put(self._tick, "tick")

    @property
    def is_behind(self) -> bool:
        """Something was stored since everything was published."""
        return self._display.is_behind

    @property
    def lively(self) -> bool:
        """Something that is shown changes by itself."""
        return any(tab.lively for tab in self.tabs.values())

    def page_gone(self) -> None:
        """The client is not there any more: whatever its hand held is let go of."""
        for tab in self.tabs.values():
            self._guarded(tab.release_now)
        self.post(lambda: self._each("release"))

    def give_up(self, still_away: Callable[[], bool]) -> None:
        """The client has been away for seconds: what only one can have is free."""
        self.post(lambda: self._each("give_up") if still_away() else None)

    def abandon(self, still_away: Callable[[], bool]) -> None:
        """The client has been away for minutes: what nobody else uses is ended."""
        self.post(lambda: self._each("abandon") if still_away() else None)

    def come_back(self) -> None:
        self.post(lambda: self._each("come_back"))

    def greet(self, role: ClientRole) -> None:
        """The client has said what it is; one that was more before gives up what it held."""
        before, self.workspace.client = self.workspace.client, Client(self.client, role)
        if before.may_hold and not self.workspace.client.may_hold:
            self.post(lambda: self._each("give_up"))

    def command(self, command: ClientMessage | OperationMessage, reply: Reply | None = None) -> bool:
        """Answer a command; False when too many wait already. One with a reply gets it, whatever happens."""
        tab = self._tab_of(command) if isinstance(command, ClientMessage) else None
        if isinstance(command, ClientMessage) and command.urgent and tab is not None:
            self._answer_with(lambda: tab.handle_now(command), reply, quiet=True)
            return True
        slot = command.stream() if reply is None else None  # a newer one does not answer for it
        return self._inbox.offer(
            lambda: self._answer_with(lambda: self._do(command), reply, self._display.publish), slot
        )

    def _tab_of(self, command: ClientMessage) -> Tab | None:
        """The tab that answers a command: of several the active one, else the first; None for what all tabs share."""
        tabs = self._tabs_of.get(type(command), [])
        return self.active if self.active in tabs else next(iter(tabs), None)

    def scene_changed(self) -> None:
        """A scene has come or gone: which one is there is asked on the session's thread, so that none counts twice."""
        self.post(self._follow_scene)

    def _events(self) -> SceneEvents:
        return SceneEvents(
            clicked=lambda ray: self._inbox.offer(lambda: self._touched(self.active).clicked(ray)),
            item_dragged=lambda drag: self._inbox.offer(
                lambda: self._touched(self.active).dragged(drag), _drag_slot(drag)
            ),
            grip_dragged=lambda drag: self.active.gripped(drag),
            camera_moved=lambda lens: self._inbox.offer(lambda: self.workspace.camera.moved(lens), "camera"),
        )

    # -- on the session's own thread

    def _run(self) -> None:
        PROMPT_THREADS.enrol()
        while (request := self._inbox.get()) is not None:
            self._guarded(request)
            if request != self._tick:
                self._guarded(self._display.publish)
        for tab in self.tabs.values():
            self._guarded(tab.close)

    def _touched(self, tab: Tab) -> Tab:
        """A tab to which something happens: it is asked again what it shows."""
        self._display.touch(tab)
        return tab

    def _guarded(self, request: Callable[[], Any]) -> bool:
        """Whether it was done; the user is told why not."""
        try:
            request()
        except Exception as error:
            self.note(_words(error), True)
            return False
        return True

    def _each(self, name: Literal["release", "give_up", "abandon", "come_back"]) -> None:
        """Of every tab, whatever becomes of the others."""
        for tab in self.tabs.values():
            self._guarded(getattr(tab, name))

    def _tick(self) -> None:
        jobs = self._services.jobs.going_on()  # first: what an ended job has stored is not shown after its end
        changed = list[bool]()
        for tab in self.tabs.values():
            self._guarded(lambda tab=tab: changed.append(tab.tick()))  # type: ignore[misc]
        if any(changed):
            self._display.touch_all()
        if any(changed) or self.is_behind:
            self._display.publish()
        else:
            self._display.publish_ticking(jobs)

    def _open_first(self, wanted: Mapping[str, str]) -> None:
        self.workspace.open_first(wanted.get("case"), wanted.get("plan"))
        if not self.active.available:
            self._set_tab(self._available()[0])
        elif (tab := self.tabs.get(wanted.get("step", ""))) is not None and tab.offered:
            self._set_tab(tab.spec.name)

    def _case_opened(self) -> None:
        """It may be one that the active tab is not for."""
        self._display.touch_all()
        if not self.active.offered:
            self._set_tab(self._available()[0])

    def _available(self) -> list[str]:
        return [name for name, tab in self.tabs.items() if tab.available]

    def _answer_with(
        self,
        answer: Callable[[], Any],
        reply: Reply | None,
        show: Callable[[], None] = lambda: None,
        quiet: bool = False,
    ) -> None:
        """show: what came of it, before the reply. quiet: a refusal is told to whoever waits for a reply alone, since a
        hand without the handle would be told so sixty times a second.
        """
        try:
            result = answer()
        except Exception as error:
            if quiet and reply is None and isinstance(error, ControlError):
                return
            (self.note if reply is None else _refused(reply))(_words(error), True)
            return
        if reply is not None:
            self._guarded(show)
            reply(True, result)

    def _do(self, command: ClientMessage | OperationMessage) -> Any:
        if isinstance(command, OperationMessage):
            tab = self._tab_of_kind.get(command.spec.kind.name)
            return self.workspace.operate(command) if tab is None else self._touched(tab).operate(command)
        if isinstance(command, SetTab):
            return self._set_tab(command.name)
        tab = self._tab_of(command)
        return self.workspace.handle(command) if tab is None else self._touched(tab).handle(command)

    def _set_tab(self, name: str) -> None:
        tab = self.tabs[name]
        if tab is self.active:
            return
        if not tab.offered:
            raise InputError(f"‘{tab.spec.label}’ is not for this kind of case.")
        self._display.touch_all()
        self.active.leave()
        self.active.active, tab.active = False, True
        self.active = tab
        tab.enter()

    # -- the scene

    def _follow_scene(self) -> None:
        now = self._scene()
        if now is self._attached:
            return
        if self._attached is not None:
            self._detach()
        self._attached = now
        if now is not None:
            self._attach(now)

    def _attach(self, client: viser.ClientHandle) -> None:
        self._display.attach(SceneView(client, self._events()))

    def _detach(self) -> None:
        self._display.attach(None)
        for tab in self.tabs.values():
            self._guarded(tab.release_now)
            self._guarded(tab.release)


def _words(error: Exception) -> str:
    """For the user: what a VfixError says; anything else goes to the log."""
    if isinstance(error, VfixError):
        return str(error)
    _LOG.error("a request of a session failed: %s", error_places(error))
    return "That did not work; the planner's log says why."


def _refused(reply: Reply) -> Note:
    return lambda words, error: reply(not error, words)


def _drag_slot(drag: DragEvent) -> str | None:
    return f"drag.{drag.item_id}" if drag.phase == "update" else None
