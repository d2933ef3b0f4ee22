"""Limits of unauthenticated connections: their number, their waiting time, and their log lines.

A connection waits while none of its requests is being answered: before its first request head, between two requests,
and while the body of an answered request still arrives. A head must be complete within HEAD_DEADLINE_S. If more than
MAX_WAITING connections wait, the one that has waited longest is closed: legitimate clients send a request immediately.
"""

import asyncio
import contextlib
import logging
import socket
from time import monotonic
from typing import Any

from uvicorn._types import ASGISendEvent
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.asyncio.server import ServerConnection
from websockets.protocol import State

from vfix_engine.error_places import error_places

HEAD_DEADLINE_S = 10.0
MAX_WAITING = 128
MAX_MESSAGE_BYTES = 256 << 10  # of a browser's WebSocket; the longest that one sends is about 60 KiB
_MOST_DESCRIPTORS = 8192
_SAME_LINES = 5  # of one kind a minute
_NOISY_LOGGERS = ("asyncio", "uvicorn.error", "websockets.server", "app.link.server", "app.live.link")


class BoundedHttp(H11Protocol):
    """uvicorn's HTTP/1.1 with a deadline for each request head; uvicorn's own timeout restarts with every byte."""

    waiting_since: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        # asyncio sets this only for sockets created with an explicit protocol number. Without it a small message waits
        # for the acknowledgement of the previous one, which a browser delays by up to 40 ms.
        with contextlib.suppress(OSError):  # the socket may already be closed
            transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().connection_made(transport)
        self._note_waiting()
        waiting = {
            other: timer.when()
            for other in self.connections
            if isinstance(other, BoundedHttp) and (timer := other.waiting_since) is not None
        }
        if len(waiting) > MAX_WAITING:
            min(waiting, key=waiting.__getitem__)._give_up()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._note_waiting()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._note_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._stop_waiting()

    def _note_waiting(self) -> None:
        answering = self.cycle is not None and not self.cycle.response_complete
        is_websocket = self.transport.get_protocol() is not self
        if answering or self.transport.is_closing() or is_websocket:
            self._stop_waiting()
        elif self.waiting_since is None:
            self.waiting_since = self.loop.call_later(HEAD_DEADLINE_S, self._give_up)

    def _stop_waiting(self) -> None:
        if self.waiting_since is not None:
            self.waiting_since.cancel()
            self.waiting_since = None

    def _give_up(self) -> None:
        self._stop_waiting()
        self.transport.abort()


class RefusableWebSocket(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket, which takes the answer to a refused handshake for none, and logs that as an error."""

    async def send(self, message: ASGISendEvent) -> None:
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and not message.get("more_body", False):
            self.handshake_complete = True


class BoundedWebSocket(ServerConnection):
    """The same bound for the scene's inner server, which itself closes a connection without a handshake after 10 s."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        waiting = [other for other in self.server.handlers if other.protocol.state is State.CONNECTING]
        for other in waiting[: len(waiting) - MAX_WAITING]:
            other.transport.abort()


class Discreet(logging.Filter):
    """Logs the location of an error of a library, never its message, which may contain a patient's name (HAZ-33)."""

    def filter(self, record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        if error is not None:
            record.msg, record.args = "%s: %s", (str(record.msg)[:60].strip(), error_places(error))
        record.exc_info = record.exc_text = None
        return True


class FewLines(logging.Filter):
    """Passes _SAME_LINES records of one kind per minute; the next one states how many were dropped."""

    def __init__(self) -> None:
        super().__init__()
        self._seen: dict[Any, tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        kind = str(record.msg)[:60]  # the start of the message; asyncio appends the socket's number to some
        since, count = self._seen.get(kind, (0.0, 0))
        now = monotonic()
        if now - since >= 60.0:
            if count > _SAME_LINES:
                record.msg = f"({count - _SAME_LINES} more of the kind since) {record.msg}"
            since, count = now, 0
        if len(self._seen) > 100:
            self._seen.clear()
        self._seen[kind] = (since, count + 1)
        return count < _SAME_LINES


def quieten_log() -> None:
    """Keep unauthenticated clients from filling the disk with log lines, and libraries from logging error messages."""
    for name in _NOISY_LOGGERS:
        logger = logging.getLogger(name)
        for kind in (FewLines, Discreet):
            if not any(isinstance(known, kind) for known in logger.filters):
                logger.addFilter(kind())


def raise_descriptor_limit() -> None:
    """Raise the soft limit of open files and sockets of this process; many systems start with 1,024."""
    try:
        import resource
    except ImportError:  # Windows knows no such limit
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _MOST_DESCRIPTORS if hard == resource.RLIM_INFINITY else min(_MOST_DESCRIPTORS, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
