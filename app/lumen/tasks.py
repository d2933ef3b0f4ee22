"""Tasks of Kwok 2013 along a route: what they are made of, without a drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from app.cases.files import shipped_cavity
from app.cases.kinds import is_cavity
from app.cases.model import Case
from app.cases.service import CaseService
from app.kit.errors import NotFound
from app.lumen.document import Route, StoredRoute
from app.lumen.paths import RoutePath, RoutePaths
from app.lumen.views import RouteViews
from app.store.errors import StorageError
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.study.polyps.printed import HOLD_S, POLYPS

if TYPE_CHECKING:  # slow to load, as in `paths`
    from vfix_engine.study.diathermy.placing import PlacedLabels
    from vfix_engine.study.polyps.task import PolypTask

TaskName = Literal["polyps", "labels"]
PolypPlaces = Literal["seed", "route"]


@dataclass(frozen=True)
class TaskChoice:
    """A task as it is chosen: study I, polyps, or study II, labels in the body cavity.

    places: of polyps, drawn by the seed where the robot can view them, or those of the route; labels are drawn by the
    seed. count: of drawn ones, of labels six at most; hold_s: for how long a polyp has to be viewed. Both are the
    paper's unless a test wants less.
    """

    task: TaskName = "polyps"
    places: PolypPlaces = "seed"
    seed: int = 0
    count: int = POLYPS
    hold_s: float = HOLD_S


def route_polyps(route: Route) -> Array:
    """(n, 3) LPS mm, the polyps that were put on the route by hand or by its seed."""
    return np.array([mark.at for mark in route.marks if mark.kind == "polyp"]).reshape(-1, 3)


def tasks_in(case: Case | None) -> tuple[TaskName, ...]:
    """What can be done in a case: labels in the body cavity, polyps in every other lumen."""
    if case is None or case.kind != "lumen":
        return ()
    return ("labels",) if is_cavity(case) else ("polyps",)


class RouteTasks:
    """Makes tasks of routes. Thread-safe."""

    def __init__(self, cases: CaseService, paths: RoutePaths, views: RouteViews) -> None:
        self._cases, self._paths, self._views = cases, paths, views

    def wall(self, case_id: str) -> TriangleMesh:
        """The wall that lines of sight end at. Raises NotFound."""
        return self._cases.case_surface(case_id)

    def known_wall(self, case_id: str | None) -> TriangleMesh | None:
        """The wall of a lumen's case; None of another case, or of one that is gone."""
        try:
            case = None if case_id is None else self._cases.get(case_id)
            return self.wall(case.id) if case is not None and case.kind == "lumen" else None
        except (NotFound, StorageError):
            return None

    def polyps(
        self, route: StoredRoute, choice: TaskChoice, heard: Callable[[float], object] = lambda share: None
    ) -> PolypTask:
        """The task of a route; drawn polyps wait for the search of what the robot can view, minutes in a whole colon.

        heard: called with the share of that search that is done.
        Raises VfixError where the route leads nowhere, and InputError where no polyp can be placed.
        """
        path = self._paths.wait(route)
        task = self._of_route(route, path) if choice.places == "route" else self._drawn(route, path, choice, heard)
        return replace(task, hold_s=choice.hold_s)

    def labels(self, route: StoredRoute, choice: TaskChoice) -> PlacedLabels:
        """The labels of study II, where the robot of a route can trace them, with how it does; takes seconds.

        Raises InputError where the robot is not on a fixed base, or no label can be placed.
        """
        from vfix_engine.study.diathermy.bend_map import BendMap
        from vfix_engine.study.diathermy.placing import LABELS, placed_labels

        path = self._paths.wait(route)
        if path.base is None:
            raise InputError("labels are traced in the body cavity, from a fixed base; open that case.")
        case = replace(shipped_cavity(), pathway=path.lumen.pathway, snake=path.snake)
        script, bound = case.script(), path.settings  # the robot is driven with the route's bound
        drive = replace(script.drive, bound_mm=bound.bound_mm, tip_bound_mm=bound.tip_bound_mm)
        bends = BendMap(replace(script, drive=drive).build())
        return placed_labels(case, bends, choice.seed, min(choice.count, LABELS))

    def _of_route(self, route: StoredRoute, path: RoutePath) -> PolypTask:
        from vfix_engine.snake.conform.conforming import driven_curve
        from vfix_engine.study.polyps.by_hand import polyps_at

        at = route_polyps(route.content)
        if not len(at):
            raise InputError("the route has no polyps; put some on the wall in Route.")
        curve = driven_curve(path.lumen.pathway, path.lumen.curve)
        return polyps_at(at, self.wall(route.case_id), curve, self._landmarks(route), path.reach.depth_mm)

    def _drawn(
        self, route: StoredRoute, path: RoutePath, choice: TaskChoice, heard: Callable[[float], object]
    ) -> PolypTask:
        from vfix_engine.snake.conform.conforming import driven_curve
        from vfix_engine.study.polyps.world import polyps_in

        found = self._views.wait(route, heard).found
        curve = driven_curve(path.lumen.pathway, path.lumen.curve)
        bending_mm = path.settings.manipulated * path.snake.length_mm
        wall, marks = self.wall(route.case_id), self._landmarks(route)
        return polyps_in(found, wall, curve, marks, bending_mm, choice.seed, choice.count).task

    def _landmarks(self, route: StoredRoute) -> dict[str, Array]:
        """By the names that the engine knows them by."""
        marks = self._cases.get(route.case_id).landmarks
        return {mark.name.lower().replace(" ", "_"): np.array(mark.position) for mark in marks}
