"""A task of study I with polyps that somebody placed on the wall, instead of those that are drawn by a seed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from .aiming import LIMITS
from .placing import WallPlaces
from .task import PolypTask, checked_place, surface_hash
from .world import way_of


def polyps_at(
    at: Array, mesh: TriangleMesh, curve: Curve, landmarks: Mapping[str, ArrayLike], depth_mm: float
) -> PolypTask:
    """The task of polyps at given places of the wall; whether the robot can view them is not asked.

    It ends at the landmark 'ascending', or else at the depth that the robot reaches.

    Args:
        at: (n, 3) LPS mm, on the wall. curve: that the robot follows, at rest. landmarks: places (3,) by name.
        depth_mm: that the tip reaches.

    Raises:
        InputError: no polyps, or one that no camera views from before the end of the task.
        PathwayError: as ``WallPlaces.of``.
    """
    if not len(at):
        raise InputError("there are no polyps: put some on the wall first")
    _, end_mm, end_name = way_of(landmarks, curve, min(curve.length, depth_mm), 0.0)
    places = WallPlaces.of(mesh, curve)
    nearest = np.linalg.norm(places.wall.centre[None] - at[:, None], axis=2).argmin(axis=1)
    s = np.maximum(places.s[nearest], 0.0)
    found = [
        replace(places.polyp(int(one)), s_mm=float(along), axis=checked_place(axis), wall=checked_place(place))
        for one, along, axis, place in zip(nearest, s, curve.position(s), at, strict=True)
    ]
    polyps = tuple(sorted(found, key=lambda polyp: polyp.s_mm))
    if polyps[-1].s_mm > end_mm + LIMITS.farthest_mm:
        raise InputError(
            f"a polyp is {polyps[-1].s_mm:.0f} mm along the lumen, and the task ends at {end_mm:.0f} mm: remove it"
        )
    return PolypTask(polyps, 0.0, end_mm, end_name, surface=surface_hash(mesh))
