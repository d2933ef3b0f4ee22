"""What a drive through a lumen came to: summed up step by step."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ....anatomy.lumen.path_ends import PathEnds
from ....arrays import Array
from ....pathway.limits.link_bounds import BOUND_SHARE
from ....pathway.pathway import Pathway
from ....snake import NOTICE
from ..narrow import Narrowest, narrowest_values
from ..stepping.state import SnakeState
from .look_round import Retry, SideSeen

_STEERED = 0.05  # r below which ϑ means nothing
_TURNED = math.sin(math.radians(2.0))  # and of a view
_REASONS = 8  # most frequent reasons that are reported


@dataclass
class Visit:
    """A landmark: where it lies along the curve, whether the tip came there, and what the look-round needed.

    looked: whether the view was turned far enough to every side. turn_deg: how far round the hand's bend went, or the
    view where nothing is steered, as under the quadratic program; r_max: the largest r, None there. looked_from_mm,
    sides: of the look-round, if there was one.
    """

    name: str
    s_mm: float
    reached: bool = False
    looked: bool = False
    note: str = ""
    steps: int = 0
    turn_deg: float = 0.0
    r_max: float | None = 0.0
    deviation_max_mm: float = 0.0
    force_max_n: float = 0.0
    looked_from_mm: float | None = None
    sides: tuple[SideSeen, ...] = ()
    _theta: float | None = None

    def turned(self, steering: tuple[float, float] | None, view: tuple[float, float]) -> None:
        """One more step of the look-round: (u, v), None where nothing is steered, and where the camera looks to.

        view: (x, y) of the optical axis in the picture of the shape that conforms.
        """
        u, v = view if steering is None else steering
        size, theta = math.hypot(u, v), math.atan2(v, u)
        self.r_max = None if steering is None else max(self.r_max or 0.0, size)
        if size < (_TURNED if steering is None else _STEERED):
            self._theta = None
            return
        if self._theta is not None:
            self.turn_deg += math.degrees((theta - self._theta + math.pi) % (2.0 * math.pi) - math.pi)
        self._theta = theta

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        values = {key: value for key, value in vars(self).items() if not key.startswith("_")}
        values["sides"] = [asdict(side) for side in self.sides]
        return values


@dataclass
class DeviationTally:
    """Sums over the steps of a drive; only links that are inside the pathway count.

    bound: (L,) mm, the most that b_i is; what counts is b_i where the link is, of which ``least_bound`` (L,) is the
    least. outside: (L,) mm, the largest deviation of each link, NaN of links that were never inside.
    """

    q_max: float
    bound: Array
    total: float = 0.0
    measured: int = 0
    deepest: float = 0.0
    deepest_at: tuple[int, float] | None = None  # link, counted from 0, and the tip's place in mm
    most_beyond: float = -np.inf  # of any link beyond its bound, mm
    beyond: int = 0  # link-steps beyond a bound
    joint_limit_hits: int = 0
    fastest: float = 0.0  # [rad/s]
    seconds: float = 0.0  # of the robot's own time
    step_us: dict[str, list[float]] = field(default_factory=lambda: {"inserting": [], "looking": []})
    query_us: list[float] = field(default_factory=list)
    slowest_s: float = 0.0  # of a step, on the clock
    slowest_at_mm: float | None = None  # where the tip was then
    outcomes: dict[str, int] = field(default_factory=lambda: {"rest": 0, "moved": 0, "shrunk": 0, "held": 0})
    reasons: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.outside, self.least_bound = np.full(len(self.bound), np.nan), np.array(self.bound)

    def add(self, before: Array, state: SnakeState, dt: float, step_s: float = 0.0, query_s: float = 0.0) -> None:
        """One more step, from joints ``before``; it and a query of all links took so many s on the clock."""
        depth = state.deviation.depth[state.measured]
        self.total += float(depth.sum())
        self.measured += len(depth)
        if len(depth):
            over = depth - state.bound[state.measured]
            if depth.max() > self.deepest:
                self.deepest = float(depth.max())
                self.deepest_at = int(np.flatnonzero(state.measured)[depth.argmax()]), state.tip_s
            self.outside[state.measured] = np.fmax(self.outside[state.measured], depth)
            self.least_bound[state.measured] = np.minimum(self.least_bound, state.bound)[state.measured]
            self.most_beyond = max(self.most_beyond, float(over.max()))
            self.beyond += int((over > 0.0).sum())
        self.joint_limit_hits += int((np.abs(state.q) >= self.q_max - 1e-9).sum())
        self.fastest = max(self.fastest, float(np.abs(state.q - before).max()) / dt)
        self.seconds += dt
        self.outcomes[state.outcome] += 1
        if state.held_by is not None:
            self.reasons[_plain(state.held_by)] = self.reasons.get(_plain(state.held_by), 0) + 1
        if state.outcome != "rest":
            self.step_us[state.mode].append(1e6 * step_s)
        self.query_us.append(1e6 * query_s)
        if step_s > self.slowest_s:
            self.slowest_s, self.slowest_at_mm = step_s, state.tip_s

    @property
    def mean(self) -> float:
        """Of the deviation over all steps and links inside, mm."""
        return self.total / max(self.measured, 1)

    def most_frequent(self) -> dict[str, int]:
        """What held or shrank steps, and how often."""
        return dict(sorted(self.reasons.items(), key=lambda one: -one[1])[:_REASONS])


@dataclass(frozen=True, eq=False)
class DriveReport:
    """A finished drive; see ``to_dict`` for the keys."""

    links: int
    target_mm: float
    inserted_mm: float
    path_mm: float
    tally: DeviationTally
    visits: tuple[Visit, ...]
    outside_share: float
    outside_mm: tuple[float, float, float]
    offset_mm: tuple[float, float]
    refused_commands: int
    seconds: dict[str, float]
    settings: dict[str, Any]
    stopped_by: str | None
    retries: tuple[Retry, ...]
    operator: str
    robot_assumed: tuple[str, ...]
    warnings: tuple[str, ...]
    narrowest: Narrowest
    behind_wall: dict[str, Any]
    ends: PathEnds
    base: Array  # (3,) where the robot's base and its tip ended when it was inserted, LPS mm
    tip: Array
    pathway: Pathway = field(repr=False)
    withdrawn_mm: float | None = None
    between_vertices: dict[str, float] = field(default_factory=dict)

    @property
    def reached(self) -> bool:
        """Whether the tip came as far as it was to go."""
        return self.inserted_mm >= self.target_mm - 1e-6

    @property
    def within_bounds(self) -> bool:
        """Whether no link was ever beyond its bound."""
        return self.tally.beyond == 0

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only.

        deviation_mm: mean over all steps and links inside, and the largest. bound_mm: b_i of the last link and of the
        others at the most; bound_share: of the lumen's radius, that it is no more than; None where it is given;
        least_mm: the least that it was for each link. outside_pathway: the largest deviation, of which link, where its
        tip was, and of each link. joint_limit_hits: joint-steps at ± q_max. query_us, step_us: medians; slowest_step:
        s on the clock and where the tip was. pathway_outside: share of the
        pathway's surface that lies outside the lumen, and how far (median, 95 %, most): the pathway is not the wall.
        behind_wall: of the places of links past the path's start that were measured against the triangles themselves,
        the one deepest behind them, and of each link; its mm is None where the tissue moves. narrowest: see ``narrow``.
        between_vertices: how much deeper than its vertices, at which deviations and bounds are measured, the robot's
        surface can be (bound_mm, where the pathway is convex) and was (most_mm), see ``BetweenVertices``.
        withdrawn_mm: where the tip was after it was drawn back, None where it was not.
        start_lps_mm, end_lps_mm: of the path as driven, ``*_moved_mm`` from where they were asked for; base_lps_mm,
        tip_lps_mm: where the insertion ended.
        """
        tally = self.tally
        looking, inserting = tally.step_us["looking"], tally.step_us["inserting"]
        return {
            "links": self.links,
            "inserted_mm": float(self.inserted_mm),
            "withdrawn_mm": self.withdrawn_mm,
            "target_mm": float(self.target_mm),
            "path_mm": float(self.path_mm),
            "reached": self.reached,
            "start_lps_mm": list(self.ends.start),
            "start_moved_mm": self.ends.start_moved_mm,
            "end_lps_mm": list(self.ends.end),
            "end_moved_mm": self.ends.end_moved_mm,
            "base_lps_mm": self.base.tolist(),
            "tip_lps_mm": self.tip.tolist(),
            "deviation_mm": {"mean": float(tally.mean), "max": float(tally.deepest)},
            "bound_mm": {"body": float(tally.bound[0]) if self.links > 1 else None, "last": float(tally.bound[-1])},
            "bound_share": BOUND_SHARE if self.settings["bound_mm"] is None else None,
            "least_bound_mm": tally.least_bound.tolist(),
            "within_bounds": self.within_bounds,
            "outside_pathway": self._outside(),
            "behind_wall": self.behind_wall,
            "between_vertices": self.between_vertices,
            "beyond_bound_link_steps": tally.beyond,
            "joint_limit_hits": tally.joint_limit_hits,
            "joint_speed_max_deg_s": float(np.degrees(tally.fastest)),
            "query_us": _median(tally.query_us),
            "step_us": _median(looking + inserting),
            "step_us_inserting": _median(inserting),
            "step_us_looking": _median(looking),
            "slowest_step": {"s": float(tally.slowest_s), "tip_mm": tally.slowest_at_mm},
            "steps": {"inserting": len(inserting), "looking": len(looking)},
            "outcomes": dict(tally.outcomes),
            "held_by": tally.most_frequent(),
            "refused_commands": self.refused_commands,
            "joint_offset_mm": {"median": float(self.offset_mm[0]), "max": float(self.offset_mm[1])},
            "pathway_outside": {"share": float(self.outside_share), "depth_mm": [float(v) for v in self.outside_mm]},
            "landmarks": [visit.to_dict() for visit in self.visits],
            "robot_seconds": float(tally.seconds),
            "seconds": {key: float(value) for key, value in self.seconds.items()},
            "settings": self.settings,
            "stopped_by": self.stopped_by,
            "retries": [asdict(retry) | {"at_lps": list(retry.at_lps)} for retry in self.retries],
            "operator": self.operator,
            "robot_assumed": list(self.robot_assumed),
            "warnings": list(self.warnings),
            "narrowest": narrowest_values(self.narrowest),
            "notice": NOTICE,
        }

    def _outside(self) -> dict[str, Any]:
        """The largest deviation from the pathway, and that of each link; JSON's types."""
        link, tip = self.tally.deepest_at or (None, None)
        per_link = [None if math.isnan(mm) else mm for mm in self.tally.outside.tolist()]
        number = None if link is None else link + 1
        return {"mm": float(self.tally.deepest), "link": number, "tip_mm": tip, "per_link_mm": per_link}


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def _plain(reason: str) -> str:
    """A reason without its measured depth, so that equal ones are counted as one."""
    head, found, tail = reason.partition(" would be ")
    return f"{head}:{tail.partition(';')[2]}" if found else reason
