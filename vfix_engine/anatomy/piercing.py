"""Detection of pierced tissue: how far sideways air leads round each run of tissue that a tool's axis passes.

A tool that slides along a nostril passes tissue too, and as much of it as one that goes through the tip of the nose:
the depth in a thin wall is no criterion. The distinction is local. Where the tissue yields, air leads round it close to
the axis; where the tool goes through a wall, the route through air is long, or there is none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.room_air import RoomAir
from vfix_engine.anatomy.way_round_kernel import (
    AIR,
    ROOM,
    TISSUE,
    UNKNOWN,
    WINDOW_MM,
    kinds_along,
    way_round,
)
from vfix_engine.arrays import Array, IndexArray
from vfix_engine.proximity.fields.distance_field import DistanceField, FieldGrid

Kinds = npt.NDArray[np.uint8]
PiercingEnd = Literal["room", "body", "tip"]

WIDE_MM = 2.0  # width of air that counts as a route
ENTRY_MM = 20.0  # radius around the entry: vestibule and rim of the nose, which yield more
GIVES_MM, GIVES_AT_ENTRY_MM = 5.0, 8.0  # assumed displacement by which tissue yields
_SAMPLE_MM = 0.25  # along the axis
_ROOM_WITHIN_MM = 5.0  # of the tissue, along the axis: in a groove of the skin the ball does not fit
_MOVED_MM = 0.5  # smallest motion of an end of the axis between two evaluated steps of a recording
_EVERY = 4  # samples of the axis between those at which its motion is measured
_AHEAD_MM = 10.0  # extension of the axis beyond the tip, for a tool that slides along itself
_NO_RUN_MM = 5.0  # upper bound of the distance to a change of the verdict
_SHARE = 0.75  # fraction of that distance by which the axis may move without a new evaluation
_LEAST_MM = 0.05  # smallest such motion: the accuracy of the route's distance


@dataclass(frozen=True)
class TissueRun:
    """Tissue that the axis passes in one pose; lengths in mm, positions (3,) in LPS.

    sideways_mm: distance within which air of 2 mm leads round it; inf beyond 15 mm, None if the scan ends before that
    is known. gives_mm: displacement by which the tissue yields there. begin, end: of the tissue on the axis, from
    outside to inside. outside, inside: the air on both sides; 'tip' if the tool ends in the tissue. steady_mm: sideways
    motion of the axis up to which the verdict (pierced or not) cannot change.
    """

    sideways_mm: float | None
    gives_mm: float
    begin: tuple[float, float, float]
    end: tuple[float, float, float]
    outside: PiercingEnd
    inside: PiercingEnd
    steady_mm: float = 0.0

    @property
    def over_mm(self) -> float:
        """Excess over the displacement by which the tissue yields; negative if it yields enough, or if unknown."""
        return -np.inf if self.sideways_mm is None else self.sideways_mm - self.gives_mm

    @property
    def pierced(self) -> bool:
        return self.over_mm > 0.0

    @property
    def from_room(self) -> bool:
        """Whether the air at one of its ends is the room's."""
        return "room" in (self.outside, self.inside)


@dataclass(frozen=True)
class PoseWays:
    """The runs of tissue in one pose. known: the scan shows the axis from the room's air on, and every route round."""

    runs: tuple[TissueRun, ...]
    known: bool

    @property
    def worst(self) -> TissueRun | None:
        """The most severe run: those at the room's air first, then by the excess over the yield."""
        judged = [run for run in self.runs if run.sideways_mm is not None]
        return max(judged, key=_gravity, default=None)


@dataclass(frozen=True, eq=False)
class Piercing:
    """The runs of tissue over a series of poses.

    rows (m,): indices of the evaluated poses; between them no verdict can change. sideways_mm, over_mm (m,): of the
    worst run in each, the distance of the route through air and its excess over the yield; 0 and -inf if there is
    no run.
    worst, row: the most severe run of all, and its pose; None if the axis passes no tissue. known: of all poses.
    """

    rows: IndexArray
    sideways_mm: Array
    over_mm: Array
    worst: TissueRun | None
    row: int | None
    known: bool

    @property
    def pierced(self) -> TissueRun | None:
        """The most severe pierced run; None if none is."""
        return self.worst if self.worst is not None and self.worst.pierced else None


class Ways:
    """Search of routes round tissue in one head.

    Args:
        tissue: signed distance to skin, mucosa and bone, without planned bone removal. air: classification of the air.
        entry: (3,) start of the path.
    """

    def __init__(self, tissue: DistanceField, air: RoomAir, entry: npt.ArrayLike) -> None:
        self._fine, self._whole = _grid(tissue.grids[0]), _grid(tissue.grids[-1])
        self._kinds = (air.kinds, np.asarray(air.origin, dtype=np.float64), float(air.step_mm))
        self.entry = np.asarray(entry, dtype=np.float64)
        self.has_room, self.middle_mm = air.has_room, air.middle_mm

    def of_pose(self, start: Array, end: Array) -> PoseWays:
        """Runs in a pose with axis segments (S, 3), from the tip on, as `Tool.segments` returns them."""
        points = _axis(start, end)
        return self.of_axis(points, self.kinds(points))

    def kinds(self, points: Array) -> Kinds:
        """Classify points (n, 3) of an axis: TISSUE, AIR, ROOM or UNKNOWN; air narrower than 2 mm counts as tissue."""
        found: Kinds = kinds_along(self._fine, self._whole, self._kinds, points, 0.5 * WIDE_MM)
        return found

    def of_axis(self, points: Array, kinds: Kinds) -> PoseWays:
        """Runs of an axis of classified points (n, 3), 0.25 mm apart from the tip on."""
        stretches = list(_stretches(kinds))
        known, runs = self.has_room and _from_room(kinds), list[TissueRun]()
        for number, (kind, first, last) in enumerate(stretches):
            if kind != TISSUE or number + 1 == len(stretches) or stretches[number + 1][0] == UNKNOWN:
                continue  # no air towards the tail
            if number and stretches[number - 1][0] == UNKNOWN:
                known = False
                continue
            outer, inner = _beside(kinds, last + 1, 1), _beside(kinds, first - 1, -1)
            outside, inside = _ends(kinds, outer), _ends(kinds, inner) if len(inner) else "tip"
            if inside == "tip" and outside != "room":
                continue  # the tip is in a wall of the airway, which is reported as its depth in soft tissue
            run = self._run(points, first, last, outer, inner, (outside, inside))
            known &= run.sideways_mm is not None
            runs.append(run)
        return PoseWays(tuple(runs), known)

    def _run(
        self,
        points: Array,
        first: int,
        last: int,
        outer: IndexArray,
        inner: IndexArray,
        ends: tuple[PiercingEnd, PiercingEnd],
    ) -> TissueRun:
        window = int(WINDOW_MM / _SAMPLE_MM)
        around = _thinned(points[max(first - window, 0) : last + window + 1])
        nodes, sides = (_thinned(points), around), (points[outer], points[inner])
        found = self._way(nodes, sides, through=False)
        along = points[first : last + 1]
        there = along[np.linalg.norm(along - found[2:5], axis=1).argmin()] if found[2] == found[2] else along[-1]
        near = np.linalg.norm(there - self.entry) <= ENTRY_MM
        if GIVES_MM < found[0] <= GIVES_AT_ENTRY_MM:
            # Between both limits the verdict must not depend on which of two equally distant points is visited last.
            counted = self._way(nodes, sides, through=False, tissue=along)
            near = counted[0] <= GIVES_AT_ENTRY_MM
        gives = GIVES_AT_ENTRY_MM if near else GIVES_MM
        hidden = found[0] > gives and found[1] > 0.0 and self._way(nodes, sides, through=True)[0] <= gives
        begin, end = _triple(points[last]), _triple(points[first])
        steady = _steady(float(found[0]), found[0] > gives, np.linalg.norm(along - self.entry, axis=1))
        return TissueRun(None if hidden else float(found[0]), gives, begin, end, *ends, steady)

    def _way(
        self, nodes: tuple[Array, Array], sides: tuple[Array, Array], through: bool, tissue: Array | None = None
    ) -> Array:
        """As `way_round`. tissue: (n, 3) of the axis; distances beside tissue that yields less are larger by that."""
        less = 0.0 if tissue is None else GIVES_AT_ENTRY_MM - GIVES_MM
        gives = nodes[0] if tissue is None else np.ascontiguousarray(tissue), self.entry, ENTRY_MM, less
        fields = self._fine, self._whole, self._kinds
        found: Array = way_round(*fields, *nodes, *sides, 0.5 * WIDE_MM, through, gives)
        return found


def piercing_of(
    ways: Ways, start: Array, end: Array, rows: Iterable[int], go_on: Callable[[], object] = bool
) -> Piercing:
    """Runs of tissue of a tool over poses with axis segments (n, S, 3).

    rows: indices of the poses to evaluate, in order; those in which the verdict cannot have changed since the last
    evaluated one are skipped. go_on: called before each pose; an exception from it ends the work.
    A route lengthens by at most the sideways motion of the axis, so a pose is evaluated again when that reaches three
    quarters of the smallest `TissueRun.steady_mm`, or when the axis passes other tissue than before.
    """
    watch = PiercingWatch(ways)
    for row in rows:
        go_on()
        watch.add(row, start[row], end[row])
    return watch.found


class PiercingWatch:
    """Incremental version of `piercing_of` for a moving tool, pose by pose."""

    def __init__(self, ways: Ways) -> None:
        self._ways, self._last = ways, _Judged()
        self._rows, self._poses = list[int](), list[PoseWays]()

    def add(self, row: int, start: Array, end: Array) -> None:
        """Evaluate a pose with axis segments (S, 3) and the index `row`, unless its verdict cannot have changed."""
        points = _axis(start, end)
        kinds = self._ways.kinds(points)
        if self._last.may_differ(points, kinds):
            pose = self._ways.of_axis(points, kinds)
            self._rows.append(row)
            self._poses.append(pose)
            self._last = _Judged(points, _pattern(kinds), _may_move(pose))

    @property
    def sideways_mm(self) -> float:
        """Distance of the air route round the worst tissue now: 0 without tissue, inf beyond 15 mm, NaN if unknown."""
        if not self._poses:
            return np.nan
        pose = self._poses[-1]
        if pose.worst is not None and (pose.known or pose.worst.pierced):
            return float(pose.worst.sideways_mm or 0.0)
        return 0.0 if pose.known else np.nan

    @property
    def found(self) -> Piercing:
        """Return the result so far."""
        worst = [(pose.worst, row) for pose, row in zip(self._poses, self._rows, strict=True)]
        runs = [(run, row) for run, row in worst if run is not None]
        gravest, at = max(runs, key=lambda one: _gravity(one[0]), default=(None, None))
        sideways = np.array([0.0 if run is None else run.sideways_mm for run, _ in worst], dtype=np.float64)
        over = np.array([-np.inf if run is None else run.over_mm for run, _ in worst])
        known = all(pose.known for pose in self._poses)
        return Piercing(np.array(self._rows, dtype=np.intp), sideways, over, gravest, at, known)


class SidewaysColumn:
    """Distance of the air route round the tissue that a tool passes, for every step of a drive, beside its row.

    A step is evaluated if an end of the tool's axis has moved by 0.5 mm since the last evaluated one.
    """

    def __init__(self, ways: Ways) -> None:
        self._watch, self._last, self._steps = PiercingWatch(ways), np.full((2, 1, 3), np.inf), 0

    def add(self, start: Array, end: Array) -> float:
        """Value in mm for a step with axis segments (S, 3), as `PiercingWatch.sideways_mm`."""
        ends = np.stack([start, end])
        if np.abs(ends - self._last).max() >= _MOVED_MM:
            self._watch.add(self._steps, start, end)
            self._last = ends
        self._steps += 1
        return self._watch.sideways_mm

    @property
    def found(self) -> Piercing:
        """Return the result so far; its rows are step numbers."""
        return self._watch.found


class _Judged(NamedTuple):
    """The last evaluated pose: its axis, the tissue it passes, and the motion up to which it need not be repeated."""

    points: Array | None = None
    pattern: tuple[int, ...] = ()
    may_move_mm: float = 0.0

    def may_differ(self, points: Array, kinds: Kinds) -> bool:
        if self.points is None or _pattern(kinds) != self.pattern:
            return True
        inside = np.flatnonzero(kinds == TISSUE)
        if not len(inside):
            return False
        here, there = points[: inside[-1] + 1 : _EVERY], _thinned(self.points)
        if kinds[0] != TISSUE:  # a tool that slides along itself passes the same tissue
            ahead = there[0] - there[1]
            there = np.vstack([there[0] + _AHEAD_MM * ahead / np.linalg.norm(ahead), there])
        return float(_to_polyline(here, there).max()) > self.may_move_mm


def _may_move(pose: PoseWays) -> float:
    return max(_LEAST_MM, _SHARE * min([*(run.steady_mm for run in pose.runs), _NO_RUN_MM]))


def _steady(sideways: float, pierced: bool, from_entry: Array) -> float:
    """`TissueRun.steady_mm` of tissue whose points lie at distances (n,) from the entry.

    If all of it is near the entry, this holds until the axis has moved to that border; likewise if all of it is
    farther. Otherwise the smaller or the larger yield may apply at any point of another route.
    """
    if pierced:
        gives_less = min(from_entry.min() - ENTRY_MM, sideways - GIVES_MM)
        return float(max(sideways - GIVES_AT_ENTRY_MM, gives_less, 0.0))
    gives_more = min(ENTRY_MM - from_entry.max(), GIVES_AT_ENTRY_MM - sideways)
    return float(max(GIVES_MM - sideways, gives_more, 0.0))


def _pattern(kinds: Kinds) -> tuple[int, ...]:
    return tuple(kind for kind, _, _ in _stretches(kinds))


def _to_polyline(points: Array, corners: Array) -> Array:
    """Distance (n,) of points (n, 3) to a polyline (m, 3)."""
    a, d = corners[:-1], np.diff(corners, axis=0)
    share = np.einsum("nsk,sk->ns", points[:, None] - a, d) / np.einsum("sk,sk->s", d, d)
    away = points[:, None] - a - np.clip(share, 0.0, 1.0)[..., None] * d
    least: Array = np.linalg.norm(away, axis=2).min(axis=1)
    return least


def _gravity(run: TissueRun) -> tuple[bool, float]:
    return run.pierced and run.from_room, run.over_mm


def _axis(start: Array, end: Array) -> Array:
    """Points (n, 3) along a tool's axis from its tip on, with a spacing of at most 0.25 mm."""
    parts = []
    for a, b in zip(end, start, strict=True):  # a segment ends at its front
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / _SAMPLE_MM)))
        parts.append(a + (np.arange(count) / count)[:, None] * (b - a))
    return np.ascontiguousarray(np.concatenate([*parts, start[-1:]]))


def _thinned(points: Array) -> Array:
    """Corners (m, 3) of a polyline whose points lie on few straight lines."""
    ways = np.diff(points, axis=0)
    size = np.linalg.norm(ways, axis=1)
    ways, kept = ways[size > 0.0] / size[size > 0.0, None], np.flatnonzero(np.r_[True, size > 0.0])
    turns = np.flatnonzero(np.einsum("ij,ij->i", ways[1:], ways[:-1]) < 1.0 - 1e-9) + 1
    return np.ascontiguousarray(points[kept[np.r_[0, turns, len(kept) - 1]]])


def _stretches(kinds: Kinds) -> Iterator[tuple[int, int, int]]:
    """Intervals of the same kind, where both airs count as one: kind, first and last index."""
    same = np.where(kinds == ROOM, AIR, kinds)
    borders = np.flatnonzero(np.diff(same)) + 1
    for first, after in zip(np.r_[0, borders], np.r_[borders, len(same)], strict=True):
        yield int(same[first]), int(first), int(after) - 1


def _beside(kinds: Kinds, first: int, step: int) -> IndexArray:
    """Indices of the air that begins at an index and continues in a direction, up to 15 mm."""
    found, most = list[int](), int(WINDOW_MM / _SAMPLE_MM)
    while 0 <= first < len(kinds) and kinds[first] in (AIR, ROOM) and len(found) < most:
        found.append(first)
        first += step
    return np.array(found, dtype=np.intp)


def _ends(kinds: Kinds, beside: IndexArray) -> PiercingEnd:
    near = beside[: int(_ROOM_WITHIN_MM / _SAMPLE_MM)]
    return "room" if (kinds[near] == ROOM).any() else "body"


def _from_room(kinds: Kinds) -> bool:
    """Whether the visible part of the axis begins, from the tail on, in air connected to the room's."""
    shown = np.flatnonzero(kinds != UNKNOWN)
    if not len(shown):
        return False
    tissue = np.flatnonzero(kinds == TISSUE)
    outermost = kinds[tissue[-1] + 1 :] if len(tissue) else kinds
    return bool((outermost == ROOM).any())


def _grid(grid: FieldGrid) -> tuple[npt.NDArray[np.float32], Array, float]:
    return grid.values, grid.origin, float(grid.step_mm)


def _triple(place: Array) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
