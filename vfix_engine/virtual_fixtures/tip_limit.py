"""Limits of where the tip may be, common parts: their rows, and the certificate over the whole motion.

A limit is a function g of the tip's position, its *excess* in mm: negative inside, positive outside, and Lipschitz
continuous with constant 1 (a signed distance). Every accepted pose has g ≤ −``RESERVE_MM``, and between two poses
g ≤ 0: the tip is within C/8 of its chord (``sweep_kernel.acceleration_bound``), and a limit bounds its own excess on a
chord. A motion for which that does not suffice is bisected, like those of the certificate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from ..arrays import Array
from ..errors import InputError, StartRefused
from .fixture import Fixture, Rows, Situation
from .rows import Constraint
from .state import StepState
from .weighted import Weighted

RESERVE_MM = 1e-3  # how far inside every pose is, so that the tip stays inside between two poses
HALVINGS = 5
BUFFER_MM = 0.012  # further distance in the rows, so that the certificate rarely refuses a step
_LARGEST_SHARE = 0.25  # of a limit's size, by which rows may be tightened


class TipPlace(NamedTuple):
    """A position (3,) of the tip and its excess in mm; of a tube also the nearest point (3,) and its arc length."""

    at: Array
    excess: float
    nearest: Array | None = None
    s: float = 0.0


class TipLimit(ABC):
    """A fixture that limits where the tip may be; its rows are those of the kind."""

    @property
    @abstractmethod
    def words(self) -> str:
        """Description of the limit, as in a reason: 'the tube of 1.5 mm about the path'."""

    @abstractmethod
    def look(self, place: Array) -> TipPlace:
        """The excess of a position (3,)."""

    @abstractmethod
    def between(self, one: TipPlace, two: TipPlace) -> float:
        """The limit's own bound in mm of the excess on the chord between two positions."""

    @abstractmethod
    def start_words(self, room: float) -> str:
        """Why a tip with so much room in mm, of which there is too little, cannot start, and what to do."""

    def narrowed(self, by_mm: float) -> TipLimit:
        """The limit that an undeflected tip keeps so that one which a hand deflects by up to ``by_mm`` keeps this one.

        Raises:
            InputError: it leaves no room, or is of a class that cannot be narrowed.
        """
        if not by_mm:
            return self
        try:
            return self._narrowed(by_mm)
        except InputError as error:
            raise InputError(
                f"{self.words} has no room for the deflection of {by_mm:g} mm under the force cap, which the robot "
                f"compensates: make it wider, or lower the force cap or the compliance ({error})"
            ) from None

    def _narrowed(self, by_mm: float) -> TipLimit:
        raise InputError(f"a {type(self).__name__} does not know how to be narrowed")

    def room(self, state: StepState) -> float:
        """Distance in mm from the tip to the limit's surface; negative outside."""
        return -self.look(state.tip.position).excess

    def refuse_start(self, state: StepState, parts: Sequence[str]) -> None:
        """Refuse a tip outside (HAZ-04). Raises StartRefused."""
        room = self.room(state)
        if not room >= RESERVE_MM:
            raise StartRefused(self.start_words(room))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        """Whether the tip stays inside during the whole motion, or from outside never gets further out."""
        return stays_inside(before, after, self)


def tip_limits(fixtures: Sequence[Fixture]) -> tuple[TipLimit, ...]:
    """The tubes and envelopes among fixtures, in their order, also those that have a weight."""
    inner = [one.fixture if isinstance(one, Weighted) else one for one in fixtures]
    return tuple(one for one in inner if isinstance(one, TipLimit))


def narrowed(fixtures: Sequence[Fixture], by_mm: float) -> tuple[Fixture, ...]:
    """Fixtures with their tubes and envelopes narrowed, see ``TipLimit.narrowed``. Raises InputError."""

    def one(fixture: Fixture) -> Fixture:
        if isinstance(fixture, Weighted):
            return replace(fixture, fixture=one(fixture.fixture))
        if isinstance(fixture, TipLimit):
            return cast(Fixture, fixture.narrowed(by_mm))  # every limit has the rows of its kind
        return fixture

    return tuple(one(fixture) for fixture in fixtures) if by_mm else tuple(fixtures)


def tightened_mm(now: Situation, size_mm: float, bend_mm: float = 0.0) -> float:
    """By how many mm the rows of a limit are tightened: reserve, buffer, and the error of their linearisation.

    A row stays at the tangent plane of the limit at the tip's direction. A step of length δ that keeps it ends at most
    δ² / 2R beyond a round limit of radius R. δ is the wanted step, or that of the present velocity if it is longer.

    Args:
        size_mm: R; ∞ for a plane limit. bend_mm: estimate of how far the limit itself turns away within δ.
    """
    travel = travel_mm(now)
    return min(RESERVE_MM + BUFFER_MM + 0.5 * travel * travel / size_mm + bend_mm, _LARGEST_SHARE * size_mm)


def travel_mm(now: Situation) -> float:
    """δ: length in mm of the wanted step, or of the step with the present velocity if that is longer."""
    going = float(np.linalg.norm(now.state.tip.jacobian[:3] @ now.state.velocity)) * now.dt_s
    return max(now.scale_mm, going)


def inside_rows(kind: str, words: str, now: Situation, normals: Array, room: Array) -> Rows:
    """Rows u·J Δq ≤ w(room) for outward unit vectors u (m, 3), with w the longest step that can stop within the room.

    Beyond its row the tip retreats while it moves, as from a margin of bone (``stopping.approach_bound``).
    """
    matrix = np.zeros((len(normals), now.state.tip.jacobian.shape[1] + 1))
    matrix[:, :-1] = normals @ now.state.tip.jacobian[:3]
    bound = now.stop_before(np.ascontiguousarray(room))
    return Rows((), (Constraint(kind, matrix, bound, np.arange(len(bound)), (words,)),))


def stays_inside(before: StepState, after: StepState, limit: TipLimit) -> bool:
    """Whether the tip stays inside during the whole motion, or from a start outside never gets further out.

    On the chord between two positions a distance h apart the excess is at most (g₀ + g₁ + h) / 2, since it is Lipschitz
    continuous; a limit usually knows less.
    """
    look = limit.look
    first, last = look(before.tip.position), look(after.tip.position)
    allowed = max(first.excess, -RESERVE_MM)
    if not last.excess <= allowed:  # NaN is refused as well
        return False
    # The tip of states made by hand is taken to move along its chord.
    sag = 0.0 if after.context is None else after.context.sag_mm(before, after)
    most = allowed + RESERVE_MM
    grid = 1 << HALVINGS
    waiting = [(0, grid, first, last)]
    while waiting:
        i, j, one, two = waiting.pop()
        lipschitz = 0.5 * (one.excess + two.excess + float(np.linalg.norm(two.at - one.at)))
        if min(limit.between(one, two), lipschitz) + sag * ((j - i) / grid) ** 2 <= most:
            continue
        if j - i == 1:
            return False
        half = (i + j) // 2
        middle = look(_place(before, after, half / grid))
        if not middle.excess <= allowed:
            return False
        waiting += [(half, j, middle, two), (i, half, one, middle)]
    return True


def _place(before: StepState, after: StepState, share: float) -> Array:
    """(3,) of the tip after a share of the motion."""
    if after.context is None:
        first: Array = before.tip.position
        return first + share * (after.tip.position - first)
    found: Array = after.context.robot.tip_pose(before.q + share * (after.q - before.q))[1]
    return found
