"""What a page gets in which order: a reply never comes before the state of what it answers."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
from types import SimpleNamespace
from typing import Any

from app.session.view_model import ViewModel

router = importlib.import_module("app.session.router")  # the package has an object of this name


def test_a_reply_follows_the_state_that_it_answers() -> None:
    """Also where both come while an earlier state is on its way: the page reads its state when it has the reply."""
    model, sent = ViewModel(), list[dict[str, Any]]()

    def publish(number: int) -> None:
        sections: Any = {"plan": {"revision": number}}
        model.publish(sections)
        model.commit()

    async def write() -> None:
        outbox: asyncio.Queue[Any] = asyncio.Queue()
        changed = asyncio.Event()

        async def send_text(text: str) -> None:
            sent.append(json.loads(text))
            if len(sent) == 1:
                publish(2)
                outbox.put_nowait({"type": "reply", "id": 7, "ok": True, "result": None})
                changed.set()

        publish(1)
        changed.set()
        socket: Any = SimpleNamespace(send_text=send_text)
        session: Any = SimpleNamespace(view_model=model)
        writer = asyncio.create_task(router._write(socket, session, outbox, changed))
        while len(sent) < 3:
            await asyncio.sleep(0.001)
        writer.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await writer

    asyncio.run(asyncio.wait_for(write(), 60.0))
    assert [message["type"] for message in sent] == ["state", "state", "reply"]
    assert [message["sections"]["plan"]["revision"] for message in sent[:2]] == [1, 2]


def test_what_is_no_command_is_answered_by_its_number() -> None:
    """Who waits for a reply would wait for ever; without a number it is a note."""
    assert router._number('{"type": "no such command", "id": 7}') == 7
    for text in ("", "7", "[]", '{"id": true}', '{"id": "7"}', '{"type": "undo"}', "[" * 60_000):
        assert router._number(text) is None
    assert router._refusal(7, "No.") == {"type": "reply", "id": 7, "ok": False, "error": {"message": "No."}}
    assert router._refusal(None, "No.") == {"type": "note", "words": "No.", "error": True}
