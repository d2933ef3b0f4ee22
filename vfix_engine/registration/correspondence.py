"""Correspondence of two point sets: the assignment with which they fit best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, IndexArray
from ..errors import InputError
from .points import ON_A_LINE, Registration, checked_points, register_points
from .rigid_fit import residual_lengths, rigid_fits

MOST_POINTS = 8  # of the smaller set; 40,320 orders
MOST_IN_LARGER = 40
AMBIGUOUS_RATIO = 3.0  # an order fits about equally well below this multiple of the best order's FRE,
AMBIGUOUS_MM = 1.0  # or below this FRE

_KEPT = 50_000  # partial orders that are extended at once: all there are of 8 points and 8,
_KEPT_OF_MORE = 10_000  # and the limit if the larger set has more
_FITTED = 600  # orders that are fitted, those with the best agreement of mutual distances; a cube has 48 equal ones
_SHOWN = 24  # largest number of candidates


@dataclass(frozen=True, eq=False)
class Candidate:
    """One order. fixed, moving: (k,) indices of the pairs, ascending in the smaller set."""

    fixed: IndexArray
    moving: IndexArray
    registration: Registration

    @property
    def fre_mm(self) -> float:
        """FRE of this order, as ``Registration.fre_mm``."""
        return self.registration.fre_mm


@dataclass(frozen=True, eq=False)
class Match:
    """The order that fits best, and those that fit about equally well.

    candidates: best first; more than one if the layout is symmetric or there are too few points, at most 24.
    second_fre_mm: FRE of the second-best order, candidate or not; None if there is no other.
    """

    candidates: tuple[Candidate, ...]
    second_fre_mm: float | None

    @property
    def registration(self) -> Registration:
        """The fit of the best order."""
        return self.candidates[0].registration

    @property
    def fixed(self) -> IndexArray:
        """IndexArray (k,) of the fixed points in the best order; pair i is ``fixed[i]`` and ``moving[i]``."""
        return self.candidates[0].fixed

    @property
    def moving(self) -> IndexArray:
        """IndexArray (k,) of the moving points in the best order."""
        return self.candidates[0].moving

    @property
    def fre_mm(self) -> float:
        """FRE of the best order."""
        return self.candidates[0].fre_mm

    @property
    def ambiguous(self) -> bool:
        """Whether another order fits about equally well, so that the user must select the right one."""
        return len(self.candidates) > 1


def match_points(fixed: ArrayLike, moving: ArrayLike) -> Match:
    """Find which moving point corresponds to which fixed point.

    All orders are extended point by point; of more than 50,000 (10,000 if the larger set has more than 8 points), only
    those with the best agreement of mutual distances are kept. The 600 best complete orders are fitted, which also
    distinguishes a mirrored order, whose distances agree equally. If one set has more points than the other, all points
    of the smaller one and the best subset of the larger are used.

    An order is also a candidate if its FRE is below three times the best one, or below 1 mm.

    Args:
        fixed, moving: (n, 3) and (m, 3) in mm; the smaller set has 3 to 8 points, the larger at most 40.

    Raises:
        InputError: too few or too many points, or every subset is collinear.
    """
    a, b = checked_points("the fixed points", fixed, 3), checked_points("the moving points", moving, 3)
    few, many = (a, b) if len(a) <= len(b) else (b, a)
    if len(few) > MOST_POINTS or len(many) > MOST_IN_LARGER:
        raise InputError(
            f"{len(a)} and {len(b)} points are too many for all orders; at most {MOST_POINTS} of the smaller set and "
            f"{MOST_IN_LARGER} of the larger can be matched: leave out some, or give them in the same order"
        )
    orders = _orders(few, many)
    orders = orders[_beside_a_line(many[orders]) & _beside_a_line(few[None])]
    if not len(orders):
        raise InputError(
            "no order of these points can be fitted: they lie on a line, about which the rotation is not determined; "
            "add a point beside it"
        )
    rotations, translations = rigid_fits(few[None], many[orders], np.ones(len(few)))
    squares = (residual_lengths(few[None], many[orders], rotations, translations) ** 2).mean(axis=1)
    ranked = np.argsort(squares, kind="stable")
    fre = np.sqrt(squares[ranked])
    last = max(AMBIGUOUS_RATIO * fre[0], AMBIGUOUS_MM)
    candidates, problem = [], None
    for order in orders[ranked[fre <= last]]:
        every = np.arange(len(few), dtype=np.intp)
        first, second = (every, order) if few is a else (order, every)
        try:
            candidates.append(Candidate(first, second, register_points(a[first], b[second])))
        except InputError as error:  # two of its points coincide
            problem = error
        if len(candidates) == _SHOWN:
            break
    if not candidates:
        raise problem or InputError("no order of these points can be fitted")
    return Match(tuple(candidates), float(fre[1]) if len(fre) > 1 else None)


def _beside_a_line(points: Array) -> NDArray[np.bool_]:
    """Mask (k,) of the point sets (k, n, 3) that determine a rotation."""
    spread = np.linalg.svd(points - points.mean(axis=1, keepdims=True), compute_uv=False)
    beside: NDArray[np.bool_] = spread[:, 1] >= ON_A_LINE * spread[:, 0]
    return beside


def _orders(few: Array, many: Array) -> IndexArray:
    """Orders (k, n): row r maps point i of ``few`` to point ``r[i]`` of ``many``, best agreement first."""
    apart_few = np.linalg.norm(few[:, None] - few[None], axis=2)
    apart_many = np.linalg.norm(many[:, None] - many[None], axis=2)
    orders, misfit = np.arange(len(many), dtype=np.intp)[:, None], np.zeros(len(many))
    kept = _KEPT if len(many) <= MOST_POINTS else _KEPT_OF_MORE
    for point in range(1, len(few)):
        before = np.arange(point)
        grown = np.abs(apart_many[orders] - apart_few[point, before][None, :, None]) ** 2  # (k, before, many)
        total = misfit[:, None] + grown.sum(axis=1)
        free = np.ones_like(total, dtype=bool)
        np.put_along_axis(free, orders, False, axis=1)
        row, chosen = np.nonzero(free)
        misfit = total[row, chosen]
        orders = np.concatenate([orders[row], chosen[:, None]], axis=1)
        best = np.argsort(misfit, kind="stable")[: kept if point < len(few) - 1 else _FITTED]
        orders, misfit = orders[best], misfit[best]
    return orders
