"""Admission check of the scene's server, which listens on loopback, where every local user can connect.

viser 1.1.1 starts a `websockets` server and has no hook for admission, so the `serve` function that it calls is wrapped
while it starts. A test ties this workaround to the pinned version.
"""

import contextlib
import http
import inspect
from collections.abc import Callable, Iterator
from typing import Any, cast

import websockets.asyncio.server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from app.gateway.connections import BoundedWebSocket

Admit = Callable[[ServerConnection, Request], http.HTTPStatus | None]


@contextlib.contextmanager
def locked_servers(admit: Admit) -> Iterator[None]:
    """Make every `websockets` server started in this context call `admit` first; a returned status is the response.

    Raises RuntimeError on exit if no server was started through the wrapped call, since it would be open to all.
    """
    original = websockets_server.serve
    started = 0

    def serve(handler: Any, host: str, port: int, *, process_request: Any, **options: Any) -> Any:
        nonlocal started
        started += 1

        async def guarded(connection: ServerConnection, request: Request) -> Response | None:
            status = admit(connection, request)
            if status is not None:
                return connection.respond(status, f"{status.phrase}\n")
            answer = process_request(connection, request)
            return cast(Response | None, await answer if inspect.isawaitable(answer) else answer)

        return original(handler, host, port, process_request=guarded, create_connection=BoundedWebSocket, **options)

    websockets_server.serve = serve  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets_server.serve = original  # type: ignore[misc]
    if not started:
        raise RuntimeError("the scene's server was started in an unknown way.")
