"""Limit of the size of request bodies, counted while they arrive; a route may set a larger one."""

import asyncio
import contextlib
from typing import Any

from fastapi import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# The longest legitimate JSON is about 2 KiB. JSON is parsed on the event loop, where a megabyte can take a second.
MAX_BODY_BYTES = 64 << 10
# Many clients send the whole body before they read, and get a reset instead of the response if it is not read.
DRAIN_BYTES = 64 << 20
DRAIN_S = 5.0
_WORDS = f"the body is larger than {MAX_BODY_BYTES >> 10} KiB, the most that is taken."
_CLOSE = (b"connection", b"close")


class BodyLimit:
    """Middleware that refuses bodies of more than MAX_BODY_BYTES, announced or received, with 413.

    A route with a larger limit sets `request.state.max_body_bytes` before it reads, and `too_large`, the message.

    If a response is ready before the body has been read, up to DRAIN_BYTES of the rest are read and dropped first, for
    at most DRAIN_S; then the response is sent and the connection closed. A client that announces more is answered
    immediately, since reading its body to the end would take too long.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        state = scope.setdefault("state", {})
        state["max_body_bytes"], state["too_large"] = MAX_BODY_BYTES, _WORDS
        body = _Body(scope, receive, state)

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start" and await body.drained():
                message = {**message, "headers": [*message.get("headers", ()), _CLOSE]}
            await send(message)

        await self._app(scope, body.receive, answer)


class _Body:
    """The body of one request as it arrives."""

    def __init__(self, scope: Scope, receive: Receive, state: dict[str, Any]) -> None:
        headers = dict(scope["headers"])
        self._receive, self._state = receive, state
        self._claimed = int(headers.get(b"content-length", 0))
        self._read = 0
        self._ended = not self._claimed and b"transfer-encoding" not in headers
        self._continue_sent = b"expect" not in headers

    async def receive(self) -> Message:
        """Return the next part of the body. Raises HTTPException if it is too large."""
        self._check(self._claimed)  # before anything is read, and before '100 Continue' asks the client to send it
        message = await self._next()
        self._check(self._read)
        return message

    async def drained(self) -> bool:
        """Read and drop the rest of the body; return whether something was read and the body has ended."""
        if self._ended or not self._continue_sent or self._claimed - self._read > DRAIN_BYTES:
            return False
        most = self._read + DRAIN_BYTES
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(DRAIN_S):
                while not self._ended and self._read < most:
                    await self._next()
        return self._ended

    async def _next(self) -> Message:
        self._continue_sent = True
        message = await self._receive()
        self._read += len(message.get("body", b""))
        self._ended = not message.get("more_body", False)
        return message

    def _check(self, size: int) -> None:
        if size > self._state["max_body_bytes"]:
            raise HTTPException(413, self._state["too_large"])
