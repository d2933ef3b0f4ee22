"""The driven snake: inserted along a lumen, follow-the-leader, and bent at its far end by camera commands.

A step is a wish and a verdict: the conforming shape, the control of the distal links or the operator say where to go,
and the hard limits of ``limits.py`` decide whether, and how far, the robot goes there. Without a command nothing moves,
but for a pathway that moves, which the robot's shape follows.
"""

from __future__ import annotations

from copy import copy
from time import perf_counter
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array, IntArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.limits.limits import Configuration, HardLimits
from ...pathway.limits.link_bounds import inscribed_radii
from ...pathway.live_pathway import LivePathway
from ...pathway.pathway import Pathway, TissueMotion
from ...pathway.query.query import Deviations, Query
from ...robots.snake import SnakeModel
from ...snake.conform.conformance import ShapeSolution
from ...snake.conform.conforming import driven_curve
from ...snake.conform.waypoints import Waypoints
from ...snake.haptics.hand_forces import HandForces
from ...snake.haptics.haptics import Forces
from ...validate import positive
from .drive_start import checked_slack, checked_tip, make_control, refuse_beyond
from .drive_state import Command, DriveSettings, DriveState, Observer, Outcome, both
from .link_windows import entrance, link_windows
from .lumen import lumen_between
from .narrow import narrowest
from .refusal import Refusal
from .shape_steps import ShapeSteps
from .trail import Trail

TISSUE_RESERVE_MM = 0.5  # [mm] four times what breathing by 8 mm in 4 s moves in 20 ms
_STRAIGHT = 1e-9  # [rad]
_TIMED = 10  # every so many steps one query of all links is timed


class SnakeDrive(ShapeSteps):
    """State and one step of a driven snake; see ``DriveState``. ``bound``: (L,) mm, b_i where the links are.

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
        self.bounds, self._inscribed = self.settings.bounds(links), inscribed_radii(pathway)
        self.bound = self.bounds.most
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
        self.observer: Observer | None = None
        self._packed = pathway.packed(0.0)
        self._entrance = entrance(self._packed, snake)
        still = pathway.motion is None
        self._windows: IntArray
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
        anyway: bool = False,
    ) -> Self:
        """A snake before the entrance of a lumen of one's own, with the pathway that is found through it.

        Args:
            mesh: the lumen's surface, mm; start, end: (3,) clicks in the patient frame.
            links: of the snake; None: as many as it takes to the end. snake: whose links they are; None: the paper's.
            tissue: how the pathway moves; None: it is still. tip_s: how far in the tip starts, mm.
            anyway: also where the pathway is narrower than the robot somewhere as far as it reaches.

        Raises:
            PathwayError: clicks or a surface that no path can be made of; a pathway that is narrower than the robot.
            InputError: as the class. RobotError: a number of links that no snake has.
        """
        settings, model = settings or DriveSettings(), snake or SnakeModel(1)
        lumen = lumen_between(mesh, start, end, model, settings, tissue)
        robot = lumen.snake(model, links)
        if not anyway:
            narrowest(lumen.pathway, robot, settings.bound_mm, robot.reach_mm()).refuse(robot)
        return cls(robot, lumen.pathway, settings, lumen.curve, lumen.slack, tip_s)

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
        """(2L',) rad by which the distal joints differ from the conforming shape."""
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
        given = command
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
        if self.observer is not None:
            self.observer.stepped(given, dt)
        return self.state

    def copy(self) -> Self:
        """A drive that goes on from here by itself, unobserved: steps of one leave the other as it is.

        What a step replaces and never writes into, which is every array, is shared; and so are the scratch arrays of
        queries, so two copies do not step at the same time.
        """
        other = copy(self)
        other.observer = None
        other.control, other.hand = copy(self.control), copy(self.hand)
        other._live, other._waypoints, other._trail = copy(self._live), self._waypoints.copy(), self._trail.copy()
        return other

    def _set_windows(self, joint_s: Array) -> None:
        """Windows of the links for joints at these arc lengths, their bounds there, and which links are inside."""
        self._windows = link_windows(self.pathway, joint_s, self._first)
        self.bound = self.bounds.at(self._inscribed, self._windows)
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
            self.bound, self._deviation, forces, *outcome, self._query_s, spent,
        )  # fmt: skip
