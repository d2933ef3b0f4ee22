"""The page's WebSocket: refusals with a reason and the time after which to retry (HAZ-05, HAZ-31)."""

import contextlib
import json
import logging
import sys
import threading
from collections.abc import Iterator
from unittest.mock import MagicMock

import pytest
from knocking import Planner, eventually
from websockets.exceptions import ConnectionClosed
from websockets.frames import Close
from websockets.sync.client import ClientConnection, connect

from app.kit.prompt_threads import PROMPT_THREADS
from app.messages.sections import Section
from app.messages.version import VERSION
from app.session import client_session
from app.session.client_sessions import MAX_PAGES
from app.session.router import MAX_MESSAGE_CHARS, MAX_PER_SECOND
from app.session.view_model import ViewModel

HELLO = {"type": "hello", "version": VERSION, "role": "holds"}
HEARTBEAT = '{"type":"heartbeat"}'


@pytest.fixture
def pages(whole_planner: Planner, monkeypatch: pytest.MonkeyPatch) -> Iterator[Planner]:
    """Workspaces that draw nothing and take every command."""
    monkeypatch.setattr(client_session, "ClientSession", lambda *_: MagicMock(view_model=ViewModel()))
    yield whole_planner
    hub = whole_planner.app.state.sessions
    eventually(lambda: not any(entry.connected for entry in hub._entries.values()))
    hub._entries.clear()


def page(planner: Planner, tab: str, greeting: object = HELLO) -> ClientConnection:
    headers = [planner.cookie]
    address = f"ws://{planner.host}/session?tab={tab}"
    made = connect(address, additional_headers=headers, origin=planner.origin, proxy=None)
    with contextlib.suppress(ConnectionClosed):  # refused before it could speak
        made.send(json.dumps(greeting))
    return made


def closing(connection: ClientConnection) -> Close:
    """How the planner ends a connection; fails when it does not."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            connection.recv(timeout=60)
    assert connection.close_code is not None
    return Close(connection.close_code, connection.close_reason or "")


def answers(connection: ClientConnection) -> bool:
    connection.send('{"type":"no such command"}')
    while (message := json.loads(connection.recv(timeout=60)))["type"] == "hello":
        pass
    return bool(message["type"] == "note")


@pytest.mark.parametrize(
    ("messages", "code", "words"),
    [
        ([b"\x00\x01"], 1003, "text"),
        ([HEARTBEAT.encode()], 1003, "text"),
        ([HEARTBEAT] * (10 * MAX_PER_SECOND), 4429, "try again in 10 s"),  # wherever a second begins
        (["x" * (MAX_MESSAGE_CHARS + 1)], 4429, "try again in 10 s"),
    ],
    ids=["binary", "a command as bytes", "too many", "too long"],
)
def test_what_is_no_command_ends_the_connection_with_a_reason(
    pages: Planner, caplog: pytest.LogCaptureFixture, messages: list[str | bytes], code: int, words: str
) -> None:
    with page(pages, "refused-tab") as refused, page(pages, "honest-tab") as honest:
        with contextlib.suppress(ConnectionClosed):
            for message in messages:
                refused.send(message)
        ended = closing(refused)
        assert (ended.code, words in ended.reason) == (code, True)
        assert answers(honest)
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_the_threads_that_hear_a_hand_are_prompt_while_it_drives(
    pages: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-11: that of the page's socket, that of the scene's, and the clock that ends it."""
    heard: list[threading.Thread] = []
    hear = MagicMock(side_effect=lambda *_: heard.append(threading.current_thread()) or True)
    monkeypatch.setattr(client_session, "ClientSession", lambda *_: MagicMock(view_model=ViewModel(), command=hear))
    with page(pages, "driving-tab") as driving:
        driving.send(HEARTBEAT)
        eventually(lambda: len(heard) == 1)
    pages.scene_server.viser.get_event_loop().call_soon_threadsafe(lambda: heard.append(threading.current_thread()))
    eventually(lambda: len(heard) == 2)
    assert {*heard, pages.app.state.sessions._clock} <= PROMPT_THREADS.threads


def test_a_page_too_many_is_told_so_and_let_in_when_another_goes(pages: Planner) -> None:
    with contextlib.ExitStack() as opened:
        first = opened.enter_context(page(pages, "page-number-0"))
        for number in range(1, MAX_PAGES):
            opened.enter_context(page(pages, f"page-number-{number}"))
        with page(pages, "page-too-many") as refused:
            ended = closing(refused)
        assert (ended.code, ended.reason) == (
            4503,
            f"{MAX_PAGES} pages of this planner are open; close one, or try again in 15 s",
        )
        first.close()
        with page(pages, "page-too-many") as let_in:
            assert answers(let_in)


@pytest.mark.parametrize(("tab", "code"), [("short", 1008), ("twice-opened", 4409)])
def test_a_tab_has_a_name_of_its_own(pages: Planner, tab: str, code: int) -> None:
    with page(pages, "twice-opened"), page(pages, tab) as refused:
        ended = closing(refused)
    assert ended.code == code
    assert "tab" in ended.reason


@pytest.mark.parametrize(
    ("greeting", "words"),
    [
        ({"type": "hello", "version": VERSION + 1, "role": "holds", "later": 1}, "reload the page"),
        ({"type": "hello"}, "say hello first"),
        ({"type": "heartbeat"}, "say hello first"),
        ("hello", "say hello first"),
        ({"type": "hello", "version": VERSION, "role": "owns"}, "hello: role"),
        ({"type": "hello", "version": True}, "reload the page"),
    ],
    ids=["another version", "no version", "a command", "no object", "no such role", "no number"],
)
def test_a_client_of_another_version_is_told_to_reload(pages: Planner, greeting: object, words: str) -> None:
    """The planner says its version first; what is not understood is never guessed at."""
    with page(pages, "page-of-old", greeting) as refused:
        hello = json.loads(refused.recv(timeout=60))
        assert (hello["type"], hello["version"]) == ("hello", VERSION)
        assert hello["steps"][0]["panel"] == "/tabs/patient/panel.js"
        ended = closing(refused)
        assert (ended.code, words in ended.reason) == (4426, True)


def test_who_says_no_hello_is_shown_nothing_and_holds_no_place(pages: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-31: sixteen silent connections would keep every page out."""
    monkeypatch.setattr(sys.modules["app.session.router"], "HELLO_S", 0.3)
    address = f"ws://{pages.host}/session?tab=silent-tab"
    with connect(address, additional_headers=[pages.cookie], origin=pages.origin, proxy=None) as silent:
        eventually(lambda: "silent-tab" in pages.app.state.sessions._entries)
        pages.app.state.sessions._entries["silent-tab"].session.view_model.publish("secret", Section.of(1))
        assert json.loads(silent.recv(timeout=60))["type"] == "hello"
        with pytest.raises(ConnectionClosed):
            silent.recv(timeout=60)  # no section
        assert (silent.close_code, "no hello came" in (silent.close_reason or "")) == (4408, True)
    eventually(lambda: not pages.app.state.sessions._entries["silent-tab"].connected)
