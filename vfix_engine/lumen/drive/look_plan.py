"""Where the view can be turned to: bends of the distal links that look to a side, and a way to each of them.

The bends (10)-(19) of Kwok 2013 have two parameters and are made for the tip's place. In a lumen whose own bends have
the joints at their limits they turn the view to few sides. Here all joints are free: a quadratic program turns the view
a little, slides along the walls, and every piece of the way is certified by the hard limits before the next is looked
for. So what is planned is what the robot can do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...control.qp import solve, stack
from ...fixtures import Constraint, Objective
from ...fixtures.rows import with_progress
from ..control.ease import eased
from ..control.tip_control import Place, stops
from ..control.wall_rows import wall_rows
from ..limits.limits import Configuration, HardLimits

Array = NDArray[np.float64]

SIDES = 8  # directions about the straight view; 0 is to the right in its picture, and they go round clockwise
SECTOR = math.pi / SIDES  # [rad] a view that is no farther than that from a side's direction looks to that side
_MOST = math.radians(2.0)  # of a joint from one place of a way to the next
_AHEAD = math.radians(6.0)  # so much farther the view is wanted at each
_ROUNDS = 120  # places of a way at most
_STALLED, _GAIN = 10, math.radians(0.1)  # a way ends that has not turned the view by that in so many places
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a wanted piece, tried in turn
_NEAR_MM, _KEEP_MM = 3.0, 0.02  # vertices so near to their bound get rows, which hold them that much inside of it
_SMALL_MOTION = 1e-2  # of a joint's step against an error of the view, both as the way of a link's end
_STILL = 1e-5  # [rad] a step that is none


@dataclass(frozen=True, eq=False)
class SideWay:
    """A way to look to one side.

    bends: (n, 2L') rad from the conforming shape, from near rest to the last; empty where there is none.
    turned: rad between the straight view and the last. held_by: in words, what ends it.
    """

    bends: Array
    turned: float
    held_by: str


class View(NamedTuple):
    """A view against the straight one: how far turned, and to where in its picture, rad."""

    turned: float
    towards: float

    def side(self) -> int:
        """The side that it looks to."""
        return round(self.towards / (2.0 * SECTOR)) % SIDES

    def looks_to(self, side: int) -> bool:
        """Whether it is no farther than half the angle between two sides from one."""
        away = (self.towards - 2.0 * SECTOR * side + math.pi) % (2.0 * math.pi) - math.pi
        return abs(away) <= SECTOR


def view_of(straight: Array, direction: Array) -> View:
    """A direction (3,) seen from a camera whose transform to the patient is ``straight`` (4, 4)."""
    x, y, z = straight[:3, :3].T @ direction
    return View(math.atan2(math.hypot(x, y), z), math.atan2(y, x))


class LookPlanner:
    """Ways to look to each side from one place.

    Args:
        place: of the distal links; limits: that certify their motion; aim: rad, how far the view is to be turned.
    """

    def __init__(self, place: Place, limits: HardLimits, aim: float) -> None:
        self.place, self.aim = place, aim
        self._limits = limits
        self._straight = place.snake.camera(place.rest, place.base)

    def plan(self) -> tuple[SideWay, ...]:
        """A way for every side: from the straight view, and where that ends early on from those of both neighbours."""
        ways = [self.way(side) for side in range(SIDES)]
        for side in range(SIDES):
            for turn in (1, -1):
                if ways[side].turned < self.aim:
                    other = ways[(side + turn) % SIDES]
                    ways[side] = max(ways[side], self.way(side, other.bends), key=lambda way: way.turned)
        return tuple(ways)

    def way(self, side: int, after: Array | None = None) -> SideWay:
        """From rest, or from the end of another way's bends (n, 2L'), as far towards a side as the bounds let it."""
        before = np.empty((0, self.place.snake.dof)) if after is None else after
        return self._walked(side, [self.place.rest + bend for bend in before], certified=True)

    def anywhere(self, side: int, starts: int, seed: int = 0) -> float:
        """The most, rad, that any pose within the bounds was found to turn the view to a side, reachable or not.

        From rest and from random joints, each brought into the bounds and turned on from there; ways are not asked for.
        """
        random, place = np.random.default_rng(seed), self.place
        most = self._walked(side, [], certified=False).turned
        for _ in range(starts):
            q = random.uniform(-place.snake.q_max, place.snake.q_max, place.snake.dof)
            most = max(most, self._walked(side, [q], certified=False).turned)
        return most

    def seen(self, q: Array) -> View:
        """The view at joints q (2L',)."""
        return view_of(self._straight, self.place.snake.camera(q, self.place.base)[:3, 2])

    def _walked(self, side: int, shapes: list[Array], certified: bool) -> SideWay:
        """On from the last of some shapes, or from rest."""
        place = self.place
        q = shapes[-1] if shapes else place.rest
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
            return SideWay(np.empty((0, place.snake.dof)), 0.0, self._stops(q))
        bends = np.array([shape - place.rest for shape in shapes[:found]])
        return SideWay(bends, best, self._stops(shapes[found - 1]) if why else "")

    def _score(self, q: Array, side: int) -> float:
        """How far the view looks towards a side, rad."""
        view = self.seen(q)
        return math.atan2(math.sin(view.turned) * math.cos(view.towards - 2.0 * SECTOR * side), math.cos(view.turned))

    def _step(self, q: Array, side: int, certified: bool) -> Array | None:
        """The next place of a way, or None where there is none."""
        place, snake = self.place, self.place.snake
        step = self._wanted(q, side, certified)
        if step is None:
            return None
        for share in _SHARES:
            after = snake.clamp(q + share * step)
            if not certified or self._taken(q, after):
                return after
            # Along a wall that bends away from its rows, and back onto it.
            eased_q = eased(replace(place, rest=after), q, share * _MOST)
            if eased_q is not None and self._taken(q, eased_q):
                return eased_q
        return None

    def _taken(self, q: Array, after: Array) -> bool:
        """Whether the hard limits let the robot go from one place of a way to another."""
        place = self.place
        poses = Configuration(place.base, q), Configuration(place.base, after)
        return self._limits.certify(place.packed, place.window, *poses, place.bound).taken

    def _wanted(self, q: Array, side: int, certified: bool) -> Array | None:
        """The step of joints (2L',) that turns the view best, as a quadratic program with the walls as rows."""
        place, snake = self.place, self.place.snake
        n, length, towards = snake.dof, snake.length_mm, 2.0 * SECTOR * side
        view = snake.camera(q, place.base)[:3, 2]
        turned = self.seen(q).turned
        ahead = min(turned + _AHEAD, math.pi)
        flat = math.sin(ahead)
        wanted = self._straight[:3, :3] @ (flat * math.cos(towards), flat * math.sin(towards), math.cos(ahead)) - view
        wanted = length * (wanted - view * float(view @ wanted))
        size = float(np.linalg.norm(wanted))
        if size < _STILL:
            return None
        lever = np.zeros((n, n + 1))
        lever[:, :n] = length * np.eye(n)
        turning = with_progress(length * np.cross(_axes(place, q), view).T, wanted, 1.0)
        low, high = np.maximum(-_MOST, -snake.q_max - q), np.minimum(_MOST, snake.q_max - q)
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        rows = wall_rows(place, q, _NEAR_MM)
        room = rows.room - _KEEP_MM
        room = np.maximum(room, 0.0 if certified else -_KEEP_MM - _MOST * length)  # of what is beyond, a step at a time
        wall = Constraint("wall", rows.matrix, room, rows.vertex, ("the wall of the pathway",))
        answer = solve(stack([turning, Objective(lever, np.zeros(n), _SMALL_MOTION)], [wall], low, high, size))
        return None if answer is None else np.clip(answer.step, low, high)

    def _depth(self, q: Array) -> Array:
        place = self.place
        frames = place.snake.frames(q, place.base)
        depth: Array = place.query.deviations(place.packed, frames, place.window).depth
        return depth

    def _within(self, q: Array) -> bool:
        return bool((self._depth(q) <= self.place.bound).all())

    def _stops(self, q: Array) -> str:
        """Links at their bounds and joints at their limits, in words."""
        return ", ".join(stops(self.place, q, self._limits.first)) or "no way on"


def _axes(place: Place, q: Array) -> Array:
    """Axes (2L', 3) that the joints turn about: the first of a link is the x axis before it, the second its own y."""
    frames = place.snake.frames(q, place.base)
    axes = np.empty((place.snake.dof, 3))
    axes[0::2], axes[1::2] = frames[:-1, :3, 0], frames[1:, :3, 1]
    return axes
