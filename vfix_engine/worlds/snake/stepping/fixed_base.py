"""A robot on a fixed base: all its links are bent from one nominal shape, and nothing is inserted.

Kwok 2013, section IV.C.2, study II, and fig. 8: the base stands in a cavity, L = L' links are bent about q̃, and each
link is measured against the whole pathway of the cavity, from its first contour to its last.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ....arrays import IntArray
from ....errors import InputError
from ....geometry.curve import Curve
from ....pathway.pathway import Pathway
from ....robots.snake import SnakeModel
from ....snake.conform.conformance import ShapeSolution
from ....validate import real_array, rigid_transform
from ..settings import DriveSettings

HELD = "the base is fixed: nothing is inserted or drawn back"


def fixed_shape(snake: SnakeModel, base: ArrayLike, q_nominal: ArrayLike | None, curve: Curve) -> ShapeSolution:
    """The nominal shape on a fixed base, in place of one that conforms to a curve.

    Args:
        base: (4, 4) transform_base_to_patient, z along the first link at rest.
        q_nominal: (2L,) q̃ in rad, None: straight.
        curve: of the pathway's centres; its arc lengths mean nothing here, and the tip's is 0.

    Raises:
        InputError: a base that is no rigid transform, or joints that are not 2L angles within their range.
    """
    stands = rigid_transform(base, "the fixed base of a snake")
    q = np.zeros(snake.dof) if q_nominal is None else real_array("q_nominal of a snake", q_nominal).copy()
    if q.shape != (snake.dof,) or not (np.abs(q) <= snake.q_max).all():
        most = np.degrees(snake.q_max)
        raise InputError(
            f"q_nominal is {snake.dof} angles within ± {most:g}°, two for each link, not {q_nominal!r:.80}"
        )
    nothing = np.zeros(snake.links + 1)
    return ShapeSolution(stands, q, nothing, nothing, np.abs(q) >= snake.q_max, False, 0.0, 0.0, curve)


def check_fixed(snake: SnakeModel, pathway: Pathway, settings: DriveSettings, tip_s: float) -> None:
    """Check that a robot can be driven on a fixed base.

    Raises:
        InputError: tissue that moves, links that are not bent, or a position along the path.
    """
    if pathway.motion is not None:
        raise InputError("a fixed base stands in tissue that is still: leave the tissue's motion out")
    if settings.manipulated < snake.links:
        raise InputError(
            f"on a fixed base all {snake.links} links are bent, not the last {settings.manipulated}: "
            f"set manipulated to {snake.links} or more"
        )
    if tip_s != 0.0:
        raise InputError(f"a robot on a fixed base is not inserted: leave tip_s at 0, not {tip_s:g} mm")


def whole_windows(segments: int, links: int) -> IntArray:
    """(L, 2): each link is measured against all of a pathway's segments between its first contour and its last.

    The straight ones before and behind them are for a robot that is inserted there; a cavity is closed at both.
    """
    return np.tile(np.array([1, segments - 1], dtype=np.int64), (links, 1))
