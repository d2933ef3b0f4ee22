"""Limit of request bodies, counted while they arrive; a route may set a larger one."""

from typing import Any

from fastapi import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# The longest honest JSON is about 2 KiB. JSON is parsed on the event loop, where a megabyte of it can take a second.
MAX_BODY_BYTES = 64 << 10
_WORDS = f"the request's body is larger than {MAX_BODY_BYTES >> 10} KiB, which is the most that is taken."


class BodyLimit:
    """Refuses bodies of more than MAX_BODY_BYTES, claimed or received, with 413.

    A route with a larger limit sets `request.state.max_body_bytes` before it reads, and `too_large`, the message.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        state = scope.setdefault("state", {})
        state["max_body_bytes"], state["too_large"] = MAX_BODY_BYTES, _WORDS
        claimed = next((int(value) for name, value in scope["headers"] if name == b"content-length"), 0)
        received = 0

        async def counted() -> Message:
            nonlocal received
            _check(claimed, state)  # before anything is read, and before a client is told to send it
            message = await receive()
            received += len(message.get("body", b""))
            _check(received, state)
            return message

        await self._app(scope, counted, send)


def _check(size: int, state: dict[str, Any]) -> None:
    if size > state["max_body_bytes"]:
        raise HTTPException(413, state["too_large"])
