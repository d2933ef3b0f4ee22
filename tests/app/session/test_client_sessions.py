"""Sessions of clients: what a lost line ends, and what one client costs the others."""

from __future__ import annotations

import sqlite3
import threading
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from session_doubles import CLIENT, HEAD, SAMPLE, Robot, Tabs, fail, other_case, put_in_place, rehearse_tab, settle

from app.cases.service import CaseService
from app.kit.prompt_threads import PROMPT_THREADS
from app.plans.operations.points import DeletePoint
from app.scene.plan import PlanItem
from app.services import Services
from app.session import client_sessions
from app.session.client_session import ClientSession
from app.session.client_sessions import ClientSessions, TooManyTabs
from app.session.commands import SetTab
from app.store import Store
from app.store.errors import StorageError
from app.tabs.rehearse.commands import HoldCommand
from app.workspace.layers import Layer
from app.workspace.plan_items import plan_items


def _items(session: ClientSession) -> tuple[PlanItem, ...]:
    key: Any = {layer.name: layer for layer in session._display.layers()}["plan.items"].key
    return tuple(key[0])


def test_a_window_is_refused_where_no_scene_could_be_had(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would wait for its scene for ever; one that closes makes drive for it."""
    monkeypatch.setattr(client_sessions, "MAX_PAGES", 1)
    sessions = ClientSessions(phantom_services, Tabs(), lambda: "")
    try:
        sessions.connect("tab-one-0", {})
        with pytest.raises(TooManyTabs):
            sessions.connect("tab-two-0", {})
        sessions.disconnect("tab-one-0")
        sessions.connect("tab-two-0", {})
        with pytest.raises(TooManyTabs):
            sessions.connect("tab-one-0", {})
    finally:
        sessions.close()


def test_a_lost_connection_frees_the_handle_and_keeps_the_rehearsal(sessions: ClientSessions) -> None:
    """HAZ-11: after the grace the handle is free; the robot goes home, and the session ends, after longer."""
    session = sessions.connect("tab-one-0", {"plan": SAMPLE})

    def pass_by(seconds: float) -> None:
        for _ in range(3):
            sessions.beat(time.monotonic() + seconds)
        settle(session)

    settle(session)
    drive = rehearse_tab(session).drive
    assert drive is not None
    drive.lease.take(CLIENT)
    sessions.disconnect("tab-one-0")
    sessions.connect("tab-one-0", {})
    pass_by(client_sessions.LEASE_GRACE_S)
    assert drive.lease.held_by(CLIENT), "it came back in time"
    sessions.disconnect("tab-one-0")
    pass_by(0.5 * client_sessions.LEASE_GRACE_S)
    assert drive.lease.held_by(CLIENT), "it may still come back"
    pass_by(client_sessions.LEASE_GRACE_S)
    assert drive.lease.holder is None
    assert drive.watchers == {"tab-one-0"}
    pass_by(client_sessions.ABANDONED_S)
    assert drive.watchers == set()
    assert sessions.connect("tab-one-0", {}) is session
    settle(session)
    assert session._thread in PROMPT_THREADS.threads
    drive = rehearse_tab(session).drive
    assert drive is not None
    assert drive.watchers == {"tab-one-0"}
    sessions.disconnect("tab-one-0")
    sessions.beat(time.monotonic() + client_sessions.ENDED_S)  # the handle first,
    sessions.beat(time.monotonic() + client_sessions.ENDED_S)  # then the rehearsal,
    sessions.beat(time.monotonic() + client_sessions.ENDED_S)  # then all of it
    session._thread.join(60)
    assert not session._thread.is_alive()
    assert session._thread not in PROMPT_THREADS.threads
    assert drive.watchers == set()
    assert sessions.connect("tab-one-0", {}) is not session


@pytest.mark.parametrize("given_up", range(3))
def test_a_page_that_comes_back_in_the_very_tick_is_waited_for_anew(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch, given_up: int
) -> None:
    """HAZ-11, HAZ-12: the clock finds it absent, it connects, and only then something would be given up."""
    session, wait_for = sessions.connect("tab-one-0", {"plan": SAMPLE}), sessions._wait_for
    settle(session)
    sessions.disconnect("tab-one-0")
    late = time.monotonic() + client_sessions.ENDED_S
    for _ in range(given_up):
        sessions.beat(late)
    settle(session)

    def comes_back(*values: Any) -> None:
        assert sessions.connect("tab-one-0", {}) is session
        wait_for(*values)

    monkeypatch.setattr(sessions, "_wait_for", comes_back)
    sessions.beat(late)
    monkeypatch.undo()
    settle(session)
    drive = rehearse_tab(session).drive
    assert drive is not None
    assert drive.watchers == {"tab-one-0"}
    drive.lease.take(CLIENT)
    sessions.disconnect("tab-one-0")
    sessions.beat(time.monotonic() + client_sessions.LEASE_GRACE_S)
    settle(session)
    assert drive.lease.holder is None


def test_a_store_that_cannot_be_asked_is_logged_once_and_asked_again(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    settle(sessions.connect("tab-one-0", {"plan": SAMPLE}))
    store, now = sessions._services.store, time.monotonic()
    sessions.beat(now)
    with monkeypatch.context() as broken:
        broken.setattr(store, "_look", lambda connection: fail(sqlite3.OperationalError("disk I/O error")))
        with pytest.raises(StorageError):
            store.look()
        for n in range(1, 4):
            sessions.beat(now + n * client_sessions.LOOK_S)
    sessions.beat(now + 4 * client_sessions.LOOK_S)
    logged = [record.levelname for record in caplog.records if record.name == client_sessions.__name__]
    assert logged == ["WARNING"]


def test_a_page_that_is_away_costs_nothing(sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch) -> None:
    """One clock for all: no tick and no look at the store for a closed tab; it catches up when it is back."""
    ticks: list[str] = []
    tick = ClientSession.tick

    def counted(self: ClientSession) -> None:
        ticks.append(self.client)
        tick(self)

    monkeypatch.setattr(ClientSession, "tick", counted)
    here, away = (sessions.connect(tab, {"plan": SAMPLE}) for tab in ("tab-here-0", "tab-away-0"))
    for _ in range(2):  # what is published follows each request
        settle(away)
    services = sessions._services
    sessions.disconnect("tab-away-0")
    now = time.monotonic()
    plan = services.plans.create(HEAD, "Made elsewhere")
    for n in range(100):
        sessions.beat(now + 0.05 * n)
        settle(here)
        settle(here)
    assert set(ticks) == {"tab-here-0"}
    assert len(ticks) < 10, "nothing moves there either: a look now and then is enough"

    def names(session: ClientSession) -> set[str]:
        section = session.view_model.read("plans")
        return set() if section is None else {item["name"] for item in section["items"]}

    assert "Made elsewhere" in names(here)
    services.plans.documents.rename(plan.id, "Renamed elsewhere")
    services.plans.documents.delete(plan.id)
    assert "Renamed elsewhere" not in names(away)
    sessions.connect("tab-away-0", {})
    settle(away)
    settle(away)
    assert "Renamed elsewhere" in names(away)


def test_slow_heads_keep_no_other_tab_waiting(sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reading a head takes minutes for three tabs; a fourth opens its own meanwhile."""
    cases, done = sessions._services.cases, threading.Event()
    slow, read = other_case(sessions._services), cases.display_meshes

    def display_meshes(case_id: str) -> Any:
        if case_id == slow.id:
            done.wait(60)
        return read(case_id)

    monkeypatch.setattr(cases, "display_meshes", display_meshes)
    try:
        for n in range(3):
            sessions.connect(f"tab-slow-{n}", {"case": slow.id})
        quick = sessions.connect("tab-quick-0", {"case": HEAD})
        deadline = time.monotonic() + 60
        while quick.workspace.case.surface is None and time.monotonic() < deadline:
            time.sleep(0.02)
        assert quick.workspace.case.surface is not None
    finally:
        done.set()
        cases.delete(slow.id)


def test_the_scene_shows_what_is_driven_while_it_is_driven(sessions: ClientSessions) -> None:
    """In Rehearse the robot's own curve and targets, in Plan the plan's."""
    services = sessions._services
    plan = services.plans.documents.duplicate(SAMPLE)
    session = sessions.connect("tab-one-0", {"case": HEAD, "plan": plan.id})
    settle(session)
    rehearse = rehearse_tab(session)
    drive, robot = rehearse.drive, Robot()
    assert drive is not None
    put_in_place(drive, robot, plan)
    services.plans.do(plan.id, DeletePoint(point_id=plan.content.points[-1].id))
    session.come_back()
    settle(session)
    settle(session)
    drawn = _items(session)
    assert len(drawn) == len(plan.content.points) + len(plan.content.targets) - 1
    session.active.active, rehearse.active, session.active = False, True, rehearse
    session._display.touch_all()
    assert _items(session) == tuple(plan_items(plan))
    shown = SimpleNamespace(show=lambda places, clearance: drawn_curve.append((places, clearance)))
    drawn_curve: list[Any] = []
    {layer.name: layer for layer in session._display.layers()}["plan.curve"].show(shown)
    ((places, clearance),) = drawn_curve
    assert clearance is None
    assert np.allclose(places[-1], plan.content.points[-1].position)
    services.plans.documents.delete(plan.id)


def test_between_requests_only_the_layers_of_the_active_step_are_drawn(sessions: ClientSessions) -> None:
    """Until it has other ones than before: then what another step shows under their names comes back."""
    session = sessions.connect("tab-one-0", {"case": HEAD, "plan": SAMPLE})
    settle(session)
    drawn: list[tuple[str, list[str]]] = []
    robot = Layer[Any]("rehearse.drive", 0, lambda view: None, lambda nodes: None)
    own, rehearse = [robot], rehearse_tab(session)
    stack = SimpleNamespace(
        draw=lambda layers: drawn.append(("draw", [layer.name for layer in layers])),
        update=lambda layers: drawn.append(("update", [layer.name for layer in layers])),
    )

    def tick() -> None:
        session._display._drawn_at = 0.0
        session._tick()

    def watch() -> None:
        session.active.active, rehearse.active, session.active = False, True, rehearse
        rehearse.layers = lambda: own  # type: ignore[method-assign]
        session._display.scene = stack  # type: ignore[assignment]
        tick()
        tick()
        own.clear()
        tick()

    session.post(watch)
    settle(session)
    everything, moving, without = drawn[:3]
    assert everything[0] == without[0] == "draw"
    assert moving == ("update", ["rehearse.drive"])
    assert set(everything[1]) - set(without[1]) == {"rehearse.drive"}
    assert "plan.items" in without[1]


def test_a_client_that_comes_back_with_less_gives_up_its_handle(sessions: ClientSessions) -> None:
    session = sessions.connect("tab-one-0", {"plan": SAMPLE})
    session.greet("holds")
    settle(session)
    drive = rehearse_tab(session).drive
    assert drive is not None
    session.command(HoldCommand(type="rehearsal.take"))
    assert drive.lease.holder == CLIENT
    session.greet("watches")
    settle(session)
    assert drive.lease.holder is None
    session.command(HoldCommand(type="rehearsal.take"))
    assert drive.lease.holder is None


@pytest.mark.parametrize("tab", ["patient", "rehearse"])
def test_a_head_that_another_process_deletes_is_told(
    sessions: ClientSessions, phantom_services: Services, tab: str
) -> None:
    """As `vfix case delete` does, on the tab of a robot that stands still too."""
    case = other_case(phantom_services)
    session = sessions.connect("tab-one-0", {"case": case.id})

    def hint() -> str:
        phantom_services.store.look()  # as is done with every tick of all sessions
        session.tick()
        settle(session)
        settle(session)
        return str(session.view_model.read("step")["hint"])

    session.command(SetTab(type="step.set", name=tab))
    assert "deleted" not in hint()
    elsewhere = Store(phantom_services.settings)
    CaseService(elsewhere).delete(case.id)
    elsewhere.close()
    assert "was deleted elsewhere" in hint()
