"""How a camera sees a target: distance, angle, the aiming frame and the marker's colour (Kwok 2013, fig. 9e)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array, IntArray
from ...worlds.snake.viewing import ViewLimits

LIMITS = ViewLimits()  # the paper's, and the size of the frame
REFERENCE_MM, WITHIN_MM, WITHIN_DEG = LIMITS.distance_mm, LIMITS.distance_tolerance_mm, LIMITS.angle_deg
_FRAME = math.tan(math.radians(LIMITS.frame_deg)) * (1.0 + 1e-9)  # half the frame at unit distance ahead


class Aim(NamedTuple):
    """A target in a camera's view.

    local: (3,) mm in the camera's frame, x to the right and y down in the picture, z ahead.
    distance_mm, angle_deg: from the lens, and off the optical axis. framed: within the square frame about the
    picture's centre, which touches the circle of 20° (``ViewLimits``). Whether the line of sight is free is not known
    here.
    """

    local: tuple[float, float, float]
    distance_mm: float
    angle_deg: float
    framed: bool

    @property
    def within(self) -> bool:
        """Framed, at 15 ± 7 mm and within 20° of the optical axis."""
        return self.framed and abs(self.distance_mm - REFERENCE_MM) <= WITHIN_MM and self.angle_deg <= WITHIN_DEG

    @property
    def distance_error_mm(self) -> float:
        """Off the reference distance."""
        return abs(self.distance_mm - REFERENCE_MM)

    @property
    def accuracy(self) -> float:
        """1 at the reference distance and angle, 0 at the end of either tolerance and beyond it.

        Linear between, by the worse of the two; the paper says that the colour "is changed gradually".
        """
        if not self.within:
            return 0.0
        return 1.0 - max(self.distance_error_mm / WITHIN_MM, self.angle_deg / WITHIN_DEG)


def aim_at(camera: Array, target: Array) -> Aim:
    """How a camera sees a target.

    Args:
        camera: (4, 4) transform_camera_to_patient, its y axis down in the picture and z the optical axis, mm.
        target: (3,) LPS mm.
    """
    x, y, z = (float(v) for v in (target - camera[:3, 3]) @ camera[:3, :3])
    aside = math.hypot(x, y)
    framed = z > 0.0 and max(abs(x), abs(y)) <= _FRAME * z
    return Aim((x, y, z), math.hypot(aside, z), math.degrees(math.atan2(aside, z)), framed)


def near_enough(camera: Array, targets: Array) -> IntArray:
    """Indices of the targets (n, 3) that are neither too far nor behind the camera: the others are not within."""
    local = (targets - camera[:3, 3]) @ camera[:3, :3]
    far = REFERENCE_MM + WITHIN_MM
    found: IntArray = np.flatnonzero((local[:, 2] > 0.0) & (np.einsum("ij,ij->i", local, local) <= far * far))
    return found
