"""Computations longer than a tick, in the runtime's worker process: present pathway and curve, shapes, bends."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....errors import PathwayError
from ....geometry.curve import Curve
from ....pathway.limits.limits import HardLimits
from ....pathway.limits.link_bounds import inscribed_radii
from ....pathway.packed import (
    END,
    END_RADIUS,
    END_TANGENT,
    START,
    START_RADIUS,
    START_TANGENT,
    PackedPathway,
)
from ....pathway.pathway import Pathway
from ....pathway.query.query import Query
from ....robots.snake import SnakeModel
from ....snake.bending.optimise import DistalBend
from ....snake.conform.conformance import ShapeSolution, conform
from ....snake.conform.moved_off import MOST, RESERVE_MM, moved_off
from ....snake.control.parameterised import found_bends
from ....snake.control.projection import projected_to_limits
from ....snake.control.tip_control import DistalContext
from ..settings import DriveSettings
from ..stepping.link_windows import entrance, link_windows, planning_margin
from .look_plan import LookPlanner
from .messages import BendsWanted, LookPart, LookWanted, PlanInputs, PlannedShape, PlannerAnswer, ShapeAtTime

SHAPES_AHEAD = 3  # of an insertion, which continues while the next ones are planned
LOOK_AHEAD = 3  # bends in a direction in one plan: longer plans would delay those of the tissue
RIM_S = 0.005  # [s] before the sample, over which the wall's speed is measured


class _Look(NamedTuple):
    """The pathway and its curve at a time in s."""

    t: float
    packed: PackedPathway
    curve: Curve


class Planner:
    """A pure function of its inputs; one robot in one lumen.

    Args:
        snake: the whole robot; pathway: still or moving; curve: followed while the tissue is still, with
            ``slack`` (N,) mm about its points; settings: of the drive.
    """

    def __init__(
        self, snake: SnakeModel, pathway: Pathway, curve: Curve, slack: Array | None, settings: DriveSettings
    ) -> None:
        self._snake, self._pathway, self._curve, self._slack, self._settings = snake, pathway, curve, slack, settings
        each = settings.vertices_per_link
        self._distal = snake.distal(min(settings.manipulated, snake.links))
        self._first = snake.links - self._distal.links
        self._query = Query(snake.vertices(each * snake.links))
        self._distal_query = Query(self._distal.vertices(each * self._distal.links))
        self._entrance, self._inscribed = entrance(pathway.packed(0.0), snake), inscribed_radii(pathway)
        self._seen = _Look(0.0, pathway.packed(0.0), curve)  # the last one, for requests of bends

    def __call__(self, wanted: PlanInputs) -> PlannerAnswer:
        """The requested plan."""
        near, curve, packed, seen, lost = (
            wanted.near.on(self._curve),
            self._curve,
            self._pathway.packed(0.0),
            None,
            None,
        )
        if wanted.t is not None:
            try:
                seen = self._look(wanted, wanted.t)
            except PathwayError as error:
                lost = f"the tissue leaves no pathway: {error}"
            else:
                packed, curve = self._seen.packed, self._seen.curve
                near = seen.goal.on(curve)
        ahead: tuple[PlannedShape, ...] = ()
        if wanted.sign and lost is None and (seen is not None or self._pathway.motion is None):
            ahead = self._ahead(wanted, near, curve, packed)
        bends = () if wanted.bends is None else self._bends(wanted.bends)
        view = None if wanted.view is None else self._view(wanted.view)
        own = None if seen is None else packed
        return PlannerAnswer(seen, lost, PlannedShape.of(near), wanted.sign, ahead, bends, wanted.bends, view, own)

    def _look(self, wanted: PlanInputs, t: float) -> ShapeAtTime:
        """The tissue at a time, and the shape that conforms to it, moved off the wall where that is needed.

        Raises:
            PathwayError: there is no valid pathway at that time.
        """
        packed, curve = self._pathway.packed(t), self._pathway.curve(t)
        self._seen = _Look(t, packed, curve)
        tip_s = min(wanted.tip_s, curve.length)
        goal = conform(self._snake, curve, tip_s, wanted.near.on(self._curve), None, wanted.near.roll, most=wanted.most)
        goal = self._bent_inside(goal, packed, wanted)
        before = max(t - RIM_S, 0.0)
        rim = np.zeros(len(packed.rows))
        if t > before:
            rim = rim_travel(self._pathway.packed(before), packed) / (t - before)
        now = self._pathway.contours(t, extended=True)
        return ShapeAtTime(t, now.centre, now.tangent, now.first, now.radius, curve.length, PlannedShape.of(goal), rim)

    def _ahead(
        self, wanted: PlanInputs, near: ShapeSolution, curve: Curve, packed: PackedPathway
    ) -> tuple[PlannedShape, ...]:
        """The next shapes of an insertion, each moved off the wall before the next one is computed."""
        slack = self._slack if self._pathway.motion is None else None
        found: list[PlannedShape] = []
        for _ in range(SHAPES_AHEAD):
            place = near.tip_s + wanted.sign * wanted.spacing_mm
            place = min(place, curve.length, self._snake.reach_mm()) if wanted.sign > 0 else max(place, 0.0)
            if (place - near.tip_s) * wanted.sign <= 0.0:
                break
            near = self._inside(conform(self._snake, curve, place, near, slack, near.roll), packed, wanted)
            found.append(PlannedShape.of(near))
        return tuple(found)

    def _inside(self, shape: ShapeSolution, packed: PackedPathway, wanted: PlanInputs) -> ShapeSolution:
        windows = link_windows(self._pathway, shape.joint_s, self._first)
        kept = self._kept(shape, wanted)
        bend = wanted.bend if self._settings.lock_bend else None
        return moved_off(shape, self._snake, self._query, packed, windows, kept, bend) or shape

    def _kept(self, shape: ShapeSolution, wanted: PlanInputs) -> Array:
        """(L,) mm, the bounds of a planned shape and of those next to it; infinite outside of the pathway."""
        around = link_windows(self._pathway, shape.joint_s, self._first, planning_margin(wanted.spacing_mm))
        bound = np.maximum(wanted.bounds.at(self._inscribed, around) - wanted.reserve, 0.0)
        return np.where(shape.joint_s[:-1] >= self._entrance, bound, math.inf)

    def _bent_inside(self, goal: ShapeSolution, packed: PackedPathway, wanted: PlanInputs) -> ShapeSolution:
        """The nearest shape with which, including the hand's bend, links keep their bounds."""
        windows = link_windows(self._pathway, goal.joint_s, self._first)
        bound = self._kept(goal, wanted)
        kept = bound - np.minimum(RESERVE_MM, 0.5 * bound)
        bent = self._snake.clamp(goal.q + wanted.bend)
        if (self._query.deviations(packed, self._snake.frames(bent, goal.base), windows).depth <= kept).all():
            return goal
        context = DistalContext(self._snake, self._query, goal.base, bent, packed, windows, kept)
        q = projected_to_limits(context, bent, MOST)
        if q is None:
            return goal
        return replace(goal, q=self._snake.clamp(goal.q + (q - bent)), exact=False)

    def _bends(self, wanted: BendsWanted) -> tuple[DistalBend, ...]:
        """Control bends in the pathway at the requested time, mostly the one sampled last."""
        return found_bends(self._context(wanted), self._settings.bends)

    def _view(self, wanted: LookWanted) -> LookPart:
        """The next few bends in a direction."""
        limits = HardLimits(self._distal_query, self._distal, wanted.at.bound, self._first)
        look = LookPlanner(self._context(wanted.at), limits, wanted.aim, self._first)
        found, ends = look.ahead(wanted.q, wanted.side, LOOK_AHEAD)
        bends = tuple(tuple((q - wanted.at.rest).tolist()) for q in found)
        return LookPart(wanted.side, wanted.q - wanted.at.rest, bends, ends)

    def _context(self, place: BendsWanted) -> DistalContext:
        packed = self._seen.packed if self._seen.t == place.t else self._pathway.packed(place.t)
        return DistalContext(
            self._distal, self._distal_query, place.base, place.rest, packed, place.window, place.bound
        )


def rim_travel(before: PackedPathway, after: PackedPathway) -> Array:
    """(S,) mm, how far the wall of each segment has moved at most: |Δcentre| + R |Δtangent| + |ΔR| of its two contours.

    R: the larger of both times. Both pathways have the same number of contours.
    """
    ends = []
    for centre, tangent, radius in ((START, START_TANGENT, START_RADIUS), (END, END_TANGENT, END_RADIUS)):
        moved = np.linalg.norm(after.rows[:, centre : centre + 3] - before.rows[:, centre : centre + 3], axis=1)
        turned = np.linalg.norm(after.rows[:, tangent : tangent + 3] - before.rows[:, tangent : tangent + 3], axis=1)
        largest = np.maximum(before.rows[:, radius], after.rows[:, radius])
        ends.append(moved + largest * turned)
    contours = np.abs(after.polar - before.polar).max(axis=1)
    ends[0] += contours[:-1]
    ends[1] += contours[1:]
    found: Array = np.maximum(*ends)
    return found
