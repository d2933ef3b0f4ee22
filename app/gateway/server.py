"""The server of the public port: uvicorn with bounded connections, which cancels running work when it shuts down."""

from __future__ import annotations

import socket

import uvicorn
from fastapi import FastAPI

from app.gateway.connections import HEAD_DEADLINE_S, MAX_MESSAGE_BYTES, BoundedHttp, RefusableWebSocket, quieten_log

GRACE_S = 2  # for pending responses when the planner shuts down


class PlannerServer(uvicorn.Server):
    """Shuts down within seconds: clients of a running dry run or import get an error."""

    def __init__(self, app: FastAPI) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                http=BoundedHttp,
                ws=RefusableWebSocket,
                ws_max_size=MAX_MESSAGE_BYTES,
                ws_per_message_deflate=False,
                # Clients drop a connection after 5 s of idle time. uvicorn's default is the same, so that a request at
                # that moment would be reset; BoundedHttp closes the connection later.
                timeout_keep_alive=int(2 * HEAD_DEADLINE_S),
                backlog=128,  # asyncio accepts this many at a time, and logs each that it cannot accept
                log_level="warning",
                access_log=False,  # it would record the token in the address
                server_header=False,
                proxy_headers=False,
                timeout_graceful_shutdown=GRACE_S,
            )
        )
        quieten_log()
        self._services = app.state.services

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Cancel running work, then shut down; called by uvicorn."""
        self._services.end()
        await super().shutdown(sockets)
