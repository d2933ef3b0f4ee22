"""Labels in a cavity, each with an arrow, and where the picture's centre ray meets them (Kwok 2013, fig. 10b)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from ...arrays import Array

DIAMETER_MM, LINE_MM = 33.0, 20.0  # Kwok 2013, section IV.C.2: of a label, and of its arrow and the object on it
HALF_MM = 0.5 * LINE_MM
_GRAZING = 0.05  # cosine: a ray that is nearer to the label's plane meets it nowhere in particular
_BEHIND_LENS_MM = 1.0


class Label(NamedTuple):
    """A flat circular label with an arrow through its centre; LPS mm.

    centre: (3,). normal: (3,) unit, towards the cavity. along: (3,) unit, of the arrow, towards its tip.
    place: of the label in words, such as an organ.
    """

    centre: Array
    normal: Array
    along: Array
    place: str = ""

    @property
    def across(self) -> Array:
        """(3,) unit, in the label's plane, perpendicular to the arrow."""
        side: Array = np.cross(self.normal, self.along)
        return side

    def at(self, along_mm: float, across_mm: float = 0.0) -> Array:
        """(3,) a point of the label's plane; the arrow goes from −10 to +10 mm."""
        point: Array = self.centre + along_mm * self.along + across_mm * self.across
        return point

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        vectors = {name: [float(x) for x in getattr(self, name)] for name in ("centre", "normal", "along")}
        return vectors | {"place": self.place}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse. Raises KeyError, TypeError or ValueError for other values."""
        centre, normal, along = (
            np.array(values[name], dtype=np.float64).reshape(3) for name in ("centre", "normal", "along")
        )
        return cls(centre, normal, along, str(values["place"]))


class Marker(NamedTuple):
    """The aiming marker on a label: where the optical axis meets it, in mm along and across its arrow.

    distance: from the camera, mm.
    """

    along: float
    across: float
    distance: float

    @property
    def off_arrow_mm(self) -> float:
        """Distance to the arrow, which is 20 mm long."""
        return math.hypot(self.across, max(abs(self.along) - HALF_MM, 0.0))


def marker_on(label: Label, camera: Array) -> Marker | None:
    """The marker of a camera (4, 4), transform_camera_to_patient, on a label; None where the axis meets none of it.

    A label has one face: from behind it has no marker.
    """
    found = axis_on_plane(label, camera)
    return found if found is not None and math.hypot(found.along, found.across) <= 0.5 * DIAMETER_MM else None


def axis_on_plane(label: Label, camera: Array) -> Marker | None:
    """The same on the label's whole plane, seen from its front."""
    eye, ahead = camera[:3, 3], camera[:3, 2]
    facing = float(label.normal @ ahead)
    if facing > -_GRAZING:
        return None
    distance = float(label.normal @ (label.centre - eye)) / facing
    if distance < _BEHIND_LENS_MM:
        return None
    met = eye + distance * ahead - label.centre
    return Marker(float(met @ label.along), float(met @ label.across), distance)
