"""A smooth curve through a lumen that a snake can follow, or nearly.

Joints of ± 45° behind links of 28 mm follow a bend of 36 mm radius and none that is sharper, and the folds of a colon
are sharper. The centreline wiggles from fold to fold on top of that. So a curve is looked for that stays in the slack
which the robot has about the centreline and turns little from chord to chord, at every phase of the chain; both are
soft, since no curve inside a colon keeps the turns; ``nearness`` says how much the slack counts. Gauss-Newton on a
banded normal matrix, damped.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ...anatomy.lumen.centreline import Centreline, smoothed_between_ends
from ...arrays import Array, IntArray
from ...errors import PathwayError
from ...geometry.curve import Curve
from ...robots.snake import SnakeModel
from .follow_kernel import BAND, BEND, CURVE, SPACE, TETHER, TURN, banded_step, followable_squares

_LINKS = 7  # points to a link
_SAMPLE = 1.0  # [mm] between the samples of the centreline
_SMOOTH = 10.0  # [mm] standard deviation of the smoothing that the search begins with
_LEAST_SLACK = 0.5  # [mm] that a point is always allowed
_SHARPEST = 0.93  # of a link's length: the smallest radius of a bend
_TURN_SHARE = 0.7  # of a link's length: what a radian beyond the limit costs, against a mm beyond the slack
_MOST = 3.0  # [mm] that a point moves in a turn
_TURNS = 200
_GAIN = 1e-6  # share of the cost below which a turn is the last


def followable(
    centreline: Centreline | tuple[Curve, ArrayLike],
    snake: SnakeModel,
    turn: float = math.radians(52.0),
    nearness: float = 1.0,
) -> Curve:
    """A curve near the centreline, from its start to its end, that the snake's joints can follow as far as one exists.

    Where the centreline turns by less than ``turn`` over a link, in the slack that the snake has, it is kept but for
    its fastest wiggles; its two ends stay where they are.

    Args:
        centreline: the lumen's, or a curve with its radii (N,) in mm.
        snake: its length and radius of a link count.
        turn: rad between two chords of a link's length above which a turn is to be made less.
        nearness: weight of a mm beyond the slack; with more than 1 the curve leaves the middle less and turns more, and
            the search begins nearer to the centreline.

    Raises:
        PathwayError: radii that do not belong to the curve or are not finite, a turn or a nearness that is not
            positive, or a curve shorter than three links.
    """
    line, radius = _checked(centreline)
    if not (math.isfinite(turn) and turn > 0.0):
        raise PathwayError(f"a turn of {turn} rad: give a finite, positive angle")
    if not (math.isfinite(nearness) and nearness > 0.0):
        raise PathwayError(f"a nearness of {nearness}: give a finite, positive weight")
    chord = snake.length_mm
    if line.length < 3.0 * chord:
        raise PathwayError(
            f"a path of {line.length:.0f} mm is too short for three links of {chord:g} mm: "
            "set start and end farther apart, or take shorter links"
        )
    count = max(math.ceil(line.length / _SAMPLE), 2)
    at = np.linspace(0.0, line.length, count + 1)
    centre = line.position(at)
    slack = np.interp(at, np.arange(len(radius)) * line.step_mm, radius) - snake.radius_mm
    slack = np.maximum(_smoothed(slack[:, None], 2.0)[:, 0], _LEAST_SLACK)
    begin = smoothed_between_ends(centre, _SMOOTH / _SAMPLE / nearness)
    points = Curve.through(begin, chord / _LINKS).points.copy()
    return Curve.through(_settled(points, centre, slack, chord, turn, nearness))


def _settled(points: Array, centre: Array, slack: Array, chord: float, turn: float, nearness: float) -> Array:
    """The points (n, 3) moved until the squares are least."""
    weights = np.empty(5)
    weights[TURN], weights[BEND], weights[CURVE], weights[SPACE] = _TURN_SHARE * chord, 10.0, 0.5, 1.0
    weights[TETHER] = 0.1
    weights /= nearness  # of the slack, whose own weight is 1
    places = np.round(np.linspace(0, len(centre) - 1, len(points))).astype(np.int64)
    band, gradient = np.empty((BAND, points.size)), np.empty(points.size)
    columns, values = np.empty(15, np.int64), np.empty(15)
    factor, flat = np.empty((points.size, BAND)), np.empty(points.size)

    def squares(points: Array, places: IntArray) -> float:
        step = float(np.linalg.norm(np.diff(points, axis=0), axis=1).mean())
        return followable_squares(
            points, centre, slack, places, chord, turn, step, _SHARPEST * chord, weights, band, gradient, columns,
            values,
        )  # fmt: skip

    damping, cost = 1.0, squares(points, places)
    for _ in range(_TURNS):
        # Not LAPACK's: its threads take longer to meet than a band this narrow takes to solve.
        banded_step(band, gradient, damping, factor, flat)
        move = flat.reshape(-1, 3)
        size = np.linalg.norm(move, axis=1, keepdims=True)
        trial, found = points + move * np.minimum(1.0, _MOST / np.maximum(size, 1e-12)), places.copy()
        lowered = squares(trial, found)
        if lowered < cost:
            gain, cost, points, places = cost - lowered, lowered, trial, found
            damping = max(0.5 * damping, 1e-2)
            if gain < _GAIN * cost:
                break
        else:
            damping *= 4.0
            if damping > 1e4:
                break
            squares(points, places)
    return points


def _checked(centreline: Centreline | tuple[Curve, ArrayLike]) -> tuple[Curve, Array]:
    line, given = centreline if isinstance(centreline, tuple) else (centreline.curve, centreline.radius)
    radius = np.array(given, dtype=np.float64)
    if radius.shape != (len(line.points),) or not np.isfinite(radius).all():
        raise PathwayError(f"a curve of {len(line.points)} points has as many finite radii, not {radius.shape}")
    return line, radius


def _smoothed(rows: Array, deviation: float) -> Array:
    from scipy.ndimage import gaussian_filter1d  # imported here: slow to load

    smooth: Array = gaussian_filter1d(rows, deviation, axis=0, mode="nearest")
    return smooth
