"""The server of the public port: uvicorn with bounded connections, which ends running work when it shuts down."""

from __future__ import annotations

import socket

import uvicorn
from fastapi import FastAPI

from app.gateway.connections import HEAD_DEADLINE_S, MAX_MESSAGE_BYTES, BoundedHttp, quieten_log

GRACE_S = 2  # for the answers that are due when the planner is told to end


class PlannerServer(uvicorn.Server):
    """Shuts down within seconds: clients of a running dry run or import get an error."""

    def __init__(self, app: FastAPI) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                http=BoundedHttp,
                ws_max_size=MAX_MESSAGE_BYTES,
                ws_per_message_deflate=False,
                # Clients drop a connection that was idle for 5 s. That is uvicorn's own time too, so that a request in
                # that very instant would be reset. BoundedHttp closes it later.
                timeout_keep_alive=int(2 * HEAD_DEADLINE_S),
                backlog=128,  # asyncio takes so many at a time, and logs each that it cannot take
                log_level="warning",
                access_log=False,  # it would write the token of the address down
                server_header=False,
                proxy_headers=False,
                timeout_graceful_shutdown=GRACE_S,
            )
        )
        quieten_log()
        self._services = app.state.services

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """uvicorn calls this once it is to end."""
        self._services.end()
        await super().shutdown(sockets)
