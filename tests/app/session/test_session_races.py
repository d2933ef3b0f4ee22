"""What comes while something else is going on: scenes, errors, replies and the end of a session."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from session_doubles import SAMPLE, Tabs, fail, rehearse_tab, settle

from app.kit.errors import JobCancelled
from app.messages.sections import Section
from app.services import Services
from app.session import client_sessions
from app.session.client_session import ClientSession
from app.session.client_sessions import ClientSessions, TabTaken, TooManyTabs
from app.tabs.rehearse.commands import HoldCommand, SetMode
from app.workspace.commands import SetCross
from vfix_engine.errors import PlanError


def test_a_scene_that_comes_while_its_session_is_made_is_attached_once(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twice, one click would show and confirm: whatever the order, the session follows the scene that is there."""
    tabs, attached, tab = Tabs(), list[Any](), "tab-one-0"
    sessions = ClientSessions(phantom_services, tabs, lambda: "")
    monkeypatch.setattr(ClientSession, "_attach", lambda self, client: attached.append(client))
    begun, go_on, start = threading.Event(), threading.Event(), ClientSession.start

    def start_late(self: ClientSession, wanted: Any) -> None:
        start(self, wanted)
        begun.set()
        assert go_on.wait(60)

    monkeypatch.setattr(ClientSession, "start", start_late)
    try:
        with ThreadPoolExecutor(1) as beside:
            connecting = beside.submit(sessions.connect, tab, {"plan": SAMPLE})
            assert begun.wait(60)
            tabs.scenes[tab] = first = object()  # it comes now, and is told before and after it is asked for
            tabs.come(tab, first)
            go_on.set()
            session = connecting.result(60)
        settle(session)
        assert attached == [first]
        released = list[str]()
        monkeypatch.setattr(session.tabs["rehearse"], "release_now", lambda: released.append("hand"))
        tabs.scenes[tab] = second = object()  # a scene that was loaded anew; that the first one went comes late
        tabs.come(tab, second)
        tabs.gone(tab)
        settle(session)
        assert attached == [first, second]
        assert released == ["hand"]
        del tabs.scenes[tab]
        tabs.gone(tab)
        tabs.come(tab, second)  # late news of a scene that is gone again
        settle(session)
        assert attached == [first, second]
        assert released == ["hand", "hand"]
    finally:
        go_on.set()
        sessions.close()


def test_a_session_that_is_made_keeps_no_other_one_waiting(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, begun, go_on = ClientSession.__init__, threading.Event(), threading.Event()

    def slowly(self: ClientSession, client: str, *values: Any) -> None:
        if client == "tab-slow-0":
            begun.set()
            assert go_on.wait(60)
        made(self, client, *values)

    monkeypatch.setattr(ClientSession, "__init__", slowly)
    with ThreadPoolExecutor(1) as beside:
        slow = beside.submit(sessions.connect, "tab-slow-0", {"plan": SAMPLE})
        assert begun.wait(60)
        try:
            quick = sessions.connect("tab-quick-0", {"plan": SAMPLE})
            sessions.beat(time.monotonic())
            sessions.disconnect("tab-quick-0")
            with pytest.raises(TabTaken):
                sessions.connect("tab-slow-0", {})
        finally:
            go_on.set()
        assert slow.result(60) is not quick


def test_a_session_that_cannot_be_made_leaves_its_place_free(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr(ClientSession, "__init__", lambda *_: fail(MemoryError()))
        with pytest.raises(MemoryError):
            sessions.connect("tab-one-0", {})
    sessions.connect("tab-one-0", {"plan": SAMPLE})


def test_an_error_in_one_step_leaves_the_others_shown_and_is_tried_again(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what was stored elsewhere each tab is read anew, whichever cannot be read just now."""
    session, notes = sessions.connect("tab-one-0", {"plan": SAMPLE}), list[str]()
    settle(session)
    session.note = lambda words, error: notes.append(words)
    names, read = list(session.tabs), list[str]()
    for name in names:
        monkeypatch.setattr(session.tabs[name], "refresh", lambda name=name: read.append(name))
    first = session._display._active_last()[0].tab
    with monkeypatch.context() as broken:
        broken.setattr(first, "refresh", lambda: fail(RuntimeError("of Doe, John")))
        settle(session)
        settle(session)  # what is published follows each request
        assert {*read} == {*names} - {first.spec.name}
        assert set(notes) == {"That did not work; the planner's log says why."}
    read.clear()
    settle(session)
    settle(session)
    assert first.spec.name in read, "what could not be read is tried again"
    notes.clear()
    with monkeypatch.context() as broken:
        name, before = next((name, session.view_model.read(name)) for name in first.sections())
        unbuilt = Section(object(), lambda: fail(RuntimeError("of Doe, John")))
        broken.setattr(first, "sections", lambda: {name: unbuilt, "marker": Section.of({"n": 1})})
        settle(session)
        settle(session)
    assert session.view_model.read("marker") == {"n": 1}, "a section that cannot be built keeps no other one back"
    assert session.view_model.read(name) is before is not None, "and stays as it was"
    assert set(notes) == {"That did not work; the planner's log says why."}


def test_an_error_in_one_step_keeps_no_other_one_from_letting_go(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-11."""
    session, let_go = sessions.connect("tab-one-0", {"plan": SAMPLE}), list[str]()
    settle(session)
    for name, tab in session.tabs.items():
        for act in ("release_now", "release"):
            monkeypatch.setattr(tab, act, lambda name=name, act=act: let_go.append(f"{name} {act}") or fail(OSError()))
    sessions.disconnect("tab-one-0")
    settle(session)
    assert sorted(let_go) == sorted(f"{name} {act}" for name in session.tabs for act in ("release_now", "release"))


@pytest.mark.parametrize("broken", ["handle", "publish", "urgent", "refused", "nothing"])
def test_every_command_that_asks_for_a_reply_gets_one(
    sessions: ClientSessions, monkeypatch: pytest.MonkeyPatch, broken: str
) -> None:
    session, replies = sessions.connect("tab-one-0", {"plan": SAMPLE}), list[tuple[bool, Any]]()
    settle(session)
    tab = rehearse_tab(session)
    monkeypatch.setattr(tab, "handle", lambda command: None)
    if broken == "publish":
        monkeypatch.setattr(session._display, "publish", lambda: fail(RuntimeError("of Doe, John")))
    elif broken != "nothing":
        error = PlanError("open a plan first.") if broken == "refused" else RuntimeError("of Doe, John")
        monkeypatch.setattr(tab, "handle_now" if broken == "urgent" else "handle", lambda command: fail(error))
    command = HoldCommand(type="heartbeat", id=1) if broken == "urgent" else SetMode(type="rehearsal.mode", mode="free")
    assert session.command(command, lambda ok, result: replies.append((ok, result)))
    settle(session)
    failed = "That did not work; the planner's log says why."
    expected = {"refused": (False, "open a plan first."), "handle": (False, failed), "urgent": (False, failed)}
    assert replies == [expected.get(broken, (True, None))]


def test_a_newer_value_of_a_stream_does_not_answer_for_one_that_asks_for_a_reply(sessions: ClientSessions) -> None:
    session, replies, go_on = sessions.connect("tab-one-0", {"plan": SAMPLE}), list[int](), threading.Event()
    settle(session)
    session.post(lambda: go_on.wait(60))
    streamed = SetCross(type="slice.cross", position=(1.0, 2.0, 3.0))
    assert streamed.stream() is not None
    for number in range(3):
        session.command(streamed, lambda ok, result, number=number: replies.append(number))
        session.command(streamed)
    go_on.set()
    settle(session)
    assert replies == [0, 1, 2]


def test_the_end_waits_for_what_sessions_do_with_the_store(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_sessions, "CLOSE_S", 60.0)
    monkeypatch.setattr(phantom_services.dry_runs, "evaluate", lambda *_, **__: fail(JobCancelled()))
    sessions, done = ClientSessions(phantom_services, Tabs(), lambda: ""), list[str]()
    session, begun, go_on = sessions.connect("tab-one-0", {"plan": SAMPLE}), threading.Barrier(3), threading.Event()
    settle(session)

    def work(what: str) -> None:
        begun.wait(60)
        go_on.wait(60)
        done.append(what)

    session.post(lambda: work("request"))
    sessions._executor.submit(work, "background")
    begun.wait(60)  # what has not begun is cancelled at the end
    with ThreadPoolExecutor(1) as beside:
        closing = beside.submit(sessions.close)
        while not session._inbox._queue.qsize():  # until it was told to end, which comes behind the request
            time.sleep(0.001)
        assert not closing.done()
        go_on.set()
        closing.result(60)
    assert sorted(done) == ["background", "request"]
    assert not session._thread.is_alive()
    with pytest.raises(TooManyTabs):
        sessions.connect("tab-two-0", {})
