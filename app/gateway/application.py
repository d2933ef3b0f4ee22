"""The ASGI application: the guard around the page, the scene and the routers."""

import contextlib
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any, Protocol

from fastapi import APIRouter, FastAPI
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Lifespan

from app import __version__
from app.gateway.body_limit import BodyLimit
from app.gateway.error_answers import DiscreetErrors, install_error_answers
from app.gateway.guard import Guard
from app.gateway.later_routes import LaterRoutes, MakeRouters
from app.gateway.pages import WEB_DIR, page_router
from app.gateway.relay import scene_router
from app.gateway.scene_server import SceneServer
from app.gateway.warm_up import WarmUp
from app.settings import Settings


class GatewayServices(Protocol):
    """Interface of the services for the gateway."""

    def close(self) -> None: ...


class Link(Protocol):
    """A further server, which runs as long as the application."""

    def start(self) -> int: ...

    def close(self) -> None: ...


class GuardedApplication(FastAPI):
    """FastAPI with the guard as the outermost layer, outside its own middleware.

    later: makes routers below /api/ that are included by `load_routes`, or when one of their routes is asked for.
    """

    def __init__(self, settings: Settings, lifespan: Lifespan[FastAPI], later: MakeRouters = tuple) -> None:
        super().__init__(
            title="vfix",
            version=__version__,
            description="Cases, plans and exports of the planner. Not for clinical use.",
            docs_url=None,
            redoc_url=None,
            lifespan=lifespan,
        )
        self.state.settings = settings
        self._later = LaterRoutes(later, self.include_router)

    def load_routes(self) -> None:
        """Include the later routers now."""
        self._later.load()

    def openapi(self) -> dict[str, Any]:
        """With what operations on documents refer to."""
        from app.api import described  # imported here: slow to load

        self.load_routes()
        return described(super().openapi())

    def build_middleware_stack(self) -> ASGIApp:
        """Starlette calls this once, before the first request."""
        inner = self._later.before(super().build_middleware_stack())
        return Guard(DiscreetErrors(BodyLimit(inner)), self.state.settings)


def build_application(
    settings: Settings,
    services: GatewayServices,
    scene_server: SceneServer,
    warm_up: WarmUp,
    routers: Sequence[APIRouter],
    link: Link | None = None,
    later: MakeRouters = tuple,
) -> GuardedApplication:
    """Return the application; its `state` holds settings, services, scene_server and warmup, closed at its shutdown.

    link: a further server, started and closed with the application. later: as of `GuardedApplication`.
    """
    app = GuardedApplication(settings, _lifespan(services, scene_server, warm_up, link), later)
    app.state.services = services
    app.state.scene_server = scene_server
    app.state.warmup = warm_up
    install_error_answers(app)
    for router in (page_router(), scene_router(scene_server), *routers):
        app.include_router(router)
    app.mount("/static", StaticFiles(directory=WEB_DIR), name="static")
    return app


def _lifespan(
    services: GatewayServices, scene_server: SceneServer, warm_up: WarmUp, link: Link | None
) -> Lifespan[FastAPI]:
    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        with contextlib.ExitStack() as at_end:  # closes each even if another fails, and the store last
            at_end.callback(services.close)
            at_end.callback(scene_server.stop)
            if link is not None:
                link.start()
                at_end.callback(link.close)
            warm_up.start()
            yield

    return lifespan
