"""The driven snake: inserted along a lumen, follow-the-leader, and bent at its far end by camera commands.

A step is a wish and a verdict: the conforming shape, the control of the distal links or the operator say where to go,
and the hard limits of ``limits.py`` decide whether, and how far, the robot goes there. Without a command nothing moves,
but for a pathway that moves, which the robot's shape follows.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from time import perf_counter
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...given import positive
from ...robots.snake import SnakeModel
from ..anatomy.curve import Curve
from ..conform.conformance import ShapeSolution
from ..conform.conforming import blended, driven_curve
from ..conform.waypoints import Waypoints, moved_off
from ..control.projection import projected_to_limits
from ..control.tip_control import DistalContext
from ..haptics.hand_forces import HandForces
from ..haptics.haptics import Forces
from ..limits.backtracking import largest_share
from ..limits.limits import Configuration, HardLimits
from ..pathway.live_pathway import LivePathway
from ..pathway.pathway import Pathway, TissueMotion
from ..query.query import Deviations, Query
from .distal_steps import SAME, DistalSteps
from .drive_start import checked_slack, checked_tip, make_control, refuse_beyond
from .drive_state import Command, DriveSettings, DriveState, Outcome, both
from .link_windows import entrance, link_windows
from .lumen import lumen_between
from .refusal import Refusal
from .trail import Trail

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TISSUE_SHARE = 0.5  # of the joints' speed at most is for following the tissue; the rest is the hand's
TISSUE_RESERVE_MM = 0.5  # [mm] four times what breathing by 8 mm in 4 s moves in 20 ms
_STRAIGHT = 1e-9  # [rad]
_LEAST = 0.01  # of a step: with less of its joint travel left nothing more is tried
_TIMED = 10  # every so many steps one query of all links is timed


class SnakeDrive(DistalSteps):
    """State and one step of a driven snake; see ``DriveState``.

    Args:
        snake: the whole robot.
        pathway: what its links are measured against, still or moving.
        curve: what it is to conform to, None: the pathway's own; with a moving pathway always the pathway's own.
        slack: (N,) mm at the curve's points, how far the robot may leave the curve there.
        tip_s: how far in it starts, mm; at 0 it lies straight before the entrance.
        beyond_allowed: it may start with links beyond their bounds, which then go no deeper than they are.
        longer_allowed: it may have more links than it takes to the path's end, some of which never come in.

    Raises:
        InputError: a link that starts beyond its bound; a robot longer than the path; slack without a curve or of
            another shape; a pathway with closed ends, which has no entrance.
    """

    projects_within_step = True  # a shape that the certificate refuses, to its limits
    times_queries = True

    def __init__(
        self,
        snake: SnakeModel,
        pathway: Pathway,
        settings: DriveSettings | None = None,
        curve: Curve | None = None,
        slack: Array | None = None,
        tip_s: float = 0.0,
        *,
        beyond_allowed: bool = False,
        longer_allowed: bool = False,
    ) -> None:
        if pathway.closed_ends:  # its first segment is a piece of the lumen, not the straight one before the entrance
            raise InputError("a snake is not driven in a pathway with closed ends: leave its ends open")
        self.snake, self.pathway, self.settings = snake, pathway, settings or DriveSettings()
        each, links = self.settings.vertices_per_link, snake.links
        self.distal = snake.distal(min(self.settings.manipulated, links))
        self.query, self._distal_query = (
            Query(snake.vertices(each * links)),
            Query(self.distal.vertices(each * self.distal.links)),
        )
        self.bound = np.full(links, self.settings.bound_mm)
        self.bound[-1] = self.settings.tip_bound
        self._first = links - self.distal.links  # of the distal links
        self._limits = HardLimits(self.query, snake, self.bound)
        self._distal_limits = HardLimits(self._distal_query, self.distal, self.bound[self._first :], self._first)
        self.control = make_control(self.settings)
        self.hand = HandForces(self.distal)
        line = driven_curve(pathway, curve)
        slack, tip_s = checked_slack(slack, curve), checked_tip(snake, line.length, tip_s, longer_allowed)
        self._live = LivePathway(pathway, self.settings.tissue_s)
        self.t, self.refused_commands, self._steps = 0.0, 0, 0
        self._settled, self._by_joints, self._query_s = False, False, 0.0  # by commands to its joints it may be bent
        self._goal: ShapeSolution | None = None  # the shape that the tissue's motion asks for, while it is not reached
        self._refused: Refusal | None = None
        self._trail = Trail()
        self._packed = pathway.packed(0.0)
        self._entrance = entrance(self._packed, snake)
        still = pathway.motion is None
        self._windows: Index
        self._measured: NDArray[np.bool_]
        self._deviation: Deviations
        self._waypoints = Waypoints(snake, line, slack if still else None, tip_s, still, self.settings.waypoint_mm)
        self._conformed, self.tip_s = self._waypoints.first, tip_s
        self.q = np.array(self._conformed.q)
        self._began = self.q.copy()
        self._set_windows(self._conformed.joint_s)
        self._measure()
        if not beyond_allowed:
            refuse_beyond(self._deviation.depth, self.bound)
        self._projected(
            self._conformed, Configuration(self._conformed.base, self.q), self.settings.step_s
        )  # loads its kernels
        self.state = self._state("inserting", Outcome("rest"), self.hand.forces, 0.0)

    @classmethod
    def in_lumen(
        cls,
        mesh: TriangleMesh,
        start: ArrayLike,
        end: ArrayLike,
        links: int | None = None,
        settings: DriveSettings | None = None,
        *,
        snake: SnakeModel | None = None,
        tissue: TissueMotion | None = None,
        tip_s: float = 0.0,
    ) -> Self:
        """A snake before the entrance of a lumen of one's own, with the pathway that is found through it.

        Args:
            mesh: the lumen's surface, mm; start, end: (3,) clicks in the patient frame.
            links: of the snake; None: as many as it takes to the end. snake: whose links they are; None: the paper's.
            tissue: how the pathway moves; None: it is still. tip_s: how far in the tip starts, mm.

        Raises:
            PathwayError: clicks or a surface that no path can be made of.
            InputError: as the class. RobotError: a number of links that no snake has.
        """
        settings, model = settings or DriveSettings(), snake or SnakeModel(1)
        lumen = lumen_between(mesh, start, end, model, settings, tissue)
        return cls(lumen.snake(model, links), lumen.pathway, settings, lumen.curve, lumen.slack, tip_s)

    @property
    def length_mm(self) -> float:
        """Of the curve that the robot conforms to."""
        return self._waypoints.curve.length

    @property
    def can_look(self) -> bool:
        """Whether all the links that the camera command moves are inside."""
        return bool(self._measured[self._first :].all())

    @property
    def lost(self) -> str | None:
        """In words, why the tissue leaves no pathway now; nothing moves until it does."""
        return self._live.lost

    @property
    def straight(self) -> bool:
        """Whether the distal links lie as the conforming shape has them."""
        return bool(np.abs(self.q - self._conformed.q).max() < _STRAIGHT)

    @property
    def tip(self) -> Array:
        """(3,) of the last link's far end, LPS mm."""
        tip: Array = self.snake.tip(self.q, self._conformed.base)[:3, 3]
        return tip

    @property
    def distal_limits(self) -> HardLimits:
        """That certify motion of the distal links."""
        return self._distal_limits

    @property
    def bend(self) -> Array:
        """(2L',) rad by which the distal joints stand off the conforming shape."""
        bend: Array = self.q[2 * self._first :] - self._conformed.q[2 * self._first :]
        return bend

    @property
    def offset_mm(self) -> Array:
        """Distances of the joint centres that are inside to the curve, of the conforming shape."""
        inside: Array = self._conformed.offset_mm[self._conformed.joint_s >= 0.0]
        return inside

    def step(self, command: Command, dt: float | None = None) -> DriveState:
        """One step of ``dt`` s (None: the settings' step).

        Raises:
            InputError: a step that is not finite and positive, or no ``Command``.
        """
        began = perf_counter()
        dt = self.settings.step_s if dt is None else positive("a step's time in s", dt)
        if not isinstance(command, Command):
            raise InputError(f"{command!r:.60} is no Command: give Command(insert_mm_per_s=…, camera_mm_per_s=…)")
        if command.bend is not None and len(command.bend) != self.distal.dof:
            raise InputError(f"a bend of {len(command.bend)} joints: give {self.distal.dof}")
        if not command.finite:
            command, self.refused_commands = command.cleaned, self.refused_commands + 1
        self.t += dt
        self._began = self.q.copy()
        before = self.q[2 * self._first :].copy()
        outcome = Outcome("rest") if self.pathway.motion is None else self._follow_tissue(dt)
        looking = command.bends and command.insert_mm_per_s == 0.0
        if self.lost is None and (command.bends or command.insert_mm_per_s != 0.0):
            outcome = both(outcome, self._command(command, dt))
        if self.times_queries and self._steps % _TIMED == 0:
            frames, asked = self.snake.frames(self.q, self._conformed.base), perf_counter()
            self.query.deviations(self._packed, frames, self._windows)
            self._query_s = perf_counter() - asked
        self._steps += 1
        after = self.q[2 * self._first :]
        if self.straight:
            self._trail.clear()
        elif command.bends and not command.straighten:
            self._trail.note(self.bend, self.control.steering)
        forces = self.hand.step(before, after, dt, self._deviation.depth[self._first :], self._outwards(after))
        self.state = self._state("looking" if looking else "inserting", outcome, forces, perf_counter() - began)
        return self.state

    def copy(self) -> Self:
        """A drive that goes on from here by itself: steps of one leave the other as it is.

        What a step replaces and never writes into, which is every array, is shared; and so are the scratch arrays of
        queries, so two copies do not step at the same time.
        """
        other = copy(self)
        other.control, other.hand = copy(self.control), copy(self.hand)
        other._live, other._waypoints, other._trail = copy(self._live), self._waypoints.copy(), self._trail.copy()
        return other

    # What a step may do

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

        share = largest_share(is_admissible)
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
        known = self._windows, self._measured
        self._set_windows(shape.joint_s)
        better = moved_off(shape, self.snake, self.query, self._packed, self._windows, self._bounds())
        self._windows, self._measured = known
        if better is not None:
            self._waypoints.correct(better)
        return place, better or shape

    def plan_anew(self, waypoint_mm: float) -> None:
        """Forget what was planned ahead; from here on in shapes ``waypoint_mm`` apart."""
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
        share = largest_share(lambda share: self._certified(blended(self._conformed, goal, share * due), dt))
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
        """Speed of the fastest joint on the way there, of what joints may do; a bend at a joint's end is no help."""
        return float(np.abs(wanted.q - self._conformed.q).max()) / (self.settings.speed_max * dt)

    def _certified(self, wanted: ShapeSolution, dt: float) -> bool:
        """Go to another conforming shape if the hard limits let it, as far as the joints' speed allows."""
        ratio = self._fastest(wanted, dt)
        if ratio > 1.0:
            wanted = blended(self._conformed, wanted, 1.0 / ratio)
        if not _in_order(wanted.joint_s):
            self._refused = None
            return False
        windows, measured = self._windows, self._measured
        self._set_windows(wanted.joint_s)
        start, end = Configuration(self._conformed.base, self.q), Configuration(wanted.base, self._bent(wanted))
        known = self._deviation.depth  # a link that comes to count, or gets another window, has to be within its bound
        verdict = self._limits.certify(self._packed, self._windows, start, end, self._bounds(), known)
        if self.projects_within_step and not verdict.taken and np.isfinite(verdict.deviation.depth).all():
            wanted, end = self._projected(wanted, end, dt)
            verdict = self._limits.certify(self._packed, self._windows, start, end, self._bounds(), known)
        if verdict.taken:
            self._conformed, self.q = wanted, np.array(end.q)
            self._keep(verdict.deviation)
        else:
            self._refused = Refusal(verdict, end, self._bounds(), self.snake, self.query)
            self._windows, self._measured = windows, measured
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

    # What is known of the robot

    def _set_windows(self, joint_s: Array) -> None:
        """Windows of the links for joints at these arc lengths, and which links are inside."""
        self._windows = link_windows(self.pathway, joint_s, self._first)
        self._measured = joint_s[:-1] >= self._entrance

    def _bounds(self) -> Array:
        """b_i of the links that are inside; less a reserve where the pathway moves between two of its moments."""
        reserve = 0.0 if self.pathway.motion is None else TISSUE_RESERVE_MM
        return np.where(self._measured, np.maximum(self.bound - reserve, 0.0), np.inf)

    def _retreat_beyond(self) -> Array:
        """(L,) mm: a link that is deeper is to retreat at once, whatever that costs."""
        return self._bounds()

    def _measure(self) -> None:
        frames = self.snake.frames(self.q, self._conformed.base)
        self._keep(self.query.deviations(self._packed, frames, self._windows))

    def _keep(self, found: Deviations, first: int = 0) -> None:
        """Deviations of the links from ``first`` on; those outside of the pathway have none."""
        depth = np.where(self._measured[first:], found.depth, 0.0)
        vertex = found.vertex + first * self.settings.vertices_per_link
        if first:
            was = self._deviation
            depth = np.concatenate([was.depth[:first], depth])
            vertex = np.concatenate([was.vertex[:first], vertex])
            found = Deviations(depth, vertex, np.concatenate([was.segment[:first], found.segment]))
        self._deviation = Deviations(depth, vertex, found.segment.copy())

    def _state(
        self, mode: Literal["inserting", "looking"], outcome: Outcome, forces: Forces, spent: float
    ) -> DriveState:
        return DriveState(
            self.t, mode, self._conformed.base, self.q.copy(), self._conformed.q, self.tip_s,
            self._conformed.joint_s, self.control.steering, self._packed, self._windows, self._measured,
            self._deviation, forces, *outcome, self._query_s, spent,
        )  # fmt: skip


def _in_order(joint_s: Array) -> bool:
    """Whether joints lie one after the other along the curve: a shape in which they do not has no windows."""
    return bool((joint_s[1:] >= joint_s[:-1]).all() and np.isfinite(joint_s).all())
