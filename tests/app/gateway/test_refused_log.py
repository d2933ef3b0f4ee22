"""A client that is refused is told so in its answer, and in the log by one line, which is no error (HAZ-30)."""

from __future__ import annotations

import logging
import socket

import pytest
from knocking import Planner, upgrade

REFUSED = ["no token", "wrong token", "other origin", "other host", "no tab", "goes at once"]


def _knock(planner: Planner, case: str) -> int:
    """The status of a socket that is refused, 0 where nobody waits for the answer."""
    origin = ("Origin", planner.origin)
    if case == "no token":
        return planner.handshake("/session", origin).status
    if case == "wrong token":
        return planner.handshake("/session", origin, ("Authorization", "Bearer wrong")).status
    if case == "other origin":
        return planner.handshake("/session", planner.cookie, ("Origin", "http://elsewhere.example")).status
    if case == "other host":
        return planner.handshake("/session", planner.bearer, host="elsewhere.example").status
    if case == "no tab":
        return planner.handshake("/scene/ws?tab=x", origin, planner.cookie).status
    lines = [
        "GET /session HTTP/1.1",
        f"Host: {planner.host}",
        *map(": ".join, upgrade()),
        "",
        "",
    ]
    with socket.create_connection(("127.0.0.1", planner.port), timeout=60) as connection:
        connection.sendall("\r\n".join(lines).encode())
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # reset, before the answer
    return 0


@pytest.mark.parametrize("case", REFUSED)
def test_a_refused_socket_is_no_error_in_the_log(planner: Planner, caplog: pytest.LogCaptureFixture, case: str) -> None:
    caplog.set_level(logging.INFO)
    assert _knock(planner, case) in (0, 400, 401, 403)
    assert planner.http("GET", "/api/v1/echo/on", planner.bearer).status == 200  # what was left of it is done by now
    assert all("\n" not in record.getMessage() and not record.exc_info for record in caplog.records)
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == []
