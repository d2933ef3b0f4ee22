"""What of a lumen's wall the robot of a route can view."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.kit.errors import NotFound
from app.plans.model import NOTICE

router = APIRouter(prefix="/routes/{route_id}/viewable", tags=["routes"], responses=ERRORS)


class WallViewsPublic(BaseModel):
    """The viewable share of the wall's area between the entry and depth_mm, which the tip reaches.

    along: the same in tenths of that way, null where there is no wall. views: poses of the camera that view it.
    """

    route: str
    share: float
    depth_mm: float
    along: list[float | None]
    views: int
    notice: str


@router.post("", status_code=202)
def compute_views(route_id: Identifier, services: ServicesDep) -> JobPublic:
    """Search what the robot of a route can view of the wall, as a job of minutes; one that is known is taken."""
    routes = services.lumen_routes
    return JobPublic.of(routes.views.start(routes.documents.get(route_id)))


@router.get("")
def route_views(route_id: Identifier, services: ServicesDep) -> WallViewsPublic:
    """What the robot of a route as it is now can view, which `POST` searches; 404 until then."""
    routes = services.lumen_routes
    found = routes.views.known(routes.documents.get(route_id))
    if found is None:
        raise NotFound("what this robot can view is not computed yet; POST computes it.")
    return WallViewsPublic(
        route=route_id,
        share=found.share,
        depth_mm=found.depth_mm,
        along=list(found.along),
        views=found.views,
        notice=NOTICE,
    )
