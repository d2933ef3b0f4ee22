"""Whether a tool pierces tissue: how far sideways air leads round each run of tissue that its axis passes.

A tool that slides along a nostril passes tissue too, and as much of it as one that goes through the tip of the nose:
the depth of a thin wall says nothing. What separates is local. Where the tissue gives way, air leads round it close to
the axis; where the tool goes through a wall, the way through air is long, or there is none.
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

WIDE_MM = 2.0  # of the air that counts as a way
ENTRY_MM = 20.0  # of the entry: vestibule and rim of the nose, which give way further
GIVES_MM, GIVES_AT_ENTRY_MM = 5.0, 8.0  # what tissue gives, assumed
_SAMPLE_MM = 0.25  # along the axis
_ROOM_WITHIN_MM = 5.0  # of the tissue, along the axis: in a groove of the skin the ball has no room
_MOVED_MM = 0.5  # an end of the axis in two steps of a recording that are judged apart, at least
_EVERY = 4  # samples: of the axis, where its motion is measured
_AHEAD_MM = 10.0  # of the tip, as far as the axis goes on for a tool that slides along itself
_NO_RUN_MM = 5.0  # what a verdict lacks at most
_SHARE = 0.75  # of what a verdict lacks to change, by which the axis may move without being judged
_LEAST_MM = 0.05  # it may move at least: the accuracy of a way round


@dataclass(frozen=True)
class TissueRun:
    """Tissue that the axis passes in one pose; lengths in mm, places (3,) in LPS.

    sideways_mm: within which air of 2 mm leads round it; inf beyond 15 mm, None where the scan ends before that is
    known. gives_mm: what the tissue gives there. begin, end: of the tissue on the axis, from outside to inside.
    outside, inside: the air on both sides; 'tip' where the tool ends in the tissue. steady_mm: how far the axis may
    move sideways until the tissue may be pierced that is not, or the other way round.
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
        """What the tissue does not give; negative where it gives enough, or where that is not known."""
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
    """The runs of tissue in one pose. known: the scan shows the axis from the room's air on, and each way round."""

    runs: tuple[TissueRun, ...]
    known: bool

    @property
    def worst(self) -> TissueRun | None:
        """The run that is pierced most: those at the room's air first, then by what exceeds the tissue's giving."""
        judged = [run for run in self.runs if run.sideways_mm is not None]
        return max(judged, key=_gravity, default=None)


@dataclass(frozen=True, eq=False)
class Piercing:
    """The runs of tissue over a series of poses.

    rows (m,): of the poses that were judged: between them no verdict can change. sideways_mm, over_mm (m,): of the
    worst run in each, how far air leads round it and what of that the tissue does not give; 0 and -inf where there is
    no run. worst, row: the gravest run of all, and its pose; None where the axis passes no tissue. known: of all poses.
    """

    rows: IndexArray
    sideways_mm: Array
    over_mm: Array
    worst: TissueRun | None
    row: int | None
    known: bool

    @property
    def pierced(self) -> TissueRun | None:
        """The gravest run that is pierced; None where none is."""
        return self.worst if self.worst is not None and self.worst.pierced else None


class Ways:
    """Looks for ways round tissue in one head.

    Args:
        tissue: signed distance to skin, mucosa and bone, without what is opened by hand. air: what air is the room's.
        entry: (3,) where the path begins.
    """

    def __init__(self, tissue: DistanceField, air: RoomAir, entry: npt.ArrayLike) -> None:
        self._fine, self._whole = _grid(tissue.grids[0]), _grid(tissue.grids[-1])
        self._kinds = (air.kinds, np.asarray(air.origin, dtype=np.float64), float(air.step_mm))
        self.entry = np.asarray(entry, dtype=np.float64)
        self.has_room, self.middle_mm = air.has_room, air.middle_mm

    def of_pose(self, start: Array, end: Array) -> PoseWays:
        """The runs in a pose with axis segments (S, 3), from the tip on, as `Tool.segments` returns them."""
        points = _axis(start, end)
        return self.of_axis(points, self.kinds(points))

    def kinds(self, points: Array) -> Kinds:
        """Of points (n, 3) of an axis: TISSUE, AIR, ROOM or UNKNOWN; air of less than 2 mm counts as tissue."""
        found: Kinds = kinds_along(self._fine, self._whole, self._kinds, points, 0.5 * WIDE_MM)
        return found

    def of_axis(self, points: Array, kinds: Kinds) -> PoseWays:
        """The runs of an axis of points (n, 3), 0.25 mm apart from the tip on, of which the kinds are known."""
        stretches = list(_stretches(kinds))
        known, runs = self.has_room and _from_room(kinds), list[TissueRun]()
        for number, (kind, first, last) in enumerate(stretches):
            if kind != TISSUE or number + 1 == len(stretches) or stretches[number + 1][0] == UNKNOWN:
                continue  # towards the tail: no air
            if number and stretches[number - 1][0] == UNKNOWN:
                known = False
                continue
            outer, inner = _beside(kinds, last + 1, 1), _beside(kinds, first - 1, -1)
            outside, inside = _ends(kinds, outer), _ends(kinds, inner) if len(inner) else "tip"
            if inside == "tip" and outside != "room":
                continue  # the tip in a wall of the airway: told as the depth of the tool in soft tissue
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
            # Between both limits the verdict must not hang on which of two places, as far from the axis, is met last.
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
        """As `way_round`. tissue: (n, 3) of the axis; distances beside what gives less count as longer by that."""
        less = 0.0 if tissue is None else GIVES_AT_ENTRY_MM - GIVES_MM
        gives = nodes[0] if tissue is None else np.ascontiguousarray(tissue), self.entry, ENTRY_MM, less
        fields = self._fine, self._whole, self._kinds
        found: Array = way_round(*fields, *nodes, *sides, 0.5 * WIDE_MM, through, gives)
        return found


def piercing_of(
    ways: Ways, start: Array, end: Array, rows: Iterable[int], go_on: Callable[[], object] = bool
) -> Piercing:
    """The runs of tissue of a tool over poses with axis segments (n, S, 3).

    rows: of the poses to look at, in order; those in which the verdict cannot have changed since the last judged
    one are passed over. go_on: called before each pose; what it raises ends the work.
    A way is longer by no more than the axis has moved sideways, so a pose is judged again where that is three
    quarters of the least `TissueRun.steady_mm`, or where the axis passes other tissue than before.
    """
    watch = PiercingWatch(ways)
    for row in rows:
        go_on()
        watch.add(row, start[row], end[row])
    return watch.found


class PiercingWatch:
    """The runs of tissue of a tool that moves, pose by pose, as `piercing_of` finds them."""

    def __init__(self, ways: Ways) -> None:
        self._ways, self._last = ways, _Judged()
        self._rows, self._poses = list[int](), list[PoseWays]()

    def add(self, row: int, start: Array, end: Array) -> None:
        """Judge a pose with axis segments (S, 3) and the number `row`, unless its verdict cannot be another one."""
        points = _axis(start, end)
        kinds = self._ways.kinds(points)
        if self._last.may_differ(points, kinds):
            pose = self._ways.of_axis(points, kinds)
            self._rows.append(row)
            self._poses.append(pose)
            self._last = _Judged(points, _pattern(kinds), _may_move(pose))

    @property
    def sideways_mm(self) -> float:
        """How far air leads round the worst tissue now: 0 where there is none, inf beyond 15 mm, NaN if not known."""
        if not self._poses:
            return np.nan
        pose = self._poses[-1]
        if pose.worst is not None and (pose.known or pose.worst.pierced):
            return float(pose.worst.sideways_mm or 0.0)
        return 0.0 if pose.known else np.nan

    @property
    def found(self) -> Piercing:
        """What was found so far."""
        worst = [(pose.worst, row) for pose, row in zip(self._poses, self._rows, strict=True)]
        runs = [(run, row) for run, row in worst if run is not None]
        gravest, at = max(runs, key=lambda one: _gravity(one[0]), default=(None, None))
        sideways = np.array([0.0 if run is None else run.sideways_mm for run, _ in worst], dtype=np.float64)
        over = np.array([-np.inf if run is None else run.over_mm for run, _ in worst])
        known = all(pose.known for pose in self._poses)
        return Piercing(np.array(self._rows, dtype=np.intp), sideways, over, gravest, at, known)


class SidewaysColumn:
    """How far air leads round what a tool passes, for every step of a drive: a reading beside those of the system.

    A step is looked at where an end of the tool's axis has moved by 0.5 mm since the last one that was.
    """

    def __init__(self, ways: Ways) -> None:
        self._watch, self._last, self._steps = PiercingWatch(ways), np.full((2, 1, 3), np.inf), 0

    def add(self, start: Array, end: Array) -> float:
        """Of a step with axis segments (S, 3), in mm, as `PiercingWatch.sideways_mm`."""
        ends = np.stack([start, end])
        if np.abs(ends - self._last).max() >= _MOVED_MM:
            self._watch.add(self._steps, start, end)
            self._last = ends
        self._steps += 1
        return self._watch.sideways_mm

    @property
    def found(self) -> Piercing:
        """What was found so far; its rows are numbers of steps."""
        return self._watch.found


class _Judged(NamedTuple):
    """The pose that was judged last: its axis, what that passes, and how far it may move until it is judged anew."""

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

    Where all of it is near the entry, it is so until the axis has moved to that border; where all of it is farther,
    too. Else it may give the lesser of both, or the greater, at any place of another way round.
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
    """Points (n, 3) along a tool's axis from its tip on, at most 0.25 mm apart."""
    parts = []
    for a, b in zip(end, start, strict=True):  # a segment ends at its front
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / _SAMPLE_MM)))
        parts.append(a + (np.arange(count) / count)[:, None] * (b - a))
    return np.ascontiguousarray(np.concatenate([*parts, start[-1:]]))


def _thinned(points: Array) -> Array:
    """The corners (m, 3) of a polyline whose points lie on a few straight lines."""
    ways = np.diff(points, axis=0)
    size = np.linalg.norm(ways, axis=1)
    ways, kept = ways[size > 0.0] / size[size > 0.0, None], np.flatnonzero(np.r_[True, size > 0.0])
    turns = np.flatnonzero(np.einsum("ij,ij->i", ways[1:], ways[:-1]) < 1.0 - 1e-9) + 1
    return np.ascontiguousarray(points[kept[np.r_[0, turns, len(kept) - 1]]])


def _stretches(kinds: Kinds) -> Iterator[tuple[int, int, int]]:
    """Stretches of one kind, the two airs taken as one: kind, first and last index."""
    same = np.where(kinds == ROOM, AIR, kinds)
    borders = np.flatnonzero(np.diff(same)) + 1
    for first, after in zip(np.r_[0, borders], np.r_[borders, len(same)], strict=True):
        yield int(same[first]), int(first), int(after) - 1


def _beside(kinds: Kinds, first: int, step: int) -> IndexArray:
    """IndexArray of the air that begins at an index and goes on in a direction, at most 15 mm of it."""
    found, most = list[int](), int(WINDOW_MM / _SAMPLE_MM)
    while 0 <= first < len(kinds) and kinds[first] in (AIR, ROOM) and len(found) < most:
        found.append(first)
        first += step
    return np.array(found, dtype=np.intp)


def _ends(kinds: Kinds, beside: IndexArray) -> PiercingEnd:
    near = beside[: int(_ROOM_WITHIN_MM / _SAMPLE_MM)]
    return "room" if (kinds[near] == ROOM).any() else "body"


def _from_room(kinds: Kinds) -> bool:
    """Whether what the scan shows of the axis begins, from the tail on, in air that reaches the room's."""
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
