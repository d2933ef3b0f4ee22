"""Contact length and depth of a tool in a solid over a series of poses, from a distance field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from .distance_field import DistanceField

SAMPLE_MM = 0.5  # largest spacing of samples of the tool's axis


@dataclass(frozen=True, eq=False)
class ToolDepth:
    """A tool in a solid, for n poses; lengths in mm, positions in LPS.

    length (n,): length of the tool whose surface is in the solid. near_length (n,): the part of it near a given place.
    depth (n,): of the deepest point of the tool's surface below the solid's border; 0 without contact.
    place (n, 3), segment (n,): of the tool's axis at the deepest point, or at the one nearest to the solid.
    not_known (n,): length of the tool where the field is unknown.
    """

    length: Array
    near_length: Array
    depth: Array
    place: Array
    segment: NDArray[np.intp]
    not_known: Array


def tool_depth(
    field: DistanceField, start: Array, end: Array, radius: Array, near: ArrayLike, near_mm: float
) -> ToolDepth:
    """Compute the depth of a tool in the solid of a field.

    Args:
        start, end: (n, S, 3) axis segments of the tool in n poses; radius: (S,) of its capsules.
        near: (3,) place, and near_mm: the distance from it within which `near_length` counts.

    A point of the axis counts as in the solid if its distance is less than the radius in any direction: the ball of the
    tool around that point reaches into the solid. Where the tool enters the solid at a right angle, this begins up to a
    radius before its surface does, so each contact is overestimated by at most two radii, and never underestimated.
    Lengths are accurate to one sample of 0.5 mm at each border.
    """
    points, weight, segment = axis_samples(start, end)
    distance = field.at(points.reshape(-1, 3)).reshape(points.shape[:2])
    unknown = np.isnan(distance)
    depth = np.where(unknown, -np.inf, radius[segment] - distance)
    inside = depth > 0.0
    beside = np.linalg.norm(points - np.asarray(near, dtype=np.float64), axis=2) <= near_mm
    deepest = depth.argmax(axis=1)
    rows = np.arange(len(points))
    return ToolDepth(
        length=(weight * inside).sum(axis=1),
        near_length=(weight * (inside & beside)).sum(axis=1),
        depth=np.maximum(depth[rows, deepest], 0.0),
        place=points[rows, deepest],
        segment=segment[deepest],
        not_known=(weight * unknown).sum(axis=1),
    )


def axis_samples(start: Array, end: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """Sample the axes of n poses: points (n, m, 3), the length (m,) that each represents, and its segment (m,)."""
    points, weight, segment = [], [], []
    for index, length in enumerate(np.linalg.norm(end[0] - start[0], axis=1).tolist()):
        count = max(1, int(np.ceil(length / SAMPLE_MM)))
        share = (np.arange(count + 1) / count)[:, None]
        points.append(start[:, None, index] + share * (end[:, None, index] - start[:, None, index]))
        each = np.full(count + 1, length / count)
        each[[0, -1]] *= 0.5  # the end points, including the tip, represent half an interval
        weight.append(each)
        segment.append(np.full(count + 1, index, dtype=np.intp))
    return np.concatenate(points, axis=1), np.concatenate(weight), np.concatenate(segment)
