"""A simulated optical tracker: poses of a pointer and of a marker on the robot with noise, without hardware."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..validate import point, real_array, rigid_transform, whole, within
from .points import checked_points, register_points

# Four points of a rigid body in its frame, mm, with distinct distances, so that a tracker can identify them.
BODY_MM: Array = np.array([(0.0, 0.0, 0.0), (0.0, 50.0, 0.0), (-30.0, 82.0, 0.0), (45.0, 95.0, 0.0)])
BODY_MM.setflags(write=False)
TIP_MM: Array = np.array([18.0, -120.0, 0.0])  # of the pointer, in the frame of its body
TIP_MM.setflags(write=False)
SIGMA_MM = (0.1, 0.1, 0.15)  # per axis of the tracker, z along its view; typical of an optical tracker


class SimulatedTracker:
    """Measures rigid bodies by their points, each with normal noise in the tracker's frame, and fits their poses.

    A pose has the errors of such a fit: small at the middle of the body, large at a distant tip. Values are drawn in
    the order of the calls, so the same seed and calls give the same poses.

    Args:
        seed: of the noise and of the simulated hand that holds the pointer.
        sigma_mm: standard deviation of a point's error along x, y and z of the tracker; one number for all.
        body_mm: (n, 3) the body's points in its own frame, at least three and not collinear.
        tip_mm: (3,) the pointer's tip in the frame of its body.

    Raises:
        InputError: an argument is out of range.
    """

    def __init__(
        self,
        seed: int,
        *,
        sigma_mm: ArrayLike = SIGMA_MM,
        body_mm: ArrayLike = BODY_MM,
        tip_mm: ArrayLike = TIP_MM,
    ) -> None:
        sigma = np.broadcast_to(real_array("sigma_mm", sigma_mm), (3,)) if np.size(sigma_mm) in (1, 3) else np.empty(0)
        if sigma.shape != (3,) or not (np.isfinite(sigma).all() and (sigma >= 0.0).all()):
            raise InputError("sigma_mm is one number from 0 on, or one for each of x, y and z")
        self._random = np.random.default_rng(whole("the seed", seed, 0))
        self.sigma_mm: Array = sigma.copy()
        self.body_mm = checked_points("the body's points", body_mm, 3)
        register_points(self.body_mm, self.body_mm)  # raises for collinear points
        self.tip_mm = point("the pointer's tip", tip_mm)
        for array in (self.sigma_mm, self.body_mm, self.tip_mm):
            array.setflags(write=False)

    def measured(self, transform_body_to_tracker: ArrayLike) -> Array:
        """Return the measured pose (4, 4) of a body with the given true pose.

        Raises:
            InputError: the pose is not rigid.
        """
        true = rigid_transform(transform_body_to_tracker, "the body's pose")
        seen = self.body_mm @ true[:3, :3].T + true[:3, 3]
        seen = seen + self._random.normal(0.0, 1.0, seen.shape) * self.sigma_mm
        return np.array(register_points(seen, self.body_mm).transform)

    def touch(self, place: ArrayLike, *, tilt_deg: float = 40.0) -> Array:
        """Return the measured pose (4, 4) of a pointer whose tip touches a point (3,) of the tracker's frame.

        The hand holds it in a random direction, within ``tilt_deg`` of the body's own frame and with a random roll.

        Raises:
            InputError: the argument is not a point, or the tilt is not from 0 to 90 degrees.
        """
        return self.measured(self._held(point("the place", place), within("tilt_deg", tilt_deg, 0.0, 90.0)))

    def pivot(self, place: ArrayLike, count: int = 60, *, tilt_deg: float = 40.0) -> Array:
        """Return measured poses (count, 4, 4) of a pointer that is swung with its tip at a fixed point (3,).

        Raises:
            InputError: as ``touch``, or the count is not positive.
        """
        return np.array([self.touch(place, tilt_deg=tilt_deg) for _ in range(whole("the count", count, 1))])

    def _held(self, place: Array, tilt_deg: float) -> Array:
        """A true pose with the tip at a point: tilted about an axis across the pointer, then rotated about it."""
        axis = self.tip_mm / max(float(np.linalg.norm(self.tip_mm)), 1e-12)
        across = np.cross(axis, self._random.normal(size=3))
        across /= np.linalg.norm(across)
        # Uniform over the cap of directions.
        tilt = np.arccos(self._random.uniform(np.cos(np.radians(tilt_deg)), 1.0))
        pose = np.eye(4)
        pose[:3, :3] = _turn(across, tilt) @ _turn(axis, self._random.uniform(-0.5, 0.5))
        pose[:3, 3] = place - pose[:3, :3] @ self.tip_mm
        return pose


def _turn(axis: Array, angle: float) -> Array:
    """Rotation (3, 3) about a unit axis."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return rotation
