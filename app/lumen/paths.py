"""What is computed of a route: the centreline of the lumen, its contours and the pathway of the robot, as a job."""

from __future__ import annotations

import dataclasses
import hashlib
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from app.cases.kinds import is_cavity
from app.cases.service import CaseService
from app.kit.cache import Cache
from app.kit.jobs import ENDED, Job, Jobs, Progress
from app.lumen.cavity import cavity_lumen, cavity_path
from app.lumen.contours import hand_contours, with_contours
from app.lumen.document import Route, StoredRoute
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.registry import SNAKE

if TYPE_CHECKING:  # slow to load, and a planner without a lumen needs none of it
    from vfix_engine.pathway.hand_contours import EditedPathway
    from vfix_engine.pathway.pathway import Contours, TissueMotion
    from vfix_engine.worlds.snake import DriveSettings, LumenContours
    from vfix_engine.worlds.snake.lumen import Lumen
    from vfix_engine.worlds.snake.reach import Reach

FIRST_START = "First start: preparing the snake"
KEPT = 8  # routes whose pathway stays in memory
RING_MM = 15.0  # between two contours that are drawn
RADIUS_STEP_MM = 5.0  # between two radii of the plot
_LOOK_S = 0.2  # how often it is told how far a job is
_CORNERS = 24  # of the rim of a circle
_BODY_AXIS = (0.0, 0.0, 1.0)
_WAVE_MM = 120.0  # between two waves of peristalsis
_FALLOFF_MM = 200.0  # from the entry, which is fixed
_MAKING = threading.Lock()  # one at a time: each takes two cores and up to a gigabyte


@dataclass(frozen=True, eq=False)
class RoutePath:
    """A route as it is driven.

    All lengths are along the robot's way, the curve that its tip follows; in a lumen that moves, and on a fixed base,
    that is the line of the pathway's centres.

    lumen: centreline, curve and pathway; snake: the whole robot; tissue: None where it is still.
    edited: its control contours, and which of them were placed by hand.
    s_mm (n,), radius_mm (n,), wall_mm (n,): along the way, the pathway's least radius, and the distance from the
    place of the centreline beside it to the wall.
    reach: how deep the robot comes, and what would come deeper. surface: of the pathway, at rest.
    base: (4, 4) transform_base_to_patient of a robot that stands there; None: it is inserted.
    """

    lumen: Lumen
    edited: EditedPathway
    snake: SnakeModel
    settings: DriveSettings
    tissue: TissueMotion | None
    s_mm: Array
    radius_mm: Array
    wall_mm: Array
    reach: Reach
    surface: TriangleMesh
    base: Array | None = None

    @property
    def contours(self) -> LumenContours:
        """The lumen as a control process takes it; a robot on a fixed base follows no curve."""
        from vfix_engine.worlds.snake import LumenContours

        made = LumenContours.of(self.lumen)
        return (
            made if self.base is None else dataclasses.replace(made, curve_points=None, curve_step_mm=0.0, slack=None)
        )

    @property
    def length_mm(self) -> float:
        """Of the way."""
        return self.reach.path_mm

    @property
    def between_vertices_mm(self) -> float:
        """By how much the robot can be deeper between its vertices, at which it is measured."""
        return self.snake.between_vertices_mm(self.settings.vertices_per_link)

    @property
    def behind_mm(self) -> Array:
        """By how much the rim of each control contour (C0,) lies behind the wall; 0 where it does not."""
        pathway, wall = self.edited.pathway, self.reach.behind_wall
        assert wall is not None
        near = np.abs(pathway.s[:, None] - pathway.at_s).argmin(axis=0)
        found: Array = wall.deepest_mm[near]
        return found

    def bound_mm(self, settings: DriveSettings) -> float:
        """The largest bound that a link of a drive with these settings has anywhere."""
        return settings.bounds(self.snake.links).largest_mm(self.lumen.pathway)

    @property
    def stop(self) -> Array:
        """Where the tip of the robot comes to at most, (3,) LPS mm."""
        from vfix_engine.snake.conform.conforming import driven_curve  # slow to load

        line = driven_curve(self.lumen.pathway, self.lumen.curve)
        found: Array = np.asarray(line.position(self.reach.depth_mm))
        return found

    def rings(self, every_mm: float = RING_MM) -> list[Array]:
        """Closed rims (m, 3) of contours at rest, LPS mm, about so far apart."""
        contours = self.lumen.pathway.moved(None).contours()
        last, found = -math.inf, []
        for index, s in enumerate(contours.s):
            if s - last >= every_mm:
                last = float(s)
                found.append(rim_of(contours, index))
        return found


class RoutePaths:
    """Computes pathways of routes, once for what they depend on. Thread-safe."""

    def __init__(self, cases: CaseService, jobs: Jobs) -> None:
        self._cases, self._jobs = cases, jobs
        self._known: Cache[str, RoutePath] = Cache(KEPT)
        self._fits: Cache[str, Lumen] = Cache(KEPT)

    def key(self, route: StoredRoute) -> str:
        """Of what the path of a route depends on; routes with equal keys have the same. Raises NotFound."""
        return self._key(route.case_id, replace(route.content, marks=()))

    def _key(self, case_id: str, content: Route) -> str:
        source = self._cases.get(case_id).content_hash
        return hashlib.sha256(f"{source} {content!r}".encode()).hexdigest()

    def _fit_key(self, case_id: str, content: Route) -> str:
        return self._key(case_id, replace(content, contours=(), marks=(), links=None, bound_mm=None))

    def fit(self, route: StoredRoute) -> Lumen:
        """The lumen with its fitted pathway, without contours placed by hand. Raises VfixError where there is none."""
        return self.fit_of(route.case_id, route.content)

    def fit_of(self, case_id: str, content: Route) -> Lumen:
        """The same of a content; takes seconds where it is not known."""

        def found() -> Lumen:
            with _MAKING:
                if is_cavity(self._cases.get(case_id)):
                    return cavity_lumen()
                return _fitted(self._cases.case_surface(case_id), content)

        return self._fits.get(self._fit_key(case_id, content), found)

    def edited(self, route: StoredRoute) -> EditedPathway | None:
        """The control contours, where the fit was computed before. Raises PathwayError as `with_contours`."""
        if route.content.entry is None or route.content.end is None:
            return None
        fit = self._fits.peek(self._fit_key(route.case_id, route.content))
        return None if fit is None else with_contours(fit, route.content.contours)

    def known(self, route: StoredRoute) -> RoutePath | None:
        """The path where it was computed before. Never waits."""
        return self._known.peek(self.key(route))

    def check_ends(self, route: StoredRoute) -> None:
        """Raises InputError for a route without entry or end."""
        _ends(route.content)

    def start(self, route: StoredRoute) -> Job:
        """Compute it as a job, once the robot's kernels are there.

        Raises NotFound, and InputError for a route without entry or end.
        """
        self.check_ends(route)

        def work(progress: Progress) -> str:
            SNAKE.wait(lambda: progress(FIRST_START, SNAKE.progress()))
            self.make(route, progress)
            return route.id

        return self._jobs.submit(
            work, kind="route", lane="route", case_id=route.case_id, subject=route.name, document_id=route.id,
            same=self.key(route),
        )  # fmt: skip

    def wait(self, route: StoredRoute, tell: Callable[[str, float], object] | None = None) -> RoutePath:
        """The path, computed as a job where it is not known; tell: called with its stage and how much of it is done.

        Raises VfixError where there is none, and what `tell` does.
        """
        if (known := self.known(route)) is not None:
            return known
        job = self.start(route).id
        while tell is not None and (now := self._jobs.wait(job, _LOOK_S)).state not in ENDED:
            tell(now.stage, now.fraction)
        ended = self._jobs.wait(job)
        if ended.error is not None:
            raise ended.error
        return self.make(route)

    def make(self, route: StoredRoute, progress: Progress | None = None) -> RoutePath:
        """Compute it here. Raises PathwayError where the route leads nowhere, and NotFound."""

        def found() -> RoutePath:
            if progress is not None:
                progress("Finding the centreline", 0.1)
            fit = self.fit_of(route.case_id, route.content)
            with _MAKING:
                if progress is not None:
                    progress("Trying how deep the robot comes", 0.6)
                if is_cavity(self._cases.get(route.case_id)):
                    return cavity_path(route.content)
                return _path(self._cases.case_surface(route.case_id), route.content, fit)

        return self._known.get(self.key(route), found)


def _ends(route: Route) -> tuple[Array, Array]:
    if route.entry is None or route.end is None:
        missing = "entry" if route.entry is None else "end"
        raise InputError(f"the route has no {missing} yet; click on the wall, or choose a landmark.")
    return np.array(route.entry), np.array(route.end)


def rim_of(contours: Contours, index: int) -> Array:
    """A contour as a closed rim (n, 3), LPS mm."""
    given = contours.radius[index]
    angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    at = np.linspace(0.0, 2.0 * np.pi, len(given), endpoint=False)
    radius = np.interp(angle, at, given, period=2.0 * np.pi)
    first, second = contours.first[index], np.cross(contours.tangent[index], contours.first[index])
    ray = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    rim = contours.centre[index] + radius[:, None] * ray
    return np.concatenate([rim, rim[:1]])


def drive_settings(route: Route) -> DriveSettings:
    """The settings of a drive along a route; the view turns to the side to which a hand pulls the camera."""
    from vfix_engine.worlds.snake import DriveSettings

    return DriveSettings(bound_mm=route.bound_mm, control="view")


def tissue_of(route: Route) -> TissueMotion | None:
    """How the lumen of a route moves; None where it is still."""
    from vfix_engine.pathway.tissue_motion import breathing, peristalsis, together

    motions = []
    if route.breathing_mm:
        motions.append(breathing(_BODY_AXIS, route.breathing_mm, route.breathing_period_s, _FALLOFF_MM))
    if route.peristalsis:
        motions.append(peristalsis(route.peristalsis, _WAVE_MM, _WAVE_MM / route.peristalsis_period_s))
    return together(*motions) if len(motions) > 1 else motions[0] if motions else None


def _fitted(mesh: TriangleMesh, route: Route) -> Lumen:
    from vfix_engine.worlds.snake.lumen import lumen_between

    entry, end = _ends(route)
    return lumen_between(mesh, entry, end, route.robot(), drive_settings(route), tissue_of(route))


def _path(mesh: TriangleMesh, route: Route, fit: Lumen) -> RoutePath:
    from vfix_engine.pathway.pathway_surface import pathway_surface
    from vfix_engine.snake.conform.conforming import driven_curve
    from vfix_engine.worlds.snake.by_hand import HandEdits
    from vfix_engine.worlds.snake.lumen import edited_lumen
    from vfix_engine.worlds.snake.reach import reach_of

    settings, model = drive_settings(route), route.robot()
    lumen, edited = edited_lumen(mesh, fit, hand_contours(route.contours), model)
    snake = lumen.snake(model, route.links)
    pathway = lumen.pathway
    way, contours = driven_curve(pathway, lumen.curve), pathway.moved(None).contours()
    s = np.linspace(0.0, way.length, max(2, math.ceil(way.length / RADIUS_STEP_MM) + 1))
    hand = HandEdits(edited, fit.pathway) if edited.changed else None
    return RoutePath(
        lumen, edited, snake, settings, pathway.motion, s,
        np.interp(s, pathway.along(lumen.curve, contours.s), contours.radius.min(axis=1)),
        lumen.beside_mm(way.position(s)),
        reach_of(pathway, snake, settings, lumen.curve, lumen.slack, mesh=mesh, hand=hand,
            middle=lumen.centreline,
        ),
        pathway_surface(pathway.moved(None)),
    )  # fmt: skip
