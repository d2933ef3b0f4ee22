"""A snake along a curve, inserted with every joint following the one ahead.

Kwok 2013, section III.A: the joint centres are on the lumen's centreline. Where the limits allow that it is computed in
closed form. The flexures of a colon bend more than joints of ± 45° over 28 mm can, which the paper neglects;
there the nearest chain that keeps the limits is found by bounded least squares over all joints at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, BoolArray
from ...errors import PathwayError
from ...geometry.curve import Curve
from ...geometry.transport import transported
from ...robots.snake import SnakeModel
from .conform_kernel import CENTRE, GUIDE, MIDDLE, SLACK, STAY, STEEP, TIP, ChainTask, CurveSamples
from .conform_solve import settle_chain
from .joint_places import angles_between, frame_on_curve, joint_places

FASTEST = 0.1  # [rad/mm] change of an angle per millimetre of insertion where the limits bind
_STEP = 1.0  # [mm] of insertion between two solutions
_ROLLS = 8  # rolls tried for the base; the limits are the same after a quarter turn
_ROLL_STEP = 5.0  # [mm] of insertion between the positions at which a roll is measured
_FEED = 3.0  # [mm/mm] how much faster than its tip the base may go where the limits bind
_SLIP = 10.0  # [mm] largest lag of the tip that one solution corrects
_SETTLE = 200  # iterations of a solution without a previous one
_FOLLOW = 6  # iterations of a solution that follows one
_ANEW = 20  # iterations of a solution that follows one on a moved curve
_ALIGNED = 1e-9  # [rad] of a link that is straight
_DEFAULT_ROOM = 4.0  # [mm] around the curve by default


@dataclass(frozen=True, eq=False)
class ShapeSolution:
    """A snake along a curve.

    base: (4, 4) transform_base_to_patient. q: (2L,) rad. joint_s: (L + 1,) arc length in mm of base joint … tip, of the
    nearest point of the curve where they are off it; negative before its start. offset_mm: (L + 1,) distance of each
    joint centre to the curve. at_limit: (2L,) which angles are at ± q_max. exact: every joint centre is on the curve.
    tip_s: desired arc length of the tip, mm; where the limits bind it may lag behind. roll: rad, of the base about
    the curve. curve: the curve itself.
    """

    base: Array
    q: Array
    joint_s: Array
    offset_mm: Array
    at_limit: BoolArray
    exact: bool
    tip_s: float
    roll: float
    curve: Curve = field(repr=False)

    @property
    def links_inside(self) -> int:
        """Number of links whose far end is beyond the curve's start."""
        return int((self.joint_s[1:] > 0.0).sum())


_known: WeakKeyDictionary[Curve, Array] = WeakKeyDictionary()


def _across(curve: Curve, before: Curve | None = None) -> Array:
    """The transported directions (N, 3) along a curve, computed once; the first is near that of the previous curve.

    Another first direction could jump by a quarter turn as a curve moves slightly, and the base's roll with it.
    """
    found = _known.get(curve)
    if found is None:
        found = transported(curve.points, curve.tangents, None if before is None else _across(before)[0])
        found.setflags(write=False)
        _known[curve] = found
    return found


class _Chain:
    """One snake on one curve: everything that does not depend on the depth."""

    def __init__(
        self,
        snake: SnakeModel,
        curve: Curve,
        slack: ArrayLike | None,
        roll: float | None,
        outside: bool,
        deepest: float | None = None,
    ):
        self.snake, self.curve, self.outside = snake, curve, outside
        self.points, self.tangents = curve.points, curve.tangents
        self.across = _across(curve)
        self.slack = _checked_slack(slack, len(self.points))
        self.slack.setflags(write=False)
        if not outside:
            self._fits()
        self.roll = self._best_roll(curve.length if deepest is None else deepest) if roll is None else float(roll)

    def _fits(self) -> None:
        reach, link = self.snake.reach_mm(), self.snake.length_mm
        if reach > self.curve.length:
            raise PathwayError(
                f"{self.snake.links} links of {link:g} mm are {reach:g} mm long, the path has "
                f"{self.curve.length:.0f} mm: take {int(self.curve.length / link)} links or a longer path"
            )

    def check(self, tip_s: float) -> None:
        """Check that the tip can be there.

        Raises:
            PathwayError: it cannot.
        """
        if not math.isfinite(tip_s):
            raise PathwayError("the depth of the tip is not finite")
        if tip_s > self.curve.length + 1e-9:
            raise PathwayError(
                f"the robot would be {tip_s - self.curve.length:.3g} mm beyond the end of the path "
                f"({self.curve.length:.1f} mm): insert less, or set the end farther in"
            )

    def exact(self, tip_s: float, roll: float) -> tuple[Array, Array, Array, Array, float]:
        """Arc lengths, joint centres, base rows, angles with all joints on the curve, and the largest angle."""
        links = self.snake.links
        places, joints = np.empty(links + 1), np.empty((links + 1, 3))
        base, q = np.empty((3, 4)), np.empty(2 * links)
        step = self.curve.step_mm
        joint_places(self.points, self.tangents, step, tip_s, self.snake.length_mm, places, joints)
        frame_on_curve(self.points, self.tangents, self.across, step, places[0], roll, base)
        largest = angles_between(joints, base, q)
        return places, joints, base, q, largest

    def _best_roll(self, deepest: float) -> float:
        """The roll of the base that exceeds the joint limits least over the whole insertion."""
        depths = np.arange(0.0, min(self.curve.length, deepest), _ROLL_STEP)
        rolls = np.arange(_ROLLS) * (0.5 * math.pi / _ROLLS)
        beyond = [self._beyond(depths, roll) for roll in rolls]
        return float(rolls[int(np.argmin(beyond))])

    def _beyond(self, depths: Array, roll: float) -> float:
        total = 0.0
        for depth in depths:
            q = self.exact(float(depth), roll)[3]
            total += float((np.maximum(np.abs(q) - self.snake.q_max, 0.0) ** 2).sum())
        return total

    def on_curve(self, tip_s: float) -> ShapeSolution | None:
        """All joint centres on the curve, or None where the limits do not allow it."""
        places, _, base, q, largest = self.exact(tip_s, self.roll)
        if largest > self.snake.q_max:
            return None
        return self._finished(base, q, places, tip_s, True)

    def nearest(self, tip_s: float, near: ShapeSolution | None, moved: float, most: float = math.inf) -> ShapeSolution:
        """The nearest chain within the limits; after another one with the change of angles permitted for ``moved`` mm.

        most: rad, permitted change on a moved curve, where no insertion determines it.
        """
        links, limit = self.snake.links, self.snake.q_max
        state, places = np.empty(2 * links + 1), np.empty(2 * links)
        joint_s, _, _, q, largest = self.exact(tip_s, self.roll)
        low, high = np.full(len(state), -limit), np.full(len(state), limit)
        low[-1], high[-1], turns, target = -math.inf, math.inf, _SETTLE, tip_s
        state[:-1] = q
        if near is not None:
            joint_s = near.joint_s + moved
            target = min(tip_s, float(joint_s[-1]) + _SLIP)
            state[:-1] = _convected(near.q, moved / self.snake.length_mm)
            turns = _ANEW
        if near is not None:
            pace = FASTEST * abs(moved) if near.curve is self.curve else most
            low[:-1], high[:-1] = np.maximum(low[:-1], near.q - pace), np.minimum(high[:-1], near.q + pace)
        if near is not None and near.curve is self.curve:
            low[-1], high[-1] = near.joint_s[0] - _FEED * abs(moved), near.joint_s[0] + _FEED * abs(moved)
            turns = _FOLLOW
        state[-1] = joint_s[0]
        places[0::2], places[1::2] = 0.5 * (joint_s[:-1] + joint_s[1:]), joint_s[1:]
        out = 0 if near is None else _straight_outside(near, self.snake.length_mm)
        before = np.arange(-out, 0.0) * self.snake.length_mm  # of the joints that stay outside
        state[-1] = joint_s[out]
        for feed in (low, high):
            feed[-1] -= before[0] if out else 0.0
        state, places, low, high = state[2 * out :], places[2 * out :], low[2 * out :], high[2 * out :]
        line = CurveSamples(self.points, self.tangents, self.across, self.slack, self.curve.step_mm)
        task = ChainTask(self.snake.length_mm, self.roll, target, _weights(largest <= limit), state.copy())
        base, frames = np.empty((3, 4)), np.empty((links - out, 3, 4))
        settle_chain(line, task, low, high, turns, state, places, base, frames)
        q = np.concatenate([np.zeros(2 * out), state[:-1]])
        if out:  # straight before the curve's start, where all frames are parallel
            base[:, 3] += before[0] * base[:, 2]
        return self._finished(base, q, np.concatenate([state[-1] + before, state[-1:], places[1::2]]), tip_s, False)

    def _finished(self, base: Array, q: Array, joint_s: Array, tip_s: float, exact: bool) -> ShapeSolution:
        whole = np.eye(4)
        whole[:3] = base
        joints = self.snake.frames(q, whole)[:, :3, 3]
        offset = np.linalg.norm(joints - self.curve.position(joint_s), axis=1)
        at_limit = np.abs(q) >= self.snake.q_max - 1e-9
        for array in (whole, q, joint_s, offset, at_limit):
            array.setflags(write=False)
        return ShapeSolution(whole, q, joint_s, offset, at_limit, exact, tip_s, self.roll, self.curve)

    def follow(self, tip_s: float, near: ShapeSolution, moved: float) -> ShapeSolution:
        """The next after ``near``, with the tip ``moved`` mm, at most one step, farther."""
        found = self.on_curve(tip_s)
        if found is not None:
            change = float(np.abs(found.q - near.q).max())
            if near.exact or change <= FASTEST * abs(moved):
                return found
        return self.nearest(tip_s, near, moved)


def _straight_outside(near: ShapeSolution, length: float) -> int:
    """Number of links, from the base on, that are straight and so far outside that the next step does not change them.

    So the shape inside does not depend on how many links are still outside.
    """
    far = (near.joint_s[1:] < -length) & (np.abs(near.q.reshape(-1, 2)) < _ALIGNED).all(axis=1)
    return int(np.append(far[:-1], False).argmin())


def _convected(q: Array, share: float) -> Array:
    """The angles of a snake whose joints have advanced by a fraction of a link, each approaching the one ahead."""
    pairs = q.reshape(-1, 2)
    ahead = np.vstack([pairs[1:], pairs[-1:]] if share >= 0.0 else [np.zeros((1, 2)), pairs[:-1]])
    moved: Array = ((1.0 - abs(share)) * pairs + abs(share) * ahead).reshape(-1)
    return moved


def _weights(feasible: bool) -> Array:
    """The weights of the least squares; where all joints can be on the curve, only of their distance to it."""
    weights = np.empty(7)
    weights[CENTRE], weights[SLACK], weights[MIDDLE] = (1.0, 0.0, 0.0) if feasible else (0.1, 1.0, 1.0)
    weights[GUIDE], weights[TIP], weights[STAY], weights[STEEP] = 10.0, 1000.0, 1.0, 2.0
    return weights


def _checked_slack(slack: ArrayLike | None, count: int) -> Array:
    if slack is None:
        return np.full(count, _DEFAULT_ROOM)
    found = np.array(slack, dtype=np.float64)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise PathwayError(f"the slack about a curve of {count} points is ({count},) finite, not {found.shape}")
    return np.maximum(found, 0.0)


def conform(
    snake: SnakeModel,
    curve: Curve,
    tip_s: float,
    near: ShapeSolution | None = None,
    slack: ArrayLike | None = None,
    roll: float | None = None,
    outside: bool = True,
    most: float = math.inf,
) -> ShapeSolution:
    """The snake along a curve with its tip at ``tip_s`` mm, the joints that are still outside straight before its
    start.

    Args:
        snake: any number of links.
        curve: in the patient frame.
        tip_s: arc length of the tip, at most the curve's.
        near: the present shape; on this curve the angles change by at most 0.1 rad per
            millimetre where the limits bind; a shape on another curve is the initial guess.
        slack: (N,) mm at ``curve.points``: how far off the curve a joint centre may be; None: 4 mm.
        roll: rad, of the base about the curve; None: that of ``near``, else the one of eight that demands least of the
            joints.
        outside: whether links may be before the curve's start.
        most: rad, by which an angle may differ from that of ``near`` on another curve.

    Raises:
        PathwayError: a tip beyond the curve's end, or a snake longer than the curve if links may not be outside.
    """
    if near is not None:
        roll = near.roll if roll is None else roll
        _across(curve, near.curve)
    chain = _Chain(snake, curve, slack, roll, outside)
    chain.check(tip_s)
    if near is not None and near.curve is curve:
        return _walked(chain, near, tip_s - near.tip_s, tip_s)
    found = chain.on_curve(tip_s)
    if found is not None and (near is None or float(np.abs(found.q - near.q).max()) <= most):
        return found
    return chain.nearest(tip_s, near, 0.0 if near is None else tip_s - near.tip_s, most)


def _walked(chain: _Chain, state: ShapeSolution, distance: float, tip_s: float) -> ShapeSolution:
    if distance == 0.0:
        return state
    steps = max(math.ceil(abs(distance) / _STEP - 1e-9), 1)
    for number in range(steps):
        left = (steps - 1 - number) / steps
        state = chain.follow(tip_s - left * distance, state, distance / steps)
    return state


class Insertion:
    """Follow-the-leader: insertion of a snake along a curve, and retraction along the same path.

    Args:
        snake, curve, slack, roll: as for ``conform``.
        tip_s: initial arc length of the tip, mm; by default the curve's start, with the snake straight before it.
        deepest: mm, largest arc length of the tip, for which the roll is chosen; None: the curve's end.
    """

    def __init__(
        self,
        snake: SnakeModel,
        curve: Curve,
        slack: ArrayLike | None = None,
        roll: float | None = None,
        tip_s: float = 0.0,
        deepest: float | None = None,
    ):
        self._chain = _Chain(snake, curve, slack, roll, True, deepest)
        self._chain.check(tip_s)
        place = float(tip_s)
        state = self._chain.on_curve(place)
        self._state = self._chain.nearest(place, None, 0.0) if state is None else state

    @property
    def state(self) -> ShapeSolution:
        """The present shape of the snake."""
        return self._state

    @property
    def tip_s(self) -> float:
        """Arc length of the tip in mm."""
        return self._state.tip_s

    @property
    def roll(self) -> float:
        """Of the base about the curve, rad."""
        return self._chain.roll

    @property
    def links_inside(self) -> int:
        """Number of links whose far end is beyond the curve's start."""
        return self._state.links_inside

    def advance(self, ds: float) -> ShapeSolution:
        """Advance the tip by ``ds`` mm, or retract it where that is negative.

        Where all joints can be on the curve its angles are those of the curve; elsewhere none changes by more than
        0.1 rad per millimetre.

        Raises:
            PathwayError: a tip beyond the curve's end, or a depth that is not finite; the snake does not move.
        """
        self._state = self.after(self._state, ds)
        return self._state

    def after(self, state: ShapeSolution, ds: float) -> ShapeSolution:
        """As ``advance``, from any shape along the curve; this insertion does not change."""
        target = state.tip_s + ds
        self._chain.check(target)
        return _walked(self._chain, state, ds, target)
