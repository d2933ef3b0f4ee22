"""A straight line below the wall of every section of a segment: a cheap bound that is tested before the section itself.

In the plane of the axis and a point (``section.py``) the wall is the line v2 v3, with v2 = R (−sin α, cos α): the
contour is inclined by α, |α| ≤ β, cos β = M·e, as the plane rotates about the axis. The line
ℓ(t) = height + slope · t lies below v2 and v3, and so below the wall, of every such plane if

    height ≤ R_j (cos β_j − |slope| sin β_j),   height ≤ R_{j+1} (cos β_{j+1} − |slope| sin β_{j+1}) − slope · length

with the smallest radii. A point between the contours' planes at (t, h) therefore has δ_j ≤ factor · max(0, h − ℓ(t)):
over the wall's own interval of t it is at most the distance straight down to ℓ; beside it, over a contour that is
inclined outwards, the distance to v2 is at most (h − v2) / cos β, and h − v2 ≤ h − ℓ(t) + |slope| (h − v2) tan β.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array

_SHARE = 0.25  # upper bound of |slope| tan β


def inner_lines(smallest: Array, length: Array, facing: tuple[Array, Array]) -> Array:
    """Height [mm], slope, factor and √(1 + slope²) of the line of every segment, (S, 4).

    Args:
        smallest: (S + 1,) mm, the contours' smallest radii.
        length: (S,) mm, of the segments' axes.
        facing: M_j·e and M_{j+1}·e, (S,) each, positive.
    """
    cosine = np.minimum(facing[0], 1.0), np.minimum(facing[1], 1.0)
    sine = np.sqrt(1.0 - cosine[0] ** 2), np.sqrt(1.0 - cosine[1] ** 2)
    tangent = np.maximum(sine[0] / cosine[0], sine[1] / cosine[1])
    wanted = (smallest[1:] * cosine[1] - smallest[:-1] * cosine[0]) / length
    most = _SHARE / np.maximum(tangent, 1e-3)
    slope = np.clip(wanted, -most, most)
    height = np.minimum(
        smallest[:-1] * (cosine[0] - np.abs(slope) * sine[0]),
        smallest[1:] * (cosine[1] - np.abs(slope) * sine[1]) - slope * length,
    )
    factor = 1.0 / (np.minimum(*cosine) * (1.0 - np.abs(slope) * tangent))
    return np.stack([height, slope, factor, np.sqrt(1.0 + slope**2)], axis=1)
