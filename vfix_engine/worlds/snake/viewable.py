"""The share of a lumen's wall that a snake robot can view, before any motion, and from where it views each place.

The robot is inserted without a clock, as in ``reach.py``. At depths along the way, bends of its distal links are
searched from which the camera views what is not viewed yet (``bending/view_search.py``). Every bend is reached from the
conforming shape by motions that the certificate of the drive accepts, so that the drive can repeat them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, BoolArray, IntArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.limits.limits import Configuration, LinksAt
from ...pathway.packed import PackedPathway
from ...pathway.pathway import Pathway
from ...robots.snake import SnakeModel
from ...snake.bending.bending_kernel import DistalPathway
from ...snake.bending.view_search import ViewGoal, view_path
from ...snake.conform.conformance import conform
from ...snake.conform.conforming import driven_curve
from ...snake.control.tip_control import DistalContext
from ...validate import whole, within
from .narrow import narrowest
from .offline.operators import inserted
from .offline.snake_drive import SnakeDrive
from .settings import FINEST_MM, DriveSettings
from .stepping.motion import TISSUE_RESERVE_MM
from .viewing import ViewLimits, WallSight, moved_wall

EVERY_MM = 10.0  # between two depths at which views are searched
TIMES_S = (0.0, 1.0, 2.0, 3.0)  # of a moving lumen at which a view is looked at: a breath of 4 s
_UNLIMITED = 20.0  # [rad/s] of the joints: no step of a shape is cut by it
_ATTEMPTS = 1  # to come again with other shapes, after the first hold
_SPARE_MM = 0.05  # inside of the bound ways are certified: a drive's shapes differ a little from those here
_WAY = 80  # configurations of a way at most
_SAME_VIEW, _SAME_MM = math.cos(math.radians(3.0)), 1.0  # cosine and distance of cameras that count as the same
_APART_MM = 4.0  # a place so near to one that is not viewed from a depth is not tried there
_BEHIND_MM, _AHEAD_MM, _ASIDE_MM = 25.0, 40.0, 55.0  # of the tip, and from it: places that are tried from a depth
_EYES_MM = (-20.0, -15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0)  # from the tip along the curve; see ``_in_sight``


@dataclass(frozen=True, eq=False)
class PlannedView:
    """A pose of the camera that the robot can take.

    tip_s: mm, arc length of the tip. bends: (n, 2L') rad off the conforming shape, the way there; the last one is the
    view, and none is the conforming shape itself. camera: (4, 4) transform_camera_to_patient at rest.
    """

    tip_s: float
    bends: Array
    camera: Array


@dataclass(frozen=True, eq=False)
class Viewable:
    """What a robot can view of a wall of F triangles.

    view: (F,) row in ``views`` from which a triangle's centroid is viewed best, -1: not viewable. error: (F,) of that
    view as of ``ViewLimits.error``, infinite where there is none: 0 is ideal, 1 at a tolerance.
    s_mm: (F,) arc length of each triangle along the driven curve, ``WallSight.arc_lengths``; area_mm2: (F,).
    depth_mm: that the tip reaches. counted: (F,) triangles of the wall between the entry and that depth, the
    denominator of ``share``.
    """

    views: tuple[PlannedView, ...]
    view: IntArray
    error: Array
    s_mm: Array
    area_mm2: Array
    depth_mm: float
    counted: BoolArray
    limits: ViewLimits

    @property
    def mask(self) -> BoolArray:
        """(F,) viewable triangles."""
        return self.view >= 0

    @property
    def share(self) -> float:
        """Viewable share, by area, of the wall between the entry and the depth that the tip reaches."""
        return self.share_between(0.0, math.inf)

    def share_between(self, low_mm: float, high_mm: float) -> float:
        """The same of the wall between two arc lengths; not a number where there is none."""
        part = self.counted & (self.s_mm >= low_mm) & (self.s_mm < high_mm)
        whole = float(self.area_mm2[part].sum())
        return float(self.area_mm2[part & self.mask].sum()) / whole if whole > 0.0 else math.nan

    def to_dict(self, bands: int = 10) -> dict[str, Any]:
        """JSON's types only; ``along``: the share in so many equal parts of the way."""
        edges = np.linspace(0.0, self.depth_mm, bands + 1).tolist()
        pairs = list(zip(edges[:-1], [*edges[1:-1], math.inf], strict=True))
        whole, *along = (self.share_between(low, high) for low, high in [(0.0, math.inf), *pairs])
        return {
            "share": None if math.isnan(whole) else whole, "area_mm2": float(self.area_mm2[self.counted].sum()),
            "depth_mm": self.depth_mm, "views": len(self.views),
            "along": [None if math.isnan(one) else one for one in along],
        }  # fmt: skip


def viewable_wall(
    mesh: TriangleMesh,
    pathway: Pathway,
    snake: SnakeModel,
    settings: DriveSettings | None = None,
    curve: Curve | None = None,
    slack: Array | None = None,
    *,
    limits: ViewLimits | None = None,
    every_mm: float = EVERY_MM,
    starts: int = 1,
    times_s: tuple[float, ...] = TIMES_S,
    progress: Callable[[float], None] | None = None,
) -> Viewable:
    """Which triangles of a wall the camera of a snake can view, and from where.

    A triangle that is not found viewable may be: the search is no proof. To put targets where the robot can view them,
    draw among the triangles with ``error`` ≤ 0.8 of ``Viewable.mask``; a target at the triangle's centroid is then
    viewed from ``views[view[triangle]]``: insert the straight robot to its ``tip_s``, then give its ``bends`` one after
    the other as ``SnakeCommand(bend=…)`` until each is reached.

    Args:
        mesh: the lumen's wall, consistently oriented. pathway: of the lumen; where it moves, a place counts that one
            bend views at rest and at all of ``times_s``, within the bounds less what the drive keeps for the tissue.
        snake: the whole robot. settings: bounds, and ``manipulated``, the links that bend.
        curve, slack: as for ``SnakeDrive``.
        limits: tolerances of a view; None: the paper's.
        every_mm: between two depths. starts: configurations from which a view of a place is searched, the nearest ones.
        progress: called with the share of the way that is done.

    Raises:
        InputError, PathwayError: as ``SnakeDrive``; a distance between depths of less than 0.01 mm.
    """
    within("the distance between two depths in mm", every_mm, FINEST_MM)
    starts = whole("the number of configurations to search from", starts, 1)
    if not times_s:
        raise InputError("a view is looked at one time at least: give times_s")
    times = tuple(times_s) if pathway.motion is not None else ()
    search = _Search(
        mesh, pathway, snake, settings or DriveSettings(), curve, slack, limits or ViewLimits(), times, starts
    )
    for share in search.along(every_mm):
        if progress is not None:
            progress(share)
    return search.found()


class _Moment(NamedTuple):
    """Pathway, curve and wall at one time."""

    packed: PackedPathway
    curve: Curve
    sight: WallSight


class _Rest(NamedTuple):
    """The conforming shape at a moment: base (4, 4), joints (2L,), and (L,) mm how deep each link may be then.

    bound: less what the drive keeps for the tissue, but not less than where the shape itself is; infinite where a link
    is not measured.
    """

    base: Array
    q: Array
    bound: Array


class _Reached(NamedTuple):
    """A configuration of the distal links (2L',) with its camera (4, 4) and the bends (n, 2L') that lead there."""

    q: Array
    camera: Array
    bends: tuple[Array, ...]


class _Search:
    """The search along the way of one robot."""

    def __init__(
        self,
        mesh: TriangleMesh,
        pathway: Pathway,
        snake: SnakeModel,
        settings: DriveSettings,
        curve: Curve | None,
        slack: Array | None,
        limits: ViewLimits,
        times_s: tuple[float, ...],
        starts: int,
    ) -> None:
        line, moves = driven_curve(pathway, curve), pathway.motion is not None
        settings = replace(
            settings, speed_max=_UNLIMITED, insertion_step_mm=settings.waypoint_mm, arm="certified", lock_bend=True,
        )  # fmt: skip
        still = pathway.moved(None)
        self._drive = SnakeDrive(snake, still, settings, line, None if moves else slack, longer_allowed=True)
        self._limits, self._reserve = limits, TISSUE_RESERVE_MM if moves else 0.0
        self._starts = starts
        self._moments = [
            _Moment(pathway.packed(t), pathway.curve(t), WallSight(moved_wall(mesh, pathway, t), pathway.curve(t)))
            for t in times_s
        ]
        self._wall = WallSight(mesh, line)
        self._line, self._s = line, self._wall.arc_lengths(line)
        self._curve = curve if line is curve else None
        count = len(mesh.faces)
        self._views: list[PlannedView] = []
        self._view, self._error = np.full(count, -1, dtype=np.int64), np.full(count, np.inf)
        points = self._drive.constants.distal_query.vertices.points
        self._points = np.array(points, dtype=np.float64, order="C")
        self._way = np.empty((_WAY, self._drive.distal.dof))
        self._depth = 0.0

    def along(self, every_mm: float) -> Any:
        """Search at depths, and yield the share of the way that is done after each."""
        drive = self._drive
        end = min(self._line.length, drive.snake.reach_mm())
        narrow = narrowest(drive.pathway, drive.snake, drive.settings.bound_mm, end, self._curve)
        if narrow.first is not None:
            end = 0.0 if narrow.free is None else narrow.free.at_mm
        for depth in [*np.arange(every_mm, end, every_mm).tolist(), end] if end > 0.0 else []:
            operator = inserted(depth, _ATTEMPTS)
            while (act := operator(drive.system, drive.state)) is not None:
                drive.act(act)
            self._depth = max(self._depth, drive.tip_s)
            self._here()
            yield depth / end
            if drive.tip_s < depth - 1e-6:
                break

    def found(self) -> Viewable:
        """The result."""
        used, place = np.unique(self._view, return_inverse=True)
        none = int(used[0] == -1)
        views = tuple(self._views[k] for k in used[none:])
        counted = (self._s >= 0.0) & (self._s <= self._depth)
        return Viewable(
            views, place - none, self._error, self._s, self._wall.area, self._depth, counted, self._limits
        )  # fmt: skip

    def _here(self) -> None:
        """Search views from the present depth."""
        drive = self._drive
        state, first = drive.state, drive.constants.first
        inside, context = state.pose.measured[first:], drive.distal_context()
        depth = np.minimum(state.deviation.depth[first:], context.bound)
        kept = np.where(inside, np.maximum(context.bound - self._reserve, depth), np.inf)
        bound = np.where(inside, np.maximum(context.bound - self._reserve - _SPARE_MM, depth), np.inf)
        lumen = DistalPathway(
            context.packed, context.query.blocks, context.window, context.base.copy(), context.rest.copy(), kept,
            drive.snake.q_max, drive.snake.length_mm,
        )  # fmt: skip
        free = np.repeat(inside, 2).astype(np.float64)
        straight = _Reached(context.rest, drive.distal.camera(context.rest, context.base), ())
        pool = [straight]
        cameras = np.empty((1, 3, 2))
        cameras[0] = straight.camera[:3, 2:]
        rests = self._rests()
        self._taken(straight, rests)
        places = self._in_sight() if inside.any() else np.empty(0, dtype=np.int64)
        left = np.ones(len(places), dtype=bool)
        near = cKDTree(self._wall.centre[places]) if len(places) else None
        for k in np.argsort(self._s[places], kind="stable"):
            triangle = int(places[k])
            if not left[k] or self._view[triangle] >= 0:
                continue
            point = self._wall.centre[triangle].copy()
            for j in self._nearest(cameras, point):
                reached = self._reached(lumen, context, bound, free, point, pool[j])
                if reached is None:
                    continue
                pool.append(reached)
                cameras = np.concatenate([cameras, reached.camera[None, :3, 2:]])
                self._taken(reached, rests)
                if self._view[triangle] >= 0:
                    break
            if self._view[triangle] < 0 and near is not None:
                left[near.query_ball_point(point, _APART_MM)] = False

    def _in_sight(self) -> IntArray:
        """Triangles near the tip that are not viewed yet and that can be seen from the curve about there."""
        tip_s, tip = self._drive.tip_s, self._drive.tip
        near = self._wall.near(tip, _ASIDE_MM)
        s = self._s[near]
        near = near[(s > tip_s - _BEHIND_MM) & (s < tip_s + _AHEAD_MM) & (self._view[near] < 0)]
        seen = np.zeros(len(near), dtype=bool)
        for ahead in _EYES_MM:
            eye = np.asarray(self._line.position(min(max(tip_s + ahead, 0.0), self._line.length)))
            rest = np.flatnonzero(~seen)
            seen[rest] = self._wall.free(eye, near[rest])
        return near[seen]

    def _nearest(self, cameras: Array, point: Array) -> list[int]:
        """Of cameras (n, 3, 2), their axes and places, those that are nearest to a view of a point."""
        ahead = point - cameras[:, :, 1]
        away = np.linalg.norm(ahead, axis=1)
        cosine = np.einsum("ij,ij->i", ahead, cameras[:, :, 0]) / away
        off = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) / self._limits.angle_deg
        error = off + np.abs(away - self._limits.distance_mm) / self._limits.distance_tolerance_mm
        found: list[int] = np.argsort(error, kind="stable")[: self._starts].tolist()
        return found

    def _reached(
        self, lumen: DistalPathway, context: DistalContext, bound: Array, free: Array, point: Array, start: _Reached
    ) -> _Reached | None:
        """The configuration nearest to a view of a point that a search from another one finds; None: no other one."""
        limits, drive = self._limits, self._drive
        goal = ViewGoal(
            point, limits.distance_mm, limits.distance_tolerance_mm, math.radians(limits.angle_deg),
            drive.snake.camera_offset_mm,
        )  # fmt: skip
        count, _ = view_path(lumen, self._points, goal, free, start.q, self._way)
        if not count:
            return None
        camera = drive.distal.camera(self._way[count - 1], context.base)
        cosine = float(camera[:3, 2] @ start.camera[:3, 2])
        if cosine > _SAME_VIEW and float(np.linalg.norm(camera[:3, 3] - start.camera[:3, 3])) < _SAME_MM:
            return None
        made = self._certified(context, bound, start.q, self._way[:count].copy())
        if not made:
            return None
        bends = (*start.bends, *(after - context.rest for after in made))
        return _Reached(made[-1], drive.distal.camera(made[-1], context.base), bends)

    def _certified(self, context: DistalContext, bound: Array, q: Array, way: Array) -> list[Array]:
        """Of a way (n, 2L') from q the certified part: its end alone where the straight motion there is."""

        def taken(one: Array, other: Array) -> bool:
            links = LinksAt(context.packed, context.window, Configuration(context.base, one), bound)
            return self._drive.distal_limits.certify(links, Configuration(context.base, other)).taken

        if taken(q, way[-1]):
            return [way[-1]]
        made: list[Array] = []
        for after in way:
            if not taken(q, after):
                break
            made.append(after)
            q = after
        return made

    def _rests(self) -> list[_Rest]:
        """The conforming shape at each moment."""
        drive, state = self._drive, self._drive.state
        shape, found = state.pose.shape, []
        for moment in self._moments:
            tip_s = min(shape.tip_s, moment.curve.length)
            moved = conform(drive.snake, moment.curve, tip_s, shape, None, shape.roll)
            frames = drive.snake.frames(moved.q, moved.base)
            depth = drive.query.deviations(moment.packed, frames, state.windows).depth
            bound = np.minimum(np.maximum(state.bound - self._reserve, depth), state.bound)
            found.append(_Rest(moved.base, moved.q, np.where(state.measured, bound, np.inf)))
        return found

    def _taken(self, reached: _Reached, rests: list[_Rest]) -> None:
        """Take note of what is viewed from a configuration."""
        triangles, error = self._wall.viewed(reached.camera, self._limits)
        for moment, rest in zip(self._moments, rests, strict=True):
            camera = self._bent(moment, rest, reached)
            if camera is None:
                return
            also, then = moment.sight.viewed(camera, self._limits)
            both, here, there = np.intersect1d(triangles, also, assume_unique=True, return_indices=True)
            triangles, error = both, np.maximum(error[here], then[there])
        better = error < self._error[triangles]
        triangles, error = triangles[better], error[better]
        if len(triangles):
            self._error[triangles], self._view[triangles] = error, len(self._views)
            bends = np.array(reached.bends).reshape(-1, self._drive.distal.dof)
            self._views.append(PlannedView(self._drive.tip_s, bends, reached.camera))

    def _bent(self, moment: _Moment, rest: _Rest, reached: _Reached) -> Array | None:
        """The camera at a moment with the same bend; None where a link is beyond its bound then."""
        drive = self._drive
        snake = drive.snake
        q = rest.q.copy()
        if len(reached.bends):
            q[2 * drive.constants.first :] += reached.bends[-1]
        q = snake.clamp(q)
        depth = drive.query.deviations(moment.packed, snake.frames(q, rest.base), drive.state.windows).depth
        if (depth > rest.bound).any():
            return None
        return snake.camera(q, rest.base)
