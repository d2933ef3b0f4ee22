"""From a route to a snake robot that a control process can drive."""

from __future__ import annotations

from dataclasses import dataclass

from app.drives.prepared_drive import PreparedDrive
from app.lumen.document import StoredRoute
from app.lumen.paths import RoutePath
from app.services import Services
from vfix_engine.worlds.snake import LumenContours, SnakeSettings, SnakeSystemSpec
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

STEP_S = 0.002  # of control: a step whose program turns the view takes a millisecond where cores are few


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedSnake(PreparedDrive[SnakeSnapshot]):
    """A robot at the entry of a route. path: what was computed of the route."""

    settings: SnakeSettings
    path: RoutePath


def prepare(services: Services, route: StoredRoute) -> PreparedSnake:
    """The world of a route; its pathway is computed where it is not known.

    Raises VfixError where the route leads nowhere, or the lumen is narrower than the robot.
    """
    path = services.lumen_routes.paths.wait(route)
    path.reach.narrowest.refuse(path.snake)
    settings = SnakeSettings(step_s=STEP_S, bound_mm=route.content.bound_mm)
    spec = SnakeSystemSpec(LumenContours.of(path.lumen), path.snake, settings, path.settings, path.tissue)
    recording, unrecorded = services.recordings.attempt(route.case_id, route.id, route.name)
    return PreparedSnake(
        spec=spec,
        settings=settings,
        recording=recording,
        unrecorded=unrecorded,
        made_of=services.lumen_routes.paths.key(route),
        path=path,
    )
