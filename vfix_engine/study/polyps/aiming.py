"""How a camera sees a target: distance, angle, the aiming frame and the marker's colour (Kwok 2013, fig. 9e)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array, BoolArray
from ...worlds.snake.viewing import ViewLimits

LIMITS = ViewLimits()  # the paper's, and the size of the frame
REFERENCE_MM, WITHIN_MM, WITHIN_DEG = LIMITS.distance_mm, LIMITS.distance_tolerance_mm, LIMITS.angle_deg
_ROUNDED_MM = 1e-6  # more than a distance is rounded by
_CONE = math.tan(math.radians(WITHIN_DEG))
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


def may_be_within(cameras: Array, targets: Array) -> BoolArray:
    """Whether ``aim_at(...).within`` is possible, (n, p): it is never where this is False, but for rounding it is else.

    Args:
        cameras: (n, 4, 4), as of ``aim_at``; targets: (n, p, 3) LPS mm, or (1, p, 3) where they do not move.
    """
    local = np.einsum("npi,nij->npj", targets - cameras[:, None, :3, 3], cameras[:, :3, :3])
    aside, ahead = np.abs(local[..., :2]).max(axis=-1), local[..., 2]
    square = np.einsum("npi,npi->np", local, local)
    near, far = REFERENCE_MM - WITHIN_MM - _ROUNDED_MM, REFERENCE_MM + WITHIN_MM + _ROUNDED_MM
    may: BoolArray = (square >= near * near) & (square <= far * far)
    may &= aside <= _FRAME * ahead + _ROUNDED_MM
    may &= np.hypot(local[..., 0], local[..., 1]) <= _CONE * ahead + _ROUNDED_MM
    return may
