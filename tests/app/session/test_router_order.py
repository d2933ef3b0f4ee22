"""What a page gets in which order: a reply never comes before the state of what it answers."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import threading
from types import SimpleNamespace
from typing import Any

import pytest

from app.messages.sections import Section
from app.session.commands import InvalidMessage, parse_command
from app.session.view_model import ViewModel

router = importlib.import_module("app.session.router")  # the package has an object of this name


def test_a_reply_follows_the_state_that_it_answers() -> None:
    """Also where both come while an earlier state is on its way: the page reads its state when it has the reply."""
    model, sent = ViewModel(), list[dict[str, Any]]()

    def publish(number: int) -> None:
        model.publish("plan", Section.of({"revision": number}))
        model.commit()

    async def write() -> None:
        outbox = router.ClientOutbox()

        async def send_text(text: str) -> None:
            sent.append(json.loads(text))
            if len(sent) == 1:
                publish(2)
                outbox.put({"type": "reply", "id": 7, "ok": True, "result": None})

        publish(1)
        outbox.changed.set()
        socket: Any = SimpleNamespace(send_text=send_text)
        session: Any = SimpleNamespace(view_model=model)
        writer = asyncio.create_task(router._write(socket, session, outbox))
        while len(sent) < 3:
            await asyncio.sleep(0.001)
        writer.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await writer

    asyncio.run(asyncio.wait_for(write(), 60.0))
    assert [message["type"] for message in sent] == ["state", "state", "reply"]
    assert [message["sections"]["plan"]["revision"] for message in sent[:2]] == [1, 2]


def test_replies_are_never_dropped_and_while_many_wait_no_command_is_read() -> None:
    """HAZ-31: the page sends 200 requests and reads nothing; then it reads, and every one has its reply."""
    sent, asked = list[Any](), list[int]()

    async def serve() -> None:
        reads, first = asyncio.Event(), asyncio.Event()
        incoming = [json.dumps({"type": "undo", "id": number}) for number in range(200)]

        async def receive() -> dict[str, Any]:
            if not incoming:
                await asyncio.Event().wait()
            return {"type": "websocket.receive", "text": incoming.pop(0)}

        async def send_text(text: str) -> None:
            first.set()
            await reads.wait()
            sent.append(json.loads(text))

        def command(command: Any, reply: Any) -> bool:
            asked.append(command.id)
            reply(True, None)
            return True

        outbox = router.ClientOutbox()
        socket: Any = SimpleNamespace(send_text=send_text, receive=receive)
        session: Any = SimpleNamespace(view_model=ViewModel(), command=command)
        for _ in range(3 * router.MAX_NOTES):
            outbox.put({"type": "note", "words": "…", "error": False})
        tasks = [
            asyncio.create_task(router._write(socket, session, outbox)),
            asyncio.create_task(router._read(socket, session, outbox, outbox.put)),
        ]
        await first.wait()
        for _ in range(1000):  # whatever can go on goes on
            await asyncio.sleep(0)
        assert asked == list(range(router.MAX_REPLIES)), "the rest waits in the socket: the hand's beats, too"
        reads.set()
        while len(sent) < 200 + router.MAX_NOTES:
            await asyncio.sleep(0.001)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(asyncio.wait_for(serve(), 60.0))
    assert [message["id"] for message in sent if message["type"] == "reply"] == list(range(200))


def test_a_client_that_goes_while_its_session_is_made_leaves_no_place_taken() -> None:
    """A session is made on another thread: the loop serves all other pages meanwhile."""
    made, connected = threading.Event(), list[str]()

    def connect(client: str, wanted: dict[str, str]) -> Any:
        assert made.wait(60)
        connected.append(client)
        return SimpleNamespace()

    async def come_and_go() -> None:
        left = asyncio.Event()

        def disconnect(client: str) -> None:
            connected.remove(client)
            left.set()

        sessions: Any = SimpleNamespace(connect=connect, disconnect=disconnect)
        coming = asyncio.create_task(router._connect(sessions, "tab-one-0", {}))
        await asyncio.sleep(0)
        coming.cancel()
        with pytest.raises(asyncio.CancelledError):
            await coming
        made.set()
        await left.wait()

    asyncio.run(asyncio.wait_for(come_and_go(), 60.0))
    assert connected == []


def test_what_is_no_command_is_answered_by_its_number() -> None:
    """Who waits for a reply would wait for ever; without a number it is a note."""
    assert router._number('{"type": "no such command", "id": 7}') == 7
    for field in ("NaN", "1e999", '3, "at_mm": 3'):  # no command has such a field, but this one has its id
        text = f'{{"type": "rehearsal.approach", "id": 8, "at_mm": {field}}}'
        with pytest.raises(InvalidMessage):
            parse_command(text)
        assert router._number(text) == 8
    for text in ("", "7", "[]", '{"id": true}', '{"id": "7"}', '{"type": "undo"}', "[" * 60_000):
        assert router._number(text) is None
    assert router._refusal(7, "No.") == {"type": "reply", "id": 7, "ok": False, "error": {"message": "No."}}
    assert router._refusal(None, "No.") == {"type": "note", "words": "No.", "error": True}
