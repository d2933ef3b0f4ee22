"""Suggested path from an entry to a target for one tool: the tip's route, plans of the shaft, and their dry runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..anatomy.piercing import Piercing, Ways, piercing_of
from ..arrays import Array, IndexArray
from ..control import ControlSettings
from ..errors import StartRefused
from ..geometry.path import SplinePath
from ..geometry.shaft_directions import ShaftDirections, roll_of
from ..kernels.threads import threads
from ..progress import ProgressCallback, no_progress
from ..proximity.proximity import Proximity
from ..robots import RobotModel, Tool
from ..virtual_fixtures import Fixture, Zone
from ..worlds.rigid.dry_run import STATION_MM, TIGHT_MM, DryRun
from ..worlds.rigid.placing import place_robot
from .room import Passage, Room
from .shafts import Ranking, ranked_shafts
from .way import smoothed, widest_way

# Balanced first; the others prefer to spare soft tissue, or to keep away from bone.
RANKINGS = (Ranking(), Ranking(bone=1.0, depth=0.6, touched=0.3), Ranking(bone=20.0, depth=0.1, touched=0.03))
STEADY = 3  # plans with a constant orientation, in addition to those that vary it
_SAME_DEG = 3.0  # plans that differ by less than this everywhere count as the same
# Fractions of the work, for its progress: the way of the tip is found, and a first round of shafts is driven. Where all
# of these pierce tissue, a second round follows, which takes longer.
_WAY_FOUND, _FIRST_ROUND = 0.05, 0.4
_RANKED = 0.5  # fraction of a round that ranks, before it drives


@dataclass(frozen=True, eq=False)
class SearchSpace:
    """Surroundings of the tool. tree: the bone, for exact tests; room: bone and soft tissue as fields, for ranking.

    zones, fixtures, structure_names: as in ``Scene``. ways: search of air routes round tissue; None without a CT.
    """

    tree: Proximity
    room: Room
    zones: tuple[Zone, ...] = ()
    fixtures: tuple[Fixture, ...] = ()
    structure_names: Mapping[str, str] = field(default_factory=dict)
    ways: Ways | None = None


@dataclass(frozen=True, eq=False)
class Alternative:
    """A plan of path and shaft, and the result of its dry run.

    points: (m, 3) path points; directions (m, 3) of the shaft at each, from the tip towards the tail; rolls (m,) in
        rad of a bent tool, None of a straight one.
    base (4, 4), q_start: the placement; run: its dry run; passage: contact with soft tissue;
    piercing: how far air leads round that tissue, None where unknown.
    """

    points: Array
    directions: Array
    rolls: Array | None
    base: Array
    q_start: Array
    run: DryRun
    passage: Passage
    piercing: Piercing | None = None

    @property
    def pierces(self) -> bool:
        """Whether the tool pierces skin or a wall; such a plan is never suggested."""
        return self.piercing is not None and self.piercing.pierced is not None

    @property
    def least_clearance_mm(self) -> float:
        """Smallest distance of the whole tool to bone in the drive."""
        return float(self.run.clearance.min())

    @property
    def tightest_mm(self) -> float:
        """Arc length of the tip at the smallest distance."""
        return float(self.run.s[self.run.clearance.argmin()])

    def rank(self, margin_mm: float) -> tuple[bool, bool, float, bool, float, float, float]:
        """Sort key: plans that arrive first, then those that are not tight, then by the displayed measures.

        Those that pierce tissue come last of all.

        The measures are the length of the tool in soft tissue and its depth, as displayed (in mm and tenths), and for
        equal ones the bone clearance.
        """
        tight = self.least_clearance_mm < margin_mm + TIGHT_MM
        short = 0.0 if self.run.completed else -self.run.reached_mm
        length, depth = self.passage.tissue_mm or 0.0, self.passage.tissue_depth_mm or 0.0
        return (
            self.pierces,
            not self.run.completed,
            short,
            tight,
            round(length),
            round(depth, 1),
            -self.least_clearance_mm,
        )


@dataclass(frozen=True, eq=False)
class NoWay:
    """Reason why there is no path. ends_at: (3,) end of the route; gap_mm: its distance from the target.

    reason: in words; short: the same in at most nine words; searched: in words, what was searched.
    """

    ends_at: Array
    gap_mm: float
    reason: str
    short: str
    searched: str


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Alternatives, the best one first, which arrives; or the reason why there is none."""

    alternatives: tuple[Alternative, ...]
    none: NoWay | None = None


def suggest_path(
    around: SearchSpace,
    robot: RobotModel,
    tool: Tool,
    entry: ArrayLike,
    target: ArrayLike,
    settings: ControlSettings,
    tell: ProgressCallback = no_progress,
    routed: Callable[[Array], object] = len,
) -> Suggestion:
    """Find the widest route of the tip, and the plans of the shaft with the best dry runs.

    Args:
        tell: called with the stage in words and the completed fraction before each part; an exception from it ends
            the search.
        routed: called with the path points (m, 3) in LPS mm of every plan that follows, once they are known.

    Raises:
        InputError: entry or target cannot be used.
    """
    tell("Looking for the widest way of the tip", 0.0)
    way = widest_way(around.room, entry, target, float(tool.radius[0]), settings.kept_mm)
    searched = f"the air within 15 mm around entry and target, with room for a tip of {2.0 * tool.radius[0]:.1f} mm"
    if not way.reached:
        reason = f"{way.in_the_way} lies between the end of the widest way and the target"
        lies = "the scan ends" if way.in_the_way == "the end of the scan" else f"{way.in_the_way} lies"
        short = f"{lies} {way.gap_mm:.0f} mm before the target"
        if around.room.bone.at(np.asarray(target, dtype=np.float64)[None])[0] < 0.0:
            reason, short = "the target lies in bone", "the target lies in bone"
        return Suggestion((), NoWay(way.places[-1], way.gap_mm, reason, short, searched))
    first, second = _part(tell, _WAY_FOUND, _FIRST_ROUND), _part(tell, _FIRST_ROUND, 1.0)
    points = smoothed(way.places)
    routed(points)
    found = best_drives(around, robot, tool, points, settings, tell=first)
    if found and found[0].pierces:
        # Piercing is evaluated for each orientation, which takes longer than everything else.
        found = best_drives(around, robot, tool, points, settings, tell=second, ways=around.ways)
    clear = tuple(one for one in found if one.run.completed and not one.pierces)
    if clear:
        return Suggestion(clear)
    return Suggestion((), _none_arrives(found, tool, np.asarray(target, dtype=np.float64), way.places[0], searched))


def best_drives(
    around: SearchSpace,
    robot: RobotModel,
    tool: Tool,
    points: Array,
    settings: ControlSettings,
    rankings: tuple[Ranking, ...] = RANKINGS,
    steady: int = STEADY,
    tell: ProgressCallback = no_progress,
    ways: Ways | None = None,
) -> list[Alternative]:
    """Dry runs of a tool along a path (m, 3) with the best plans of its shaft, the best one first.

    ways: if given, plans that pierce tissue are avoided.
    The result is empty if the tool does not fit at the entry with any of them.
    """
    path = SplinePath(points)
    stations = _stations(path)
    stage = "Comparing directions of the shaft" if ways is None else "Looking for directions that pierce no tissue"
    ranking = partial(_part(tell, 0.0, _RANKED), stage)
    plans = ranked_shafts(around.room, tool, path, stations, settings.kept_mm, rankings, steady, ranking, ways)
    plans, driven = _different(plans, stations), list[Future[Alternative]]()
    unjudged = replace(around, ways=None)
    with threads(2) as beside:  # what one plan pierces is looked for while the next one is driven
        for number, plan in enumerate(plans):
            share = _RANKED + (1.0 - _RANKED) * number / len(plans)
            go_on = partial(tell, f"Simulating way {number + 1} of {len(plans)}", share)
            one = drive_plan(unjudged, robot, tool, path, plan, settings, go_on)
            if one is not None:
                driven.append(beside.submit(_with_piercing, one, around.ways))
        found = [one.result() for one in driven]
    return sorted(found, key=lambda one: one.rank(settings.kept_mm))


def drive_plan(
    around: SearchSpace,
    robot: RobotModel,
    tool: Tool,
    path: SplinePath,
    plan: ShaftDirections,
    settings: ControlSettings,
    go_on: Callable[[], object] = bool,
) -> Alternative | None:
    """Dry run of a path with a plan of its shaft, sampled at the path's points; None if it does not fit."""
    stations = _stations(path)
    frames, rolled = plan.frame(stations), plan.has_roll and tool.bend > 0.0
    rolls = np.array([roll_of(frame) for frame in frames]) if rolled else None
    shaft = ShaftDirections(stations, -frames[:, :, 1], rolls)
    try:
        placing = place_robot(
            around.tree, robot, tool, path, settings, around.zones, around.fixtures, go_on, around.structure_names,
            shaft=shaft,
        )  # fmt: skip
    except StartRefused:
        return None
    run = placing.run
    placed = robot.placed(placing.base, tool)
    tips = [placed.tip(run.q[row]) for row in _rows(run)]
    passage = around.room.passed(tool, np.stack([t.rotation for t in tips]), np.stack([t.position for t in tips]))
    one = Alternative(path.points, np.array(shaft.directions), rolls, placing.base, placing.q_start, run, passage)
    return _with_piercing(one, around.ways, go_on)


def _with_piercing(one: Alternative, ways: Ways | None, go_on: Callable[[], object] = bool) -> Alternative:
    if ways is None:
        return one
    run = one.run
    rows = np.union1d(_rows(run), [len(run.s) - 1]).tolist()
    return replace(one, piercing=piercing_of(ways, run.segments_start, run.segments_end, rows, go_on))


def _rows(run: DryRun) -> IndexArray:
    """Indices of the poses of a dry run at its stations."""
    rows: IndexArray = np.unique(np.rint(run.s / STATION_MM), return_index=True)[1]
    return rows


def _part(tell: ProgressCallback, begin: float, end: float) -> ProgressCallback:
    """Progress of a part of the work, which spans these fractions of the whole."""
    return lambda stage, fraction: tell(stage, begin + (end - begin) * fraction)


def _stations(path: SplinePath) -> Array:
    """Arc length of each of the path's points."""
    found = np.array([path.closest(point)[0] for point in path.points])
    found[0], found[-1] = 0.0, path.length
    return np.maximum.accumulate(found + 1e-9 * np.arange(len(found)))


def _different(plans: list[ShaftDirections], stations: Array) -> list[ShaftDirections]:
    """Remove plans that are nearly the same as an earlier one."""
    kept = list[ShaftDirections]()
    for plan in plans:
        frames = plan.frame(stations)
        if all(_apart_deg(frames, other.frame(stations), plan.has_roll) > _SAME_DEG for other in kept):
            kept.append(plan)
    return kept


def _apart_deg(first: Array, second: Array, with_roll: bool) -> float:
    """Largest angle between two sequences of frames (m, 3, 3), of the shafts only without roll."""
    if with_roll:
        cosine = 0.5 * (np.einsum("nij,nij->n", first, second) - 1.0)
    else:
        cosine = np.einsum("ni,ni->n", first[:, :, 1], second[:, :, 1])
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)).max()))


def _none_arrives(found: list[Alternative], tool: Tool, target: Array, entry: Array, searched: str) -> NoWay:
    """Reason for the case that the tip has a route but the tool has none."""
    searched = f"{searched}; directions of the shaft along it for {tool.title}"
    if not found:
        short = "the tool does not fit at the entry"
        return NoWay(entry, float(np.linalg.norm(target - entry)), short, short, searched)
    best = max(found, key=lambda one: one.run.reached_mm)
    end = best.run.tip[-1]
    gap = float(np.linalg.norm(target - end))
    if best.run.completed:
        reason = "the tip has a way, and the tool pierces skin or a wall between two air spaces in each that gets there"
        return NoWay(end, gap, reason, "the tool would pierce skin or a wall", searched)
    reason = f"the tip has a way, the tool gets {best.run.reached_mm:.0f} of {best.run.length_mm:.0f} mm: "
    return NoWay(end, gap, reason + best.run.reason, f"the tool stops {gap:.0f} mm before the target", searched)
