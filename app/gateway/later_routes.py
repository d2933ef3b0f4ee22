"""Routes that are made after the page is served, by a step of the warm-up or the first request for one of them.

Importing the REST routes and having FastAPI analyse them takes as long as all else of a start.
"""

import asyncio
import threading
from collections.abc import Callable, Sequence

from fastapi import APIRouter
from starlette.types import ASGIApp, Receive, Scope, Send

MakeRouters = Callable[[], Sequence[APIRouter]]
_PATHS = ("/api/", "/docs", "/openapi.json")  # /docs and /openapi.json describe the routes below /api


class LaterRoutes:
    """Includes routers once; thread-safe. Routes below other paths than /api/ have to be included at once.

    make: returns the routers. include: adds one to the application.
    """

    def __init__(self, make: MakeRouters, include: Callable[[APIRouter], None]) -> None:
        self._make, self._include = make, include
        self._one_at_a_time, self._included = threading.Lock(), False

    def load(self) -> None:
        """Make and include the routers, or wait until another thread has done so."""
        with self._one_at_a_time:
            if not self._included:
                for router in self._make():
                    self._include(router)
                self._included = True

    def before(self, app: ASGIApp) -> ASGIApp:
        """Middleware in front of `app` in which requests for these routes wait until they are there."""

        async def awaited(scope: Scope, receive: Receive, send: Send) -> None:
            if not self._included and scope["type"] != "lifespan" and scope["path"].startswith(_PATHS):
                await asyncio.to_thread(self.load)  # seconds, in which the loop serves the page
            await app(scope, receive, send)

        return awaited
