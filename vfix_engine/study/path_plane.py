"""The plane that lies best along a path, and where a tip was in it and across the path (Li 2007, figures 7, 12, 16)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..geometry.path import SplinePath
from ..geometry.transport import across, transported

STEP_MM = 0.5  # between the places of the curve
_STRAIGHT = 1e-3  # of its length: a path that bends less has no plane of its own
_UP = np.array([0.0, 0.0, 1.0])  # LPS


@dataclass(frozen=True, eq=False)
class PathPlane:
    """The plane of a path, by least squares through places ``STEP_MM`` apart; of a straight path an upright one.

    origin: (3,) its mean place, LPS mm. along, aside: (3,) unit axes in the plane, from the entry to the end and,
        perpendicular to it, as far up as the plane allows; normal: (3,) along × aside.
    s: (m,) arc lengths in mm of the places of the curve; curve: (m, 2) the path in the plane, mm.
    normals: (m, 3) unit vectors across the path: the normal, parallel transported, which on a flat path it stays.
    """

    origin: Array
    along: Array
    aside: Array
    normal: Array
    s: Array
    curve: Array
    normals: Array

    @classmethod
    def of(cls, path: SplinePath) -> PathPlane:
        """The plane of a path."""
        s = np.linspace(0.0, path.length, max(int(np.ceil(path.length / STEP_MM)), 1) + 1)
        places, tangents = path.position(s), path.tangent(s)
        origin = places.mean(axis=0)
        _, sizes, axes = np.linalg.svd(places - origin, full_matrices=False)
        along = axes[0] if axes[0] @ (places[-1] - places[0]) >= 0.0 else -axes[0]
        flat = len(sizes) > 1 and sizes[1] > _STRAIGHT * sizes[0]
        aside = axes[1] if flat else across(along, _UP)
        if aside @ _UP < 0.0:
            aside = -aside
        normal = np.cross(along, aside)
        curve = np.column_stack([(places - origin) @ along, (places - origin) @ aside])
        return cls(origin, along, aside, normal, s, curve, transported(places, tangents, normal))

    def flat(self, places: Array) -> Array:
        """(n, 2) mm, places (n, 3) seen along the normal: along and aside."""
        return np.column_stack([(places - self.origin) @ self.along, (places - self.origin) @ self.aside])

    def across(self, path: SplinePath, s: Array, tips: Array) -> Array:
        """(n, 2) mm, where tips (n, 3) are across the path at arc lengths s (n,): within the plane, and off it.

        Within is positive to the side of ``aside`` where the path runs along ``along``; off along the normal. What is
        along the path, as before its entry, is in neither.

        Raises:
            InputError: an arc length is not on the path.
        """
        if len(s) and not (s.min() >= -1e-6 and s.max() <= path.length + 1e-6):
            raise InputError("an arc length is not on the path")
        number = np.clip(np.searchsorted(self.s, s), 1, len(self.s) - 1)
        number -= (s - self.s[number - 1]) < (self.s[number] - s)
        tangent, offset = path.tangent(s).reshape(-1, 3), tips - path.position(s).reshape(-1, 3)
        off = self.normals[number]
        off = off - np.einsum("ij,ij->i", off, tangent)[:, None] * tangent
        off /= np.linalg.norm(off, axis=1)[:, None]
        within = np.cross(off, tangent)
        return np.column_stack([np.einsum("ij,ij->i", offset, within), np.einsum("ij,ij->i", offset, off)])
