"""What of a lumen's wall the robot of a route can view, as a job: its share, and the triangles for the scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.cases.service import CaseService
from app.kit.cache import Cache
from app.kit.jobs import ENDED, Job, Jobs, Progress
from app.lumen.document import StoredRoute
from app.lumen.paths import RoutePaths
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:  # slow to load, as in `paths`
    from vfix_engine.worlds.snake.viewable import Viewable

KEPT = 4  # routes whose views stay in memory
LOOK_S = 0.5  # between two looks at how far the search is
STAGE = "Searching views of the wall"


@dataclass(frozen=True, eq=False)
class WallViews:
    """share: viewable part of the wall's area, up to the depth in mm that the tip reaches.

    along: the same in tenths of that way, None where there is no wall. views: number of poses of the camera that view
    it. seen: the viewable triangles, None where there are none. found: as the search has it, for tasks.
    """

    share: float
    depth_mm: float
    along: tuple[float | None, ...]
    views: int
    seen: TriangleMesh | None
    found: Viewable


class RouteViews:
    """Computes what robots can view, once for what it depends on. Thread-safe."""

    def __init__(self, cases: CaseService, jobs: Jobs, paths: RoutePaths) -> None:
        self._cases, self._jobs, self._paths = cases, jobs, paths
        self._known: Cache[str, WallViews] = Cache(KEPT)

    def known(self, route: StoredRoute) -> WallViews | None:
        """What was computed before. Never waits."""
        return self._known.peek(self._paths.key(route))

    def start(self, route: StoredRoute) -> Job:
        """Compute it as a job; takes minutes in a whole colon. Raises NotFound, and InputError without entry or end."""
        self._paths.check_ends(route)

        def work(progress: Progress) -> str:
            self._known.get(self._paths.key(route), lambda: self._make(route, progress))
            return route.id

        return self._jobs.submit(
            work, kind="viewable", lane="viewable", case_id=route.case_id, subject=route.name, document_id=route.id,
            same=self._paths.key(route),
        )  # fmt: skip

    def cancel(self, job_id: str) -> None:
        """End a job that nobody wants the result of; whoever waits for it is told that it was cancelled."""
        self._jobs.cancel(job_id)

    def wait(self, route: StoredRoute, heard: Callable[[float], object] = lambda share: None) -> WallViews:
        """The same, as a job where it is not known. Raises VfixError where there is none.

        heard: called with the share of the search that is done.
        """
        if (known := self.known(route)) is not None:
            return known
        job = self.start(route)
        while job.state not in ENDED:
            heard(job.fraction)
            job = self._jobs.wait(job.id, LOOK_S)
        if job.error is not None:
            raise job.error
        return self._known.get(self._paths.key(route), lambda: self._make(route, None))

    def _make(self, route: StoredRoute, progress: Progress | None) -> WallViews:
        from vfix_engine.worlds.snake.viewable import viewable_wall  # slow to load, as in `paths`

        path = self._paths.make(route)
        if path.base is not None:
            raise InputError("what a robot can view is searched along a lumen; this one stands on a fixed base.")
        mesh = self._cases.case_surface(route.case_id)
        found = viewable_wall(
            mesh, path.lumen.pathway, path.snake, path.settings, path.lumen.curve, path.lumen.slack,
            progress=None if progress is None else lambda share: progress(STAGE, share),
        )  # fmt: skip
        told = found.to_dict()
        seen = np.asarray(mesh.faces)[found.mask]
        used, faces = np.unique(seen, return_inverse=True)
        part = TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3)) if len(seen) else None
        along = tuple(told["along"])
        return WallViews(float(told["share"]), float(found.depth_mm), along, len(found.views), part, found)
