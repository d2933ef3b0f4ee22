"""The server of the one public port: uvicorn, told to end what runs before it waits for the answers that are due."""

from __future__ import annotations

import socket

import uvicorn
from fastapi import FastAPI


class PlannerServer(uvicorn.Server):
    """Ends within seconds: a dry run or an import that somebody waits for is answered with a refusal."""

    def __init__(self, app: FastAPI, config: uvicorn.Config) -> None:
        super().__init__(config)
        self._services = app.state.services

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """uvicorn calls this once it is to end."""
        self._services.end()
        await super().shutdown(sockets)
