"""Consistent start values of a drive: robot, position, slack about its curve, and its control."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ....arrays import Array
from ....errors import InputError
from ....geometry.curve import Curve
from ....pathway.limits.limits import beyond_text
from ....robots.snake import SnakeModel
from ....snake.control.parameterised import ParameterisedControl
from ....snake.control.qp_drive import QpControl
from ....snake.control.tip_control import TipControl
from ....snake.control.view_drive import ViewControl
from ....validate import real_array, within
from ..settings import DriveSettings


def checked_tip(snake: SnakeModel, length: float, tip_s: float, longer_allowed: bool) -> float:
    """Arc length in mm at which the tip starts on a path of ``length`` mm; at most the robot's own length before the
    path.

    Raises:
        InputError: a robot with more links than the path needs, unless that is allowed; a position before
            the robot, or a value that is not a number. A position beyond the path's end is refused by the conformance.
    """
    fits = math.ceil(length / snake.length_mm)
    if snake.links > fits and not longer_allowed:
        raise InputError(
            f"{snake.links:,} links of {snake.length_mm:g} mm are {snake.reach_mm():,.0f} mm long, the path has "
            f"{length:,.0f} mm: {fits} links reach its end, more never come in"
        )
    return within("how far in the tip starts, in mm,", tip_s, -snake.reach_mm())


def checked_slack(slack: ArrayLike | None, curve: Curve | None) -> Array | None:
    """How far the robot may leave an explicit curve, (N,) mm at its points.

    Raises:
        InputError: another shape, numbers that are not finite, or no explicit curve.
    """
    if slack is None:
        return None
    if curve is None:
        raise InputError("slack is given at the points of a curve: give the curve too")
    found, points = real_array("the slack about a curve", slack), len(curve.points)
    if found.shape != (points,) or not np.isfinite(found).all():
        raise InputError(f"the slack about a curve of {points} points is ({points},) finite mm, not {found.shape}")
    return found


def refuse_beyond(depth: Array, bound: Array) -> None:
    """Check that all links are within their bounds, (L,) mm: the limits would permit a link beyond its bound to stay
    there.

    Raises:
        InputError: a link is not.
    """
    link = int((depth - bound).argmax())
    if not depth[link] <= bound[link]:
        start = f"link {link + 1} would start {beyond_text(depth[link], bound[link])} mm outside of the pathway"
        raise InputError(f"{start}; its bound is {bound[link]:g} mm: start less deep, or allow it")


def make_control(settings: DriveSettings) -> TipControl:
    """The control of the distal links that the settings name."""
    if settings.control == "qp":
        return QpControl()
    if settings.control == "view":
        return ViewControl()
    return ParameterisedControl(settings.bends, settings.r_max)
