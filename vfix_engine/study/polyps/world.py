"""Where study I takes place: a lumen, a robot, and polyps where the robot can view them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import TissueMotion
from ...robots.snake import SnakeModel
from ...snake.conform.conforming import driven_curve
from ...validate import point
from ...worlds.snake.lumen import FAR_MARK_MM, Lumen, lumen_between
from ...worlds.snake.narrow import narrowest
from ...worlds.snake.settings import DriveSettings
from ...worlds.snake.stepping.start_checks import checked_tip
from ...worlds.snake.viewable import EVERY_MM, Viewable, viewable_wall
from .placing import WallPlaces, placed
from .printed import POLYPS, PROUD_MM
from .task import FIRST_MARK, LAST_MARK, NEAR_END_MM, PolypTask, surface_hash

ERROR_AT_MOST = 0.8  # of a planned view of a polyp and of the wall under it, as of ``ViewLimits.error``
_SAME_MM = 1e-6


class PlacedPolyps(NamedTuple):
    """A task in a lumen.

    views: for each polyp the tip's arc length in mm and the bends (n, 2L') rad from which the plan views it.
    """

    places: WallPlaces
    task: PolypTask
    views: tuple[tuple[float, Array], ...]


@dataclass(frozen=True, eq=False)
class PolypWorld:
    """What a trial is driven in: one robot in one lumen with its polyps."""

    lumen: Lumen
    snake: SnakeModel
    settings: DriveSettings
    polyps: PlacedPolyps

    @property
    def motion(self) -> TissueMotion | None:
        """Of the tissue; None: it is still."""
        return self.lumen.pathway.motion


def polyp_world(
    mesh: TriangleMesh,
    start: ArrayLike,
    end: ArrayLike,
    landmarks: Mapping[str, ArrayLike],
    model: SnakeModel,
    links: int | None,
    settings: DriveSettings,
    tissue: TissueMotion | None = None,
    *,
    seed: int = 0,
    count: int = POLYPS,
    anyway: bool = False,
    every_mm: float = EVERY_MM,
    say: Callable[[str], None] = lambda words: None,
) -> PolypWorld:
    """Prepare a lumen, find what the robot can view of it, and place polyps there by ``polyps_in``.

    Args:
        mesh, start, end, tissue, anyway: as for ``drive_lumen``. model, links: the robot; None links: those of the
            model, or as many as it takes to the end where these are fewer. seed: of the polyps; count: their number.
            every_mm: of ``viewable_wall``.

    Raises:
        InputError: as ``polyps_in``; more links than it takes to the end. PathwayError, RobotError: as ``drive_lumen``.
    """
    say("centreline, followable curve and pathway")
    lumen = lumen_between(mesh, start, end, model, settings, tissue)
    curve = driven_curve(lumen.pathway, lumen.curve)
    snake = lumen.snake(model, min(model.links, lumen.snake(model, None).links) if links is None else links)
    checked_tip(snake, curve.length, 0.0, longer_allowed=False)  # refused before the long part
    reach = min(curve.length, snake.reach_mm())
    if not anyway:
        narrowest(lumen.pathway, snake, settings.bound_mm, reach, lumen.curve, middle=lumen.centreline).refuse(snake)
    bending_mm = settings.manipulated * snake.length_mm
    way_of(landmarks, curve, reach, bending_mm)  # as above
    say("what of the wall this robot can view")
    found = viewable_wall(mesh, lumen.pathway, snake, settings, lumen.curve, lumen.slack, every_mm=every_mm)
    return PolypWorld(lumen, snake, settings, polyps_in(found, mesh, curve, landmarks, bending_mm, seed, count))


def polyps_in(
    found: Viewable,
    mesh: TriangleMesh,
    curve: Curve,
    landmarks: Mapping[str, ArrayLike],
    bending_mm: float,
    seed: int = 0,
    count: int = POLYPS,
) -> PlacedPolyps:
    """Place polyps in a lumen of which it is known what the robot can view.

    The polyps begin at the landmark 'rectosigmoid', or else where the links that bend are inside; the task ends at the
    landmark 'ascending', or else at the depth that the robot reaches.

    Args:
        found: of ``viewable_wall`` with the same mesh; curve: that the robot follows, at rest. landmarks: places (3,)
            by name. bending_mm: length of the links that bend.

    Raises:
        InputError: as ``placed``; a robot that does not come to the first polyp.
    """
    from_mm, end_mm, end_name = way_of(landmarks, curve, min(curve.length, found.depth_mm), bending_mm)
    places = WallPlaces.of(mesh, curve)
    viewable = _viewable(found, places, end_mm - (NEAR_END_MM if end_name is None else 0.0))
    task = replace(placed(places, viewable, from_mm, end_mm, end_name, seed, count), surface=surface_hash(mesh))
    return PlacedPolyps(places, task, tuple(_views(task, found, places)))


def landmarks_on(landmarks: Mapping[str, ArrayLike], curve: Curve) -> dict[str, float]:
    """At which arc length in mm the landmarks are, without those that are far from the curve."""
    given = {name: point(f"the landmark {name!r}", place) for name, place in landmarks.items()}
    at = {name: curve.closest(place) for name, place in given.items()}
    return {name: s for name, s in at.items() if float(np.linalg.norm(curve.position(s) - given[name])) <= FAR_MARK_MM}


def way_of(
    landmarks: Mapping[str, ArrayLike], curve: Curve, depth: float, bending_mm: float
) -> tuple[float, float, str | None]:
    """From and to which arc length in mm polyps are placed, and the landmark at the end, if it is reached."""
    at = landmarks_on(landmarks, curve)
    from_mm = at.get(FIRST_MARK, min(bending_mm, depth / 3.0))
    reached = LAST_MARK in at and at[LAST_MARK] <= depth + _SAME_MM
    end_mm = at[LAST_MARK] if reached else depth
    if not from_mm < end_mm:
        raise InputError(f"the robot reaches {depth:.0f} mm, and the first polyp is to be at {from_mm:.0f} mm or more")
    return from_mm, end_mm, LAST_MARK if reached else None


def _viewable(found: Viewable, places: WallPlaces, done_mm: float) -> BoolArray:
    """(F,) triangles that are viewed well enough, with a polyp on them, from before the task is completed."""
    tip_s = np.array([view.tip_s for view in found.views] or [np.inf])
    mask: BoolArray = found.mask & found.counted & (found.error <= ERROR_AT_MOST) & (tip_s[found.view] < done_mm)
    middle = places.wall.centre + PROUD_MM * places.wall.inward
    for number, view in enumerate(found.views):
        here = np.flatnonzero(mask & (found.view == number))
        mask[here] = found.limits.error(view.camera, middle[here]) <= ERROR_AT_MOST
    return mask


def _views(task: PolypTask, found: Viewable, places: WallPlaces) -> list[tuple[float, Array]]:
    """The planned view of each polyp."""
    kept = []
    for polyp in task.polyps:
        triangle = int(np.linalg.norm(places.wall.centre - np.array(polyp.wall), axis=1).argmin())
        view = found.views[int(found.view[triangle])]
        kept.append((view.tip_s, view.bends))
    return kept
