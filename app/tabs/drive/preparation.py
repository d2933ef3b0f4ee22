"""From a route to a snake robot that a control process can drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from app.cases.model import Case
from app.drives.drive_process import Tell
from app.drives.prepared_drive import PreparedDrive
from app.lumen.document import Route, StoredRoute
from app.lumen.drive_options import LumenDriveOptions
from app.lumen.paths import FIRST_START, RoutePath
from app.lumen.robot_wall import RobotWall
from app.lumen.task_watch import LabelWatch, PolypWatch, TaskWatch
from app.lumen.tasks import route_polyps
from app.services import Services
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.worlds.registry import SNAKE
from vfix_engine.worlds.snake import DriveSettings, SnakeSettings, SnakeSystemSpec
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

STEP_S = 0.002  # of control: a step whose program turns the view takes a millisecond where cores are few


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedSnake(PreparedDrive[SnakeSnapshot]):
    """A robot at the entry of a route. path: what was computed of the route; drive: fixed for the whole drive.

    task: that the drive begins with, None for none. wall: of the lumen, None where the tissue moves. landmarks: of the
    case, each with its arc length in mm along the way, in their order.
    """

    settings: SnakeSettings
    path: RoutePath
    route: Route
    drive: DriveSettings
    task: TaskWatch[Any] | None = None
    wall: RobotWall | None = None
    landmarks: tuple[tuple[float, str], ...] = ()

    def begin(self, process: ControlProcess[SnakeSnapshot]) -> None:
        if self.task is not None:
            self.task.begin(process)


def prepare(services: Services, route: StoredRoute, options: LumenDriveOptions, tell: Tell) -> PreparedSnake:
    """The world of a route; kernels that are being compiled are waited for, and its pathway is computed where it is not
    known.

    tell: called with how far that is.
    Raises VfixError where the route leads nowhere, or the lumen is narrower than the robot.
    """
    SNAKE.wait(lambda: tell(FIRST_START, SNAKE.progress()))
    path = services.lumen_routes.paths.wait(route, tell)
    path.reach.narrowest.refuse(path.snake)
    drive = options.settings(path.settings)
    task = watched_task(services, route, path, options, tell)
    settings = SnakeSettings(step_s=STEP_S, bound_mm=drive.bound_mm, tip_bound_mm=drive.tip_bound_mm)
    spec = SnakeSystemSpec(path.contours, path.snake, settings, drive, path.tissue, base=path.base)
    driven = services.lumen_routes.paths.key(route)
    recording, unrecorded = services.recordings.attempt(route.case_id, route.id, route.name, plan_sha256=driven)
    return PreparedSnake(
        spec=spec,
        settings=settings,
        recording=recording,
        unrecorded=unrecorded,
        made_of=made_of(services, route, options),
        preset=options.preset,
        path=path,
        route=route.content,
        drive=drive,
        task=task,
        wall=RobotWall(services.lumen_routes.tasks.wall(route.case_id), path) if path.tissue is None else None,
        landmarks=landmarks_along(services.cases.get(route.case_id), path),
    )


def landmarks_along(case: Case, path: RoutePath) -> tuple[tuple[float, str], ...]:
    """The landmarks that the way leads past, with their arc lengths in mm; a robot on a fixed base passes none."""
    from vfix_engine.snake.conform.conforming import driven_curve
    from vfix_engine.study.polyps.world import landmarks_on

    if path.base is not None:
        return ()
    places = {mark.name: mark.position for mark in case.landmarks}
    curve = driven_curve(path.lumen.pathway, path.lumen.curve)
    return tuple(sorted((s, name) for name, s in landmarks_on(places, curve).items()))


def watched_task(
    services: Services, route: StoredRoute, path: RoutePath, options: LumenDriveOptions, tell: Tell
) -> TaskWatch[Any] | None:
    """The task that is chosen, None for none. Raises VfixError where it cannot be made of this route."""
    if options.task is None:
        return None
    from vfix_engine.anatomy.lumen.wall import Wall
    from vfix_engine.study.polyps.sight import LumenSight
    from vfix_engine.study.polyps.task import surface_hash

    tasks = services.lumen_routes.tasks
    if options.task.task == "labels":
        tell("Drawing labels that this robot can trace …")
        cavity = tasks.wall(route.case_id)
        labels = tasks.labels(route, options.task).labels
        return LabelWatch(labels, options.task.seed, surface_hash(cavity), path.snake, Wall(cavity).free)
    task = tasks.polyps(
        route,
        options.task,
        lambda share: tell("Searching what this robot can view", share),
    )
    tell("Starting …")
    return PolypWatch(task, path.snake, path.tissue, LumenSight(tasks.wall(route.case_id), task, path.tissue))


def made_of(services: Services, route: StoredRoute, options: LumenDriveOptions) -> object:
    """What a prepared drive depends on."""
    chosen = options.task
    polyps = route_polyps(route.content).tobytes() if chosen is not None and chosen.places == "route" else b""
    return services.lumen_routes.paths.key(route), options, polyps
