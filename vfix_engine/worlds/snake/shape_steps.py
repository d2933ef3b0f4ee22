"""Motions of the whole driven snake: inserted from one conforming shape to the next, and after the tissue."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...pathway.limits.backtracking import largest_fraction
from ...pathway.limits.limits import Configuration, HardLimits
from ...pathway.limits.link_bounds import LinkBounds, known_within
from ...pathway.live_pathway import LivePathway
from ...pathway.pathway import Pathway
from ...pathway.query.query import Deviations, Query
from ...snake.conform.conformance import ShapeSolution
from ...snake.conform.conforming import blended
from ...snake.conform.waypoints import Waypoints, moved_off
from ...snake.control.projection import projected_to_limits
from ...snake.control.tip_control import DistalContext
from .distal_steps import SAME, DistalSteps
from .drive_state import Command, Outcome
from .link_windows import link_windows, planning_margin
from .refusal import Refusal

TISSUE_SHARE = 0.5  # of the joints' speed at most is for following the tissue; the rest is the hand's
_LEAST = 0.01  # of a step: with less of its joint travel left nothing more is tried


class ShapeSteps(DistalSteps):
    """What ``SnakeDrive`` does with all of its links; the attributes are its own."""

    projects_within_step: bool
    query: Query
    t: float
    tip_s: float
    _limits: HardLimits
    _live: LivePathway
    _waypoints: Waypoints
    _began: Array
    _goal: ShapeSolution | None
    _measured: NDArray[np.bool_]
    _deviation: Deviations
    _inscribed: Array
    bounds: LinkBounds
    bound: Array
    pathway: Pathway

    @property
    def length_mm(self) -> float:
        """Of the curve that the robot conforms to."""
        raise NotImplementedError

    @property
    def lost(self) -> str | None:
        """In words, why the tissue leaves no pathway now."""
        raise NotImplementedError

    def _set_windows(self, joint_s: Array) -> None:
        raise NotImplementedError

    def _retreat_beyond(self) -> Array:
        raise NotImplementedError

    def _measure(self) -> None:
        raise NotImplementedError

    def _left(self, dt: float) -> float:
        """Time of this step of ``dt`` s for which the fastest joint may still go at full speed, s."""
        return max(dt - float(np.abs(self.q - self._began).max()) / self.settings.speed_max, 0.0)

    def _command(self, command: Command, dt: float) -> Outcome:
        """What the operator asks for, with what the tissue has left of the joints' speed."""
        left = self._left(dt)
        if left < _LEAST * dt:
            return Outcome("held", "the joints are as fast as they may be, following the tissue", "speed")
        if command.insert_mm_per_s == 0.0:
            return self._bend(command, dt, left)
        outcome = self._insert(command.insert_mm_per_s * dt, left)
        if outcome.name == "moved" and command.bends:
            return Outcome("shrunk", "insertion comes first: the tip was not bent", "insertion")
        return outcome

    def _insert(self, wanted_mm: float, dt: float) -> Outcome:
        """Forwards or backwards along the curve."""
        rest = self._conformed.q[2 * self._first :]
        if self._by_joints or self.control.bent(self.q[2 * self._first :], rest) > self.settings.reoptimise_below:
            return Outcome("held", "the tip is bent: straighten it before it is inserted or drawn back", "bent")
        try:
            ahead_s, ahead = self._waypoint(1.0 if wanted_mm > 0.0 else -1.0)
        except LookupError as end:
            return Outcome("held", str(end), "end")
        remaining, most = ahead_s - self.tip_s, self.settings.insertion_step_mm
        ratio = self._fastest(ahead, dt)
        part = min(abs(wanted_mm), most) / abs(remaining)
        within = min(1.0, part, 1.0 / ratio if ratio > 0.0 else 1.0)
        if within > 1.0 - SAME:  # the sum of the steps so far is rounded: no step is spent on the rest
            within = 1.0
        done = Outcome("moved")
        if within < min(1.0, part):
            done = self._fast()
        elif abs(wanted_mm) > (1.0 + SAME) * min(most, abs(remaining)) and 0.0 < ahead_s < self.length_mm:
            done = Outcome("shrunk", f"a step goes {most:g} mm at most, and to the next planned shape", "step")

        def is_admissible(share: float) -> bool:
            part = share * within
            advances = self.tip_s + part * remaining != self.tip_s  # else joints would move and the tip would not
            return advances and self._certified(blended(self._conformed, ahead, part), dt)

        share = largest_fraction(is_admissible, self._part)
        if share > 0.0:
            self.tip_s = self._conformed.tip_s
            if self._goal is not None:  # what the tissue asks for goes in with the robot
                self._goal = blended(self._goal, ahead, share * within)
            if share * within >= 1.0:
                self._waypoints.passed()
            self._settled = False
        return done if share == 1.0 else self._backtracked(share)

    def _waypoint(self, sign: float) -> tuple[float, ShapeSolution]:
        """Where the insertion goes next, moved off the wall where that is needed.

        Raises:
            LookupError: there is nowhere to go.
        """
        place, shape, new = self._waypoints.ahead(self.tip_s, sign)
        if not new:
            return place, shape
        if not _in_order(shape.joint_s):
            self._waypoints.restart(self._conformed)
            raise LookupError("no shape conforms to the path there")
        known = self._windows, self._measured, self.bound
        self._set_windows(shape.joint_s)
        windows, margin = self._windows, planning_margin(self._waypoints.spacing_mm)
        self.bound = self.bounds.at(self._inscribed, link_windows(self.pathway, shape.joint_s, self._first, margin))
        better = moved_off(shape, self.snake, self.query, self._packed, windows, self._bounds())
        self._windows, self._measured, self.bound = known
        if better is not None:
            self._waypoints.correct(better)
        return place, better or shape

    def plan_anew(self, waypoint_mm: float) -> None:
        """Forget what was planned ahead; from here on in shapes ``waypoint_mm`` apart."""
        if self.observer is not None:
            self.observer.planned_anew(waypoint_mm)
        self._waypoints.spacing_mm = waypoint_mm
        self._waypoints.restart(self._conformed)

    def _follow_tissue(self, dt: float) -> Outcome:
        """The pathway of now, and, as fast as joints may, the shape that conforms to it."""
        self._see(dt)
        if self.lost is not None:
            return Outcome("held", self.lost, "tissue")
        was, outcome = self._conformed, self._to_goal(dt)
        left = self._left(dt)
        if left >= _LEAST * dt and (self._deviation.depth > self._retreat_beyond()).any():
            self._retreat(left)
        if self._settled and (outcome.name != "rest" or self._conformed is not was):
            self.control.move_to(self.distal_context())
        return outcome

    def _see(self, dt: float) -> None:
        """Look at the tissue, if it is time to: the pathway of now, and the shape that conforms to it as the goal."""
        now = self._live.look(self.t)
        if now is not None:
            self._packed, self._waypoints.curve = now
            self.tip_s = min(self.tip_s, self._waypoints.curve.length)
            most = TISSUE_SHARE * self.settings.speed_max * max(self.settings.tissue_s, dt)
            self._goal = self._waypoints.at(self.tip_s, self._conformed, most)
            self._waypoints.restart(self._goal)
            self._measure()

    def _to_goal(self, dt: float) -> Outcome:
        """Towards the shape that the tissue asks for, so fast that it is there when the tissue is looked at again."""
        goal = self._goal
        if goal is None:
            return Outcome("rest")
        due = self._live.share(self.t, dt)
        whole = due == 1.0 and self._fastest(goal, dt) <= 1.0
        share = largest_fraction(
            lambda share: self._certified(blended(self._conformed, goal, share * due), dt), self._part
        )
        self._goal = None if share == 0.0 or (whole and share == 1.0) else goal
        if share == 0.0:  # nothing is followed until the tissue has moved on
            self._waypoints.restart(self._conformed)
        return self._backtracked(share)

    def _bent(self, conformed: ShapeSolution) -> Array:
        """Joints (2L,) of a conforming shape with the bend that the distal links have."""
        bend = self.q - self._conformed.q
        bend[: 2 * self._first] = 0.0
        return self.snake.clamp(conformed.q + bend)

    def _fastest(self, wanted: ShapeSolution, dt: float) -> float:
        """Speed of the fastest joint towards it, of what joints may do; a bend at a joint's end is no help."""
        return float(np.abs(wanted.q - self._conformed.q).max()) / (self.settings.speed_max * dt)

    def _certified(self, wanted: ShapeSolution, dt: float) -> bool:
        """Go to another conforming shape if the hard limits let it, as far as the joints' speed allows."""
        ratio = self._fastest(wanted, dt)
        if ratio > 1.0:
            wanted = blended(self._conformed, wanted, 1.0 / ratio)
        if not _in_order(wanted.joint_s):
            self._refused = None
            return False
        windows, measured, bound = self._windows, self._measured, self.bound
        self._set_windows(wanted.joint_s)
        start, end = Configuration(self._conformed.base, self.q), Configuration(wanted.base, self._bent(wanted))
        # A link that comes to count, gets another window or with it a smaller bound, has to be within its bound.
        known = known_within(self._deviation.depth, bound, self.bound)
        verdict = self._limits.certify(self._packed, self._windows, start, end, self._bounds(), known)
        parted = verdict.taken or verdict.exhausted  # what has only been parted too often is within its bounds already
        if self.projects_within_step and not parted and np.isfinite(verdict.deviation.depth).all():
            wanted, end = self._projected(wanted, end, dt)
            verdict = self._limits.certify(self._packed, self._windows, start, end, self._bounds(), known)
        if verdict.taken:
            self._conformed, self.q = wanted, np.array(end.q)
            self._keep(verdict.deviation)
        else:
            self._refused = Refusal(verdict, end, self._bounds(), self.snake, self.query)
            self._windows, self._measured, self.bound = windows, measured, bound
        return verdict.taken

    def _retreat(self, dt: float) -> None:
        """Back towards the bounds that the tissue's motion has left links beyond, as fast as joints may."""
        here = Configuration(self._conformed.base, self.q)
        wanted, end = self._projected(self._conformed, here, dt)
        verdict = self._limits.certify(self._packed, self._windows, here, end, self._bounds(), self._deviation.depth)
        if verdict.taken:
            self._conformed, self.q = wanted, np.array(end.q)
            self._keep(verdict.deviation)

    def _projected(self, wanted: ShapeSolution, end: Configuration, dt: float) -> tuple[ShapeSolution, Configuration]:
        """The nearest shape that keeps the bounds, if there is one; the operator's bend stays as it is."""
        context = DistalContext(self.snake, self.query, end.base, end.q, self._packed, self._windows, self._bounds())
        q = projected_to_limits(context, self.q, self.settings.speed_max * dt)
        if q is None:
            return wanted, end
        return replace(wanted, q=self.snake.clamp(wanted.q + (q - end.q)), exact=False), Configuration(end.base, q)


def _in_order(joint_s: Array) -> bool:
    """Whether joints lie one after the other along the curve: a shape in which they do not has no windows."""
    return bool((joint_s[1:] >= joint_s[:-1]).all() and np.isfinite(joint_s).all())
