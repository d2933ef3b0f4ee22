"""Tube about a path: the tip stays within a radius of it, a limit of the position error (Li 2007, III.C, step 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from dataclasses import field as made

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..geometry.path import SplinePath
from ..geometry.transport import across, transported
from ..kernels.triples import cross, triple
from .fixture import Rows, Situation
from .polyhedra import BALL_DIRECTIONS
from .state import StepState
from .tip_limit import TipLimit, TipPlace, inside_rows, tightened_mm, travel_mm
from .zones import check_number

NARROWEST_MM, WIDEST_MM = 0.05, 50.0
SIDES = 16  # planes around the tube, besides the one that faces the tip
_STATION_MM = 0.5  # between the stored directions of the first side
_FACING = 1e-3  # of the radius: a tip nearer to the path than that has no outward direction
_OUTWARD = 0.1  # sine of the elevation from which on a plane closes an end of the tube


@dataclass(frozen=True, eq=False)
class PathTube(TipLimit):
    """The tip is at most ``radius_mm`` from the path, at every instant of every motion; the ends are half balls.

    Rows: the tube's tangent plane that faces the tip, 16 planes around the tangent of the path, in directions that are
    transported along it, and near an end those of 32 even directions that point out of it. They contain the straight
    continuation of the tube at the path's nearest point, and cut a curved one. They only shape the step, tightened by
    an estimate of what it may exceed (``tip_limit.tightened_mm``); the check over the whole motion decides.

    Certificate: let c₀ and c₁ be the path's points nearest to the ends of a chord, w their distance and l the arc
    between them. Every point between c₀ and c₁ is within √(l² − w²) / 2 of the arc, which lies in the ellipse with
    these foci. So on the chord the tip is at most max(d₀, d₁) + √(l² − w²) / 2 from the path.

    A start outside is refused. From a state outside that was measured elsewhere, the tip may only come nearer.

    Args:
        path: in the patient frame, mm; all of it counts, on whichever branch the tip is.
        radius_mm: 0.05 to 50.

    Raises:
        InputError: the path is not a ``SplinePath``, or the radius is out of range.

    Example:
        >>> path = SplinePath([(0, 0, 0), (0, 10, 0), (0, 30, 0)])
        >>> PathTube(path, 1.5).words
        'the tube of 1.5 mm about the path'
    """

    path: SplinePath
    radius_mm: float
    _sides: Array = made(init=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.path, SplinePath):
            raise InputError(f"a tube is about a SplinePath, not a {type(self.path).__name__}")
        radius = check_number(self.radius_mm, "the radius of a tube in mm")
        if not NARROWEST_MM <= radius <= WIDEST_MM:  # NaN fails as well
            raise InputError(f"a tube's radius is {radius:g} mm; allowed is {NARROWEST_MM:g} … {WIDEST_MM:g} mm")
        object.__setattr__(self, "radius_mm", radius)
        at = np.linspace(0.0, self.path.length, max(2, math.ceil(self.path.length / _STATION_MM) + 1))
        object.__setattr__(self, "_sides", transported(self.path.position(at), self.path.tangent(at)))

    @property
    def words(self) -> str:
        """\"the tube of 1.5 mm about the path\"."""
        return f"the tube of {self.radius_mm:g} mm about the path"

    def start_words(self, room: float) -> str:
        """Why a tip that far from the path cannot start, and what to do."""
        return (
            f"the tip would start {self.radius_mm - room:.2f} mm from the path, outside {self.words}; "
            "start nearer to the path, or make the tube wider"
        )

    def _narrowed(self, by_mm: float) -> PathTube:
        return PathTube(self.path, self.radius_mm - by_mm)

    def warm_up(self, state: StepState) -> None:
        """Load the kernels; nothing moves."""
        self._planes(state.tip.position, 0.1)
        self.is_admissible(state, state)

    def rows(self, now: Situation) -> Rows:
        """17 constraint rows in mm, 16 on the path itself, and up to 16 more near an end."""
        normals, reach, bend = self._planes(now.state.tip.position, travel_mm(now))
        room = reach + self.radius_mm - tightened_mm(now, self.radius_mm, bend)
        return inside_rows("tube", self.words, now, normals, room)

    def look(self, place: Array) -> TipPlace:
        """The excess of a position (3,), its nearest point of the path and the arc length of that."""
        s, nearest, _ = self.path.closest(place)
        return TipPlace(place, float(np.linalg.norm(place - nearest)) - self.radius_mm, nearest, s)

    def between(self, one: TipPlace, two: TipPlace) -> float:
        """The bound of the certificate above: max(d₀, d₁) + √(l² − w²) / 2, less the radius."""
        assert one.nearest is not None
        assert two.nearest is not None
        chord, arc = float(np.linalg.norm(two.nearest - one.nearest)), two.s - one.s
        return max(one.excess, two.excess) + 0.5 * math.sqrt(max(arc * arc - chord * chord, 0.0))

    def _planes(self, tip: Array, travel: float) -> tuple[Array, Array, float]:
        """Outward unit vectors (m, 3), how far the tube's core reaches beyond the tip along each, and its bend in mm.

        The core is the path within ``travel`` of the point nearest to the tip. Where it ends, the planes of that end
        close the tube; elsewhere the sides go on. The bend is estimated: how far its ends are from the tangent.
        """
        s, nearest, tangent = self.path.closest(tip)
        first, last = self.path.position(np.array([s - travel, s + travel]))
        side = across(tangent, self._sides[round(s / self.path.length * (len(self._sides) - 1))])
        angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
        around = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.array(cross(triple(tangent), triple(side)))
        planes, reach = [around], [around @ (nearest - tip)]
        away = tip - nearest
        distance = float(np.linalg.norm(away))
        if distance > _FACING * self.radius_mm:
            planes.append(away[None] / distance)
            reach.append(np.array([-distance]))
        for end, out, beyond in ((first, -tangent, s - travel), (last, tangent, self.path.length - s - travel)):
            if beyond <= 0.0:
                closing = BALL_DIRECTIONS[BALL_DIRECTIONS @ out > _OUTWARD]
                planes.append(closing)
                reach.append(closing @ (end - tip))
        aside = np.array([first, last]) - nearest
        aside -= np.outer(aside @ tangent, tangent)
        bend = float(np.linalg.norm(aside, axis=1).max())
        return np.concatenate(planes), np.concatenate(reach), bend
