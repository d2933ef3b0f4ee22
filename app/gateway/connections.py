"""Limits of unauthenticated connections: their number, their waiting time, and their lines in the log.

A connection waits while none of its requests is being answered: before its first head, between two requests, and while
the body of an answered one still arrives. Each has HEAD_DEADLINE_S for a complete head. Beyond MAX_WAITING the one that
has waited longest is closed: honest clients send their request at once.
"""

import asyncio
import contextlib
import logging
import socket
from time import monotonic
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
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
    """uvicorn's HTTP/1.1 with a deadline for each head; uvicorn's own time-out restarts with every byte."""

    waiting_since: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        # asyncio does this only for sockets that were made with the protocol's number. Without it a small message waits
        # for the receipt of the one before, which a browser puts off by up to 40 ms.
        with contextlib.suppress(OSError):  # it is closed already
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
        if answering or self.transport.is_closing() or self.transport.get_protocol() is not self:  # else a WebSocket
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


class BoundedWebSocket(ServerConnection):
    """The same for the scene's inner server, which closes a connection without a handshake after 10 s by itself."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        waiting = [other for other in self.server.handlers if other.protocol.state is State.CONNECTING]
        for other in waiting[: len(waiting) - MAX_WAITING]:
            other.transport.abort()


class Discreet(logging.Filter):
    """What a library logs of an error: where it was, never what it said, which may hold a name (HAZ-33)."""

    def filter(self, record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        if error is not None:
            record.msg, record.args = "%s: %s", (str(record.msg)[:60].strip(), error_places(error))
        record.exc_info = record.exc_text = None
        return True


class FewLines(logging.Filter):
    """Passes _SAME_LINES records of one kind a minute; the next one has the number of those left out."""

    def __init__(self) -> None:
        super().__init__()
        self._seen: dict[Any, tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        kind = str(record.msg)[:60]  # asyncio puts the socket's number into some messages, behind what happened
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
    """Keep unauthenticated clients from filling the disk with log lines, and libraries from logging what errors say."""
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
