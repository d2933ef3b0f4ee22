"""Connections that ask nothing, ask slowly, ask too much, and what they write to the log (HAZ-30)."""

import asyncio
import contextlib
import json
import logging
import socket
import time
from types import ModuleType
from typing import Any

import pytest
from knocking import Planner, raw

from app.gateway import body_limit, connections
from app.gateway.body_limit import MAX_BODY_BYTES
from app.link import server as link_server
from app.live import link as live_link


def is_closed_on(connection: socket.socket, drip: bytes) -> bool:
    """Whether the planner ends a connection over which a byte comes again and again."""
    connection.settimeout(0.1)
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        try:
            connection.sendall(drip)
            with contextlib.suppress(TimeoutError):
                if connection.recv(1 << 16) == b"":
                    return True
        except OSError:
            return True
    return False


@pytest.mark.parametrize(
    ("first", "drip"),
    [
        (b"", b""),
        (b"GET / HTTP/1.1\r\nX-Slow: ", b"x"),
        (b"GET /docs HTTP/1.1\r\nHost: {host}\r\n\r\n", b"G"),
        (b"POST /docs HTTP/1.1\r\nHost: {host}\r\nContent-Length: 1000\r\n\r\n", b"x"),
    ],
    ids=["says nothing", "a slow head", "a slow second head", "a slow body of a refused request"],
)
def test_who_does_not_ask_in_time_is_let_go(
    planner: Planner, monkeypatch: pytest.MonkeyPatch, first: bytes, drip: bytes
) -> None:
    monkeypatch.setattr(connections, "HEAD_DEADLINE_S", 0.5)
    with socket.create_connection(("127.0.0.1", planner.port), timeout=60) as connection:
        connection.sendall(first.replace(b"{host}", planner.host.encode()))
        assert is_closed_on(connection, drip)


def test_a_request_that_is_answered_slowly_is_not_cut_off(planner: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "HEAD_DEADLINE_S", 1.0)  # less than the answer takes
    assert planner.http("GET", "/api/v1/slow", planner.bearer).status == 200
    request = f"GET /api/v1/slow HTTP/1.1\r\nHost: {planner.host}\r\n{': '.join(planner.bearer)}\r\n\r\n".encode()
    with socket.create_connection(("127.0.0.1", planner.port), timeout=60) as connection:
        for _ in range(2):  # of one connection
            connection.sendall(request)
            answer = b""
            while not answer.endswith(b"null"):
                answer += (more := connection.recv(1 << 16))
                assert more, "the connection was cut off"


def test_a_body_is_refused_before_it_is_sent(planner: Planner) -> None:
    """Who asks first (`Expect`) or sends all the same gets the answer in words (HAZ-30)."""
    head = f"POST /api/v1/takes HTTP/1.1\r\nHost: {planner.host}\r\n{': '.join(planner.bearer)}\r\n"
    claimed = f"{head}Content-Type: application/json\r\nContent-Length: {{}}\r\n".encode()
    first = claimed.replace(b"{}", b"1000000000") + b"Expect: 100-continue\r\n\r\n"
    whole = claimed.replace(b"{}", b"3000000") + b"\r\n" + b"[" * 3_000_000
    chunked = head.encode() + b"Transfer-Encoding: chunked\r\n\r\n" + (b"10000\r\n" + b"[" * 65536 + b"\r\n") * 20
    for data in (first, whole, chunked + b"0\r\n\r\n"):
        answer = raw(planner.port, data)
        assert answer.status == 413
        assert json.loads(answer.body)["error"]["code"] == "too_large"
        assert f"{MAX_BODY_BYTES >> 10} KiB" in json.loads(answer.body)["error"]["message"]
    small = claimed.replace(b"{}", b"5") + b"\r\n[1,2]"
    assert raw(planner.port, small).status == 200


def test_who_sends_a_whole_body_before_reading_gets_the_answer(
    planner: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And then the connection's end. A reset would throw the answer away before the client has read it."""
    bearer = ": ".join(planner.bearer)
    head = f"POST /api/v1/takes HTTP/1.1\r\nHost: {planner.host}\r\n{bearer}\r\nConnection: close\r\n"
    size = 24 << 20  # more than what the sockets between them hold

    def answer(head: str, body: bytes) -> bytes:
        with socket.create_connection(("127.0.0.1", planner.port), timeout=60) as connection:
            connection.sendall(head.encode() + b"\r\n")
            connection.sendall(body)
            found = b""
            while more := connection.recv(1 << 16):
                found += more
            return found

    chunks = b"".join(b"100000\r\n" + bytes(1 << 20) + b"\r\n" for _ in range(size >> 20)) + b"0\r\n\r\n"
    claimed = f"{head}Content-Length: {size}\r\n"
    for sent, body in ((claimed, bytes(size)), (f"{head}Transfer-Encoding: chunked\r\n", chunks)):
        status, _, rest = answer(sent, body).partition(b"\r\n")
        assert status.startswith(b"HTTP/1.1 413 ")
        assert b"connection: close" in rest.lower()
        assert f"{MAX_BODY_BYTES >> 10} KiB".encode() in rest
    elsewhere = claimed.replace("POST /api/v1/takes", "POST /api/v1/nothing")  # answered without a look at the body
    assert answer(elsewhere, bytes(size)).startswith(b"HTTP/1.1 404 ")
    monkeypatch.setattr(body_limit, "DRAIN_BYTES", 1 << 20)
    received = list[int]()
    receive = body_limit._Body._next

    async def counted(self: body_limit._Body) -> Any:
        message = await receive(self)
        received.append(self._read)
        return message

    monkeypatch.setattr(body_limit._Body, "_next", counted)
    with contextlib.suppress(ConnectionError):  # more than is drained: the client may be cut off
        answer(f"{head}Transfer-Encoding: chunked\r\n", chunks)
    assert 1 << 20 <= received[-1] < 4 << 20, "a bounded amount"
    received.clear()
    with contextlib.suppress(ConnectionError):
        answer(claimed, bytes(size))
    assert received == [], "what is claimed to be longer is answered at once"


def test_the_log_cannot_be_flooded(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    now = 1000.0
    monkeypatch.setattr(connections, "monotonic", lambda: now)
    logger = logging.getLogger("vfix-flooded")
    logger.addFilter(connections.FewLines())
    for number in range(2000):
        logger.error("socket.accept() out of system resource\nsocket: <asyncio.TransportSocket fd=%d>", number)
        logger.error("another kind") if number < 2 else None
    assert len(caplog.records) == 7
    now += 60.0
    logger.error("socket.accept() out of system resource\nsocket: <asyncio.TransportSocket fd=%d>", 1)
    assert caplog.records[-1].getMessage().startswith("(1995 more of the kind since) socket.accept()")


@pytest.mark.parametrize("module", [asyncio, link_server, live_link])
def test_what_strangers_can_fill_the_log_with_is_held_to_few_lines(planner: Planner, module: ModuleType) -> None:
    logger = logging.getLogger(module.__name__)
    assert any(isinstance(known, connections.FewLines) for known in logger.filters)


def test_small_messages_do_not_wait_for_the_receipt_of_those_before(
    planner: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """TCP would hold the second of two back for up to 40 ms: a figure on the page would be so much older."""
    made, accepted = connections.BoundedHttp.connection_made, list[int]()

    def noted(self: connections.BoundedHttp, transport: asyncio.BaseTransport) -> None:
        made(self, transport)
        accepted.append(transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

    monkeypatch.setattr(connections.BoundedHttp, "connection_made", noted)
    assert planner.http("GET", "/docs", planner.bearer).status == 200
    assert accepted
    assert all(accepted)
