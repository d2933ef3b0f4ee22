"""Wires settings, services, scene server and routers into the application that `vfix serve` runs."""

import importlib
from collections.abc import Sequence

from fastapi import APIRouter, FastAPI

from app.gateway.application import build_application
from app.gateway.scene_server import SceneServer
from app.gateway.warm_up import WarmUp, WarmUpStep
from app.kit.errors import PlannerEnds
from app.live import LiveLink
from app.services import Services, build_services
from app.session import router as session_router
from app.settings import Settings
from vfix_engine.worlds import registry as worlds
from vfix_engine.worlds.rigid import preparation


def build(settings: Settings) -> FastAPI:
    """The complete planner for these settings, whose port must be the one in use."""
    return create_app(settings, build_services(settings), SceneServer())


def create_app(settings: Settings, services: Services, scene_server: SceneServer) -> FastAPI:
    """The planner over given services and a given scene server; the application closes both at its end."""
    services.sweep()
    warm_up = WarmUp(
        (
            WarmUpStep("Getting ready", lambda: application.load_routes()),  # first: a script waits for nothing else
            WarmUpStep("Loading the scene", _load_scene),
            WarmUpStep(_preparing, preparation.prepare, needed=lambda: not preparation.is_prepared(), optional=True),
            WarmUpStep("Reading the head", lambda: _read_head(services)),
            WarmUpStep("Loading the geometry engine", lambda: _drive_plans(services)),
        ),
        beside=(WarmUpStep("Preparing the snake", worlds.SNAKE.prepare),),
        ends=(PlannerEnds,),
    )
    link = None if settings.igtl is None else LiveLink(settings.igtl, services)
    application = build_application(settings, services, scene_server, warm_up, (session_router,), link, _rest_routers)
    return application


def _rest_routers() -> Sequence[APIRouter]:
    """Everything below /api."""
    from app.api import router as api_router  # imported here: slow to load
    from app.api.moved import router as moved_router
    from app.tabs.registry import routers as tab_routers

    return (api_router, *tab_routers(), moved_router)  # the last takes what is left


def _load_scene() -> None:
    """Load what every tab needs."""
    importlib.import_module("app.session.client_session")


def _preparing() -> str:
    share = f"{100 * preparation.progress():.0f} %"
    return f"Preparing the geometry engine, first start only: {share}"


def _read_head(services: Services) -> None:
    case = services.cases.embedded_case()
    if case.deleted_at is None:
        services.cases.tree(case)


def _drive_plans(services: Services) -> None:
    """Drive the first plan of the embedded case, which needs every kernel of the controller."""
    for plan in services.plans.list(services.cases.embedded_case().id)[:1]:
        services.planning.evaluate(plan)
