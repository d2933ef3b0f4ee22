"""What is computed of a route through a lumen: the centreline, and how wide and how long its pathway is."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.kit.errors import NotFound
from app.lumen.paths import RoutePath
from app.plans.model import NOTICE
from vfix_engine.arrays import Array
from vfix_engine.kernels.triples import triple

router = APIRouter(prefix="/routes/{route_id}/path", tags=["routes"], responses=ERRORS)

_Triple = tuple[float, float, float]


class ContourPublic(BaseModel):
    """A control contour of the pathway, LPS mm.

    at_mm: along the robot's way. radii_mm: one of a circle, else those around it. cut_mm: by how much it was reduced,
    so that it does not cross a neighbour. behind_mm: by how much its rim lies behind the wall.
    """

    at_mm: float
    centre: _Triple
    radii_mm: list[float]
    by_hand: bool
    cut_mm: float
    behind_mm: float


class RoutePathPublic(BaseModel):
    """The pathway of a route; lengths in mm, places in LPS mm.

    All lengths are along the robot's way, the curve that its tip follows: it rounds bends, so it is shorter than the
    centreline. In a lumen that moves it is the line of the pathway's centres.
    length_mm: to the end. links: of the robot. reach_mm: how deep its tip comes, or how far from a fixed base; limit,
    reach_words: what ends its way; offers: what would come deeper, in words. least_mm, least_at_mm: the least radius,
    and where.
    behind_wall, behind_mm: share of the pathway's surface behind the wall, and how deep at most. between_vertices_mm:
    links are measured at vertices of their surface, which can be so much deeper between them where the pathway is
    convex. contours: its control contours; contours_left_out: number of those by hand that are too far from the way.
    s_mm, radius_mm, wall_mm: along the way, the pathway's radius, and the distance from the place of the centreline
    beside it to the wall. centreline: places at most 0.5 mm apart; centreline_mm: its own length.
    """

    route: str
    length_mm: float
    links: int
    reach_mm: float
    limit: Literal["end", "links", "narrow", "bound", "shape", "base"]
    reach_words: str
    offers: list[str]
    least_mm: float
    least_at_mm: float
    behind_wall: float
    behind_mm: float
    between_vertices_mm: float
    contours: list[ContourPublic]
    contours_left_out: int
    s_mm: list[float]
    radius_mm: list[float]
    wall_mm: list[float]
    centreline: list[_Triple]
    centreline_mm: float
    notice: str


@router.post("", status_code=202)
def compute_route_path(route_id: Identifier, services: ServicesDep) -> JobPublic:
    """Compute the pathway of a route as a job; one that was computed before is taken."""
    routes = services.lumen_routes
    return JobPublic.of(routes.paths.start(routes.documents.get(route_id)))


@router.get("")
def route_path(route_id: Identifier, services: ServicesDep) -> RoutePathPublic:
    """The pathway of a route as it is now, which `POST` computes; 404 until then."""
    routes = services.lumen_routes
    path = routes.paths.known(routes.documents.get(route_id))
    if path is None:
        raise NotFound("the pathway of this route is not computed yet; POST computes it.")
    return _public(route_id, path)


def _public(route_id: str, path: RoutePath) -> RoutePathPublic:
    wall = path.reach.behind_wall
    assert wall is not None
    return RoutePathPublic(
        route=route_id,
        length_mm=path.length_mm,
        links=path.snake.links,
        reach_mm=path.reach.depth_mm,
        limit=path.reach.limit,
        reach_words=path.reach.words,
        offers=[offer.words for offer in path.reach.offers],
        least_mm=path.reach.narrowest.radius_mm,
        least_at_mm=path.reach.narrowest.at_mm,
        behind_wall=wall.outside,
        behind_mm=wall.depth_mm[2],
        between_vertices_mm=path.between_vertices_mm,
        contours=_contours(path),
        contours_left_out=len(path.edited.left_out),
        s_mm=_plain(path.s_mm),
        radius_mm=_plain(path.radius_mm),
        wall_mm=_plain(path.wall_mm),
        centreline=path.lumen.centreline.curve.points.round(4).tolist(),
        centreline_mm=path.lumen.centreline.curve.length,
        notice=NOTICE,
    )


def _contours(path: RoutePath) -> list[ContourPublic]:
    edited, behind = path.edited, path.behind_mm
    return [
        ContourPublic(
            at_mm=float(edited.at_mm[number]),
            centre=triple(edited.pathway.centre[number]),
            radii_mm=_plain(edited.pathway.radius[number]),
            by_hand=bool(edited.of_hand[number] >= 0),
            cut_mm=float(edited.cut_mm[number]),
            behind_mm=float(behind[number]),
        )
        for number in range(len(edited.of_hand))
    ]


def _plain(values: Array) -> list[float]:
    found: list[float] = values.round(4).tolist()
    return found
