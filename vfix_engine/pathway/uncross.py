"""Reduction of a fit's contours that cross a neighbour, as little and as locally as possible."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import PathwayError
from ..geometry.transport import transported
from .checks import rim_points
from .interpolation import Interpolation
from .pathway import Pathway

_SHARE = 0.95  # of the distance to the line in which two contours' planes intersect
_ROUNDS = 200


def uncrossed(between: Interpolation, centre: Array, radius: Array, first: Array, least_mm: float) -> Pathway:
    """Return the pathway through control contours, with radii (K, A) reduced where interpolated contours cross.

    Raises:
        PathwayError: contours cross even with radii of ``least_mm``.
    """
    places, tangent = between.value @ centre, between.rate @ centre
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frames = transported(places, tangent, first)
    most = _most(places, tangent, frames, radius.shape[1])
    share = (between.places - between.knots[between.piece]) / np.diff(between.knots)[between.piece]
    for _ in range(_ROUNDS):
        rim = rim_points(between.monotone(radius))[0] if radius.shape[1] > 1 else between.monotone(radius)
        over = np.minimum(most / rim, 1.0)  # (C, K) remaining fraction of each rim point's radius
        if (over >= 1.0 - 1e-9).all():
            return Pathway(centre, radius, len(places), first=first, knots=between.knots)
        left = _per_angle(over, radius.shape[1])
        factor = np.ones_like(radius)
        # The nearer control contour is reduced more; repeated rounds reach the required total.
        np.minimum.at(factor, between.piece, left ** (1.0 - share)[:, None])
        np.minimum.at(factor, between.piece + 1, left ** share[:, None])
        smaller = np.maximum(radius * factor, least_mm)
        if np.array_equal(smaller, radius):
            break
        radius = smaller
    worst = np.unravel_index(int(over.argmin()), over.shape)[0]
    raise PathwayError(
        f"the curve bends so tightly at {between.places[worst]:.1f} mm that contours of {least_mm:g} mm cross; make it "
        "smoother or take fewer contours"
    )


def _most(centre: Array, tangent: Array, first: Array, angles: int) -> Array:
    """Radii (C, K) up to which no rim point comes near a neighbour's plane; (C, 1) for circles."""
    most = np.full((len(centre), 1 if angles == 1 else len(rim_points(np.ones((1, angles)))[1])), np.inf)
    second = np.cross(tangent, first)
    along = np.diff(centre, axis=0)
    for here, there, sign in ((slice(1, None), slice(None, -1), 1.0), (slice(None, -1), slice(1, None), -1.0)):
        ahead = np.einsum("ij,ij->i", tangent[there], along)[:, None]
        if angles == 1:
            towards = np.linalg.norm(np.cross(tangent[:-1], tangent[1:]), axis=1)[:, None]
        else:
            _, cosine, sine = rim_points(np.ones((1, angles)))
            x = np.einsum("ij,ij->i", tangent[there], first[here])[:, None]
            y = np.einsum("ij,ij->i", tangent[there], second[here])[:, None]
            towards = -sign * (x * cosine + y * sine)
        limit = np.divide(_SHARE * ahead, towards, out=np.full(towards.shape, np.inf), where=towards > 1e-12)
        most[here] = np.minimum(most[here], limit)
    return np.asarray(np.maximum(most, 0.0))


def _per_angle(rim: Array, angles: int) -> Array:
    """Minimum over the rim points (C, K) that each of the angles affects: (C, angles)."""
    parts = rim.shape[1] // angles
    within = rim.reshape(len(rim), angles, parts)
    before = np.roll(within[:, :, 1:].min(axis=2, initial=1.0), 1, axis=1)
    return np.asarray(np.minimum(within.min(axis=2), before))
