"""The server of the one public port: uvicorn with bounded connections, told to end what runs before it waits for it."""

from __future__ import annotations

import socket

import uvicorn
from fastapi import FastAPI

from app.gateway.connections import MAX_MESSAGE_BYTES, BoundedHttp, quieten_log

GRACE_S = 2  # for the answers that are due when the planner is told to end


class PlannerServer(uvicorn.Server):
    """Ends within seconds: a dry run or an import that somebody waits for is answered with a refusal."""

    def __init__(self, app: FastAPI) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                http=BoundedHttp,
                ws_max_size=MAX_MESSAGE_BYTES,
                ws_per_message_deflate=False,
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
