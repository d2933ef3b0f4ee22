"""Planning of views: bends of the distal links that look in a direction, and a path to each of them.

The bends of Kwok 2013, eq. 10-19, have two parameters and are made for the position of the tip. In a lumen whose own
bends have the joints at their limits they reach few directions. Here all joints are free: a quadratic program
turns the view a little, slides along the walls, and every piece of the path is certified by the hard limits before the
next is computed. So a planned path can be executed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ....arrays import Array
from ....pathway.limits.backtracking import SHARES
from ....pathway.limits.limits import Configuration, LinksAt, MotionVerdict
from ....runtime.system import Certificate
from ....snake.control.projection import projected_to_limits
from ....snake.control.tip_control import DistalContext, stops
from ....snake.control.wall_program import WallProgram, joint_regularisation
from ....virtual_fixtures.rows import with_progress
from ..requests import SIDES

SECTOR = math.pi / SIDES  # [rad] a view at most this far from a direction counts for it
_MOST = math.radians(2.0)  # of a joint from one configuration of a path to the next
_AHEAD = math.radians(6.0)  # step of the desired view at each
_ROUNDS = 120  # configurations of a path at most
_STALLED, _GAIN = 10, math.radians(0.1)  # a path ends that has not turned the view by this in so many configurations
_NEAR_MM, _MARGIN_MM = 3.0, 0.02  # vertices this near to their bound get rows, which keep them this far inside it
_REGULARISATION = 1e-2  # weight of a joint's step against an error of the view, both as the motion of a link's end
_STILL = 1e-5  # [rad] a shorter step counts as no motion


@dataclass(frozen=True, eq=False)
class SidePath:
    """A path to look in one direction.

    bends: (n, 2L') rad from the conforming shape, from near rest to the last; empty where there is none.
    turned: rad between the straight view and the last. held_by: the reason of its end.
    """

    bends: Array
    turned: float
    held_by: str


class LookView(NamedTuple):
    """A view relative to the straight one: angle, and direction in its picture, rad."""

    turned: float
    towards: float

    def side(self) -> int:
        """The nearest direction of the look-round."""
        return round(self.towards / (2.0 * SECTOR)) % SIDES

    def looks_to(self, side: int) -> bool:
        """Whether it is within half the angle between two directions of one."""
        away = (self.towards - 2.0 * SECTOR * side + math.pi) % (2.0 * math.pi) - math.pi
        return abs(away) <= SECTOR


def view_of(straight: Array, direction: Array) -> LookView:
    """A direction (3,) seen from a camera whose transform to the patient is ``straight`` (4, 4)."""
    x, y, z = straight[:3, :3].T @ direction
    return LookView(math.atan2(math.hypot(x, y), z), math.atan2(y, x))


class LookPlanner:
    """Paths to look in each direction from one position of the snake.

    Args:
        context: of the distal links; limits: certify their motion; aim: rad, desired angle of the view.
        first: number of the context's first link in the robot.
    """

    def __init__(
        self,
        context: DistalContext,
        limits: Certificate[LinksAt, Configuration, MotionVerdict],
        aim: float,
        first: int,
    ) -> None:
        self.context, self.aim, self._first = context, aim, first
        self._limits = limits
        self._straight = context.snake.camera(context.rest, context.base)

    def plan(self) -> tuple[SidePath, ...]:
        """A path for every direction: from the straight view or, if that ends early, from both neighbours' paths."""
        paths = [self.path(side) for side in range(SIDES)]
        for side in range(SIDES):
            for turn in (1, -1):
                if paths[side].turned < self.aim:
                    other = paths[(side + turn) % SIDES]
                    paths[side] = max(paths[side], self.path(side, other.bends), key=lambda path: path.turned)
        return tuple(paths)

    def path(self, side: int, after: Array | None = None) -> SidePath:
        """From rest, or from the end of another path's bends (n, 2L'), as far in a direction as the bounds permit."""
        before = np.empty((0, self.context.snake.dof)) if after is None else after
        return self._continued(side, [self.context.rest + bend for bend in before], certified=True)

    def ahead(self, q: Array, side: int, count: int) -> tuple[list[Array], str]:
        """The next ``count`` joints (2L',) from q in a direction, and why the path ends there; '' where it
        continues.

        For planning a path piece by piece: it ends where the aim is reached or the view hardly turns further.
        """
        found: list[Array] = []
        before = self._score(q, side)
        for _ in range(count):
            if self._score(q, side) >= self.aim:
                return found, "the aim"
            after = self._step(q, side, True)
            if after is None or float(np.abs(after - q).max()) < _STILL:
                return found, self._stops(q)
            q = after
            found.append(q)
        return found, "" if self._score(q, side) - before >= _GAIN * count / _STALLED else self._stops(q)

    def anywhere(self, side: int, starts: int, seed: int = 0) -> float:
        """Largest angle found, rad, of a view in a direction for any pose within the bounds, reachable or not.

        From rest and from random joints, each projected into the bounds and turned further from there, without a path.
        """
        random, context = np.random.default_rng(seed), self.context
        most = self._continued(side, [], certified=False).turned
        for _ in range(starts):
            q = random.uniform(-context.snake.q_max, context.snake.q_max, context.snake.dof)
            most = max(most, self._continued(side, [q], certified=False).turned)
        return most

    def seen(self, q: Array) -> LookView:
        """The view at joints q (2L',)."""
        return view_of(self._straight, self.context.snake.camera(q, self.context.base)[:3, 2])

    def _continued(self, side: int, shapes: list[Array], certified: bool) -> SidePath:
        """Continue from the last of some shapes, or from rest."""
        context = self.context
        q = shapes[-1] if shapes else context.rest
        found, best, scores, why = len(shapes), 0.0, [self._score(q, side)], "the search"
        shapes = list(shapes)
        for _ in range(_ROUNDS):
            after = self._step(q, side, certified)
            if after is None or float(np.abs(after - q).max()) < _STILL:
                break
            q = after
            shapes.append(q)
            scores.append(self._score(q, side))
            view = self.seen(q)
            if view.looks_to(side) and view.turned > best and (certified or self._within(q)):
                found, best = len(shapes), view.turned
                if best >= self.aim:
                    why = ""
                    break
            if len(scores) > _STALLED and scores[-1] - scores[-1 - _STALLED] < _GAIN:
                break
        if best == 0.0:
            return SidePath(np.empty((0, context.snake.dof)), 0.0, self._stops(q))
        bends = np.array([shape - context.rest for shape in shapes[:found]])
        return SidePath(bends, best, self._stops(shapes[found - 1]) if why else "")

    def _score(self, q: Array, side: int) -> float:
        """How far the view is turned in a direction, rad."""
        view = self.seen(q)
        return math.atan2(math.sin(view.turned) * math.cos(view.towards - 2.0 * SECTOR * side), math.cos(view.turned))

    def _step(self, q: Array, side: int, certified: bool) -> Array | None:
        """The next configuration of a path, or None where there is none."""
        context, snake = self.context, self.context.snake
        step = self._wanted(q, side, certified)
        if step is None:
            return None
        most = 1.0
        for share in SHARES:
            after = snake.clamp(q + share * step)
            if not certified:
                return after
            if share > most:
                continue
            verdict = self._verdict(q, after)
            if verdict.taken:
                return after
            if verdict.exhausted:
                most = share * verdict.part
                continue
            # Follow a wall that curves away from its rows, and return onto it.
            projected = projected_to_limits(replace(context, rest=after), q, share * _MOST)
            if projected is not None and self._verdict(q, projected).taken:
                return projected
        return None

    def _verdict(self, q: Array, after: Array) -> MotionVerdict:
        """The verdict of the hard limits on the motion from one configuration of a path to another."""
        context = self.context
        links = LinksAt(context.packed, context.window, Configuration(context.base, q), context.bound)
        return self._limits.certify(links, Configuration(context.base, after))

    def _wanted(self, q: Array, side: int, certified: bool) -> Array | None:
        """The step of joints (2L',) that turns the view best, as a quadratic program with the walls as rows."""
        context, snake = self.context, self.context.snake
        length, towards = snake.length_mm, 2.0 * SECTOR * side
        view = snake.camera(q, context.base)[:3, 2]
        turned = self.seen(q).turned
        ahead = min(turned + _AHEAD, math.pi)
        flat = math.sin(ahead)
        wanted = self._straight[:3, :3] @ (flat * math.cos(towards), flat * math.sin(towards), math.cos(ahead)) - view
        wanted = length * (wanted - view * float(view @ wanted))
        size = float(np.linalg.norm(wanted))
        if size < _STILL:
            return None
        turning = with_progress(length * np.cross(_axes(context, q), view).T, wanted, 1.0)
        program = WallProgram(context, q, _MOST)
        # Vertices beyond their bound return by one step at a time.
        least = 0.0 if certified else -_MARGIN_MM - _MOST * length
        wall = program.wall(np.zeros(snake.dof), _NEAR_MM, _MARGIN_MM, least)
        return program.solve([turning, joint_regularisation(context, _REGULARISATION)], [wall], size)

    def _depth(self, q: Array) -> Array:
        context = self.context
        frames = context.snake.frames(q, context.base)
        depth: Array = context.query.deviations(context.packed, frames, context.window).depth
        return depth

    def _within(self, q: Array) -> bool:
        return bool((self._depth(q) <= self.context.bound).all())

    def _stops(self, q: Array) -> str:
        """Links at their bounds and joints at their limits, in words."""
        return ", ".join(stops(self.context, q, self._first)) or "no path goes on"


def _axes(context: DistalContext, q: Array) -> Array:
    """Axes (2L', 3) of the joints: the first of a link is the x axis before it, the second its own y."""
    frames = context.snake.frames(q, context.base)
    axes = np.empty((context.snake.dof, 3))
    axes[0::2], axes[1::2] = frames[:-1, :3, 0], frames[1:, :3, 1]
    return axes
