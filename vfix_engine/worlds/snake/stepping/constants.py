"""The constants of a snake's drive: robot, lumen, queries, certificates and planner."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from ....arrays import Array, BoolArray, IntArray
from ....errors import InputError
from ....geometry.curve import Curve
from ....pathway.limits.limits import Configuration, HardLimits, LinksAt, MotionVerdict
from ....pathway.limits.link_bounds import LinkBounds, inscribed_radii
from ....pathway.pathway import Pathway
from ....pathway.query.query import Deviations, Query
from ....robots.snake import SnakeModel
from ....runtime.system import Certificate
from ....snake.conform.conformance import Insertion
from ....snake.conform.conforming import driven_curve
from ....snake.control.projection import projected_to_limits
from ....snake.control.tip_control import DistalContext
from ....snake.haptics.hand_forces import HandForces
from ..settings import DriveSettings, SnakeSettings
from .fixed_base import check_fixed, fixed_shape, whole_windows
from .inline_planner import InlinePlanner
from .link_windows import entrance, link_windows
from .start_checks import checked_slack, checked_tip, make_control, refuse_beyond
from .state import Ahead, Pose, SnakeState, Tissue

SnakeCertificate = Certificate[LinksAt, Configuration, MotionVerdict]


class Placed(NamedTuple):
    """Windows, measured links and bounds for joints at some arc lengths, as in ``Pose``."""

    windows: IntArray
    measured: BoolArray
    bound: Array


@dataclass(frozen=True, eq=False)
class DriveConstants:
    """One robot in one lumen.

    snake: the whole robot; distal: the links that are bent, the last ones from ``first`` on.
    pathway: still or moving; query, distal_query: of the links' vertices; vertices_per_link: their number.
    limits, distal_limits: the certificates. inscribed: radii of the pathway's segments, mm; entrance: mm, beyond which
    a link is inside.
    planner: makes plans within a step; None: plans are made elsewhere and adopted.
    eased: projects joints to the bounds, as ``projected_to_limits``.
    fixed_base: nothing is inserted, and every link is measured against the whole pathway,
        as ``whole_windows``.
    """

    snake: SnakeModel
    distal: SnakeModel
    first: int
    pathway: Pathway
    query: Query
    distal_query: Query
    vertices_per_link: int
    limits: SnakeCertificate
    distal_limits: SnakeCertificate
    inscribed: Array
    entrance: float
    hand: HandForces
    planner: InlinePlanner | None
    eased: Callable[[DistalContext, Array, float], Array | None] = projected_to_limits
    fixed_base: bool = False

    @property
    def moves(self) -> bool:
        """Whether the tissue moves."""
        return self.pathway.motion is not None

    @property
    def longest_mm(self) -> float:
        """Arc length in mm at which all links are used up; infinite where plans are made within a step.

        A script says itself how deep it goes, and may have the front of a longer robot for its links.
        """
        return self.snake.reach_mm() if self.planner is None else math.inf

    @classmethod
    def of(cls, snake: SnakeModel, pathway: Pathway, settings: DriveSettings) -> Self:
        """Without a planner.

        Raises:
            InputError: a pathway with closed ends, which has no entrance.
        """
        if pathway.closed_ends:  # its first segment is a piece of the lumen, not the straight one before the entrance
            raise InputError("a snake is not driven in a pathway with closed ends: leave its ends open")
        each, links = settings.vertices_per_link, snake.links
        distal = snake.distal(min(settings.manipulated, links))
        query, distal_query = Query(snake.vertices(each * links)), Query(distal.vertices(each * distal.links))
        first, bound = links - distal.links, settings.bounds(links).most
        return cls(
            snake, distal, first, pathway, query, distal_query, each, HardLimits(query, snake, bound),
            HardLimits(distal_query, distal, bound[first:], first), inscribed_radii(pathway),
            entrance(pathway.packed(0.0), snake), HandForces(distal, settings.haptics()), None,
        )  # fmt: skip

    def placed(self, bounds: LinkBounds, joint_s: Array) -> Placed:
        """For joints at these arc lengths (L + 1,) in mm: windows, links inside, and bounds there."""
        if self.fixed_base:
            windows = whole_windows(len(self.inscribed) - 1, self.snake.links)
            return Placed(windows, np.ones(self.snake.links, dtype=bool), bounds.at(self.inscribed, windows))
        windows = link_windows(self.pathway, joint_s, self.first)
        return Placed(windows, joint_s[:-1] >= self.entrance, bounds.at(self.inscribed, windows))

    def kept(self, found: Deviations, measured: BoolArray, before: Deviations | None = None) -> Deviations:
        """Deviations of all links; 0 for those that are not inside.

        before: deviations of all links, where ``found`` has only the distal ones.
        """
        first = 0 if before is None else self.first
        depth = np.where(measured[first:], found.depth, 0.0)
        if before is None or not first:
            return Deviations(depth, found.vertex, found.segment.copy())
        return Deviations(
            np.concatenate([before.depth[:first], depth]),
            np.concatenate([before.vertex[:first], found.vertex + first * self.vertices_per_link]),
            np.concatenate([before.segment[:first], found.segment]),
        )

    def measured(self, state: SnakeState) -> SnakeState:
        """With the depths of all links at their positions, in the pathway sampled last."""
        pose = state.pose
        frames = self.snake.frames(pose.q, pose.shape.base)
        found = self.query.deviations(state.tissue.packed, frames, pose.windows)
        return state._replace(pose=pose._replace(deviation=self.kept(found, pose.measured)))


class Start(NamedTuple):
    """A drive at its start."""

    constants: DriveConstants
    state: SnakeState


def start_of(
    snake: SnakeModel,
    pathway: Pathway,
    settings: DriveSettings,
    curve: Curve | None = None,
    slack: Array | None = None,
    tip_s: float = 0.0,
    *,
    plans_here: bool = False,
    adjusted: SnakeSettings | None = None,
    beyond_allowed: bool = False,
    longer_allowed: bool = False,
    base: Array | None = None,
    q_nominal: Array | None = None,
) -> Start:
    """A robot at its start in a lumen; arguments and errors as for ``SnakeDrive``.

    plans_here: plans are made within a step. adjusted: settings that may change during the drive, if any.
    base, q_nominal: of a robot on a fixed base, as in ``fixed_shape``; None: it is inserted along its curve.
    """
    constants = DriveConstants.of(snake, pathway, settings)
    line = driven_curve(pathway, curve)
    insertion: Insertion | None = None
    if base is None:
        slack, tip_s = checked_slack(slack, curve), checked_tip(snake, line.length, tip_s, longer_allowed)
        insertion = Insertion(snake, line, slack if pathway.motion is None else None, None, tip_s, snake.reach_mm())
        shape = insertion.state
    else:
        check_fixed(snake, pathway, settings, tip_s)
        constants, shape = replace(constants, fixed_base=True), fixed_shape(snake, base, q_nominal, line)
    if plans_here:
        constants = replace(constants, planner=InlinePlanner(snake, pathway, insertion, settings.tissue_s))
    bounds, packed = settings.bounds(snake.links), pathway.packed(0.0)
    q, placed = np.array(shape.q), constants.placed(bounds, shape.joint_s)
    found = constants.query.deviations(packed, snake.frames(q, shape.base), placed.windows)
    state = SnakeState(
        settings=settings,
        adjusted=adjusted or SnakeSettings(),
        bounds=bounds,
        pose=Pose(shape, q, *placed, constants.kept(found, placed.measured)),
        tip_s=tip_s,
        began=q,
        tissue=Tissue(packed, line, line.length, np.zeros(len(packed.rows) + 1)),
        ahead=Ahead(settings.waypoint_mm, shape, shape),
        control=make_control(settings),
        felt=constants.hand.at_rest,
        period_s=settings.step_s,
    )
    if not beyond_allowed:
        refuse_beyond(state.deviation.depth, state.bound)
    _load_easing(constants, state)
    return Start(constants, state)


def _load_easing(constants: DriveConstants, state: SnakeState) -> None:
    """Compile and load the kernels of ``eased``: the first call of an installation takes seconds."""
    end = Configuration(state.base, state.q)
    limit = np.where(state.measured, state.bound, np.inf)
    context = DistalContext(
        constants.snake, constants.query, end.base, end.q, state.tissue.packed, state.windows, limit
    )
    constants.eased(context, state.q, state.settings.speed_max * state.settings.step_s)
