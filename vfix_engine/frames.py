"""Frames, transforms and units of vfix, and the only functions that compose image and base transforms.

Units
    mm, rad, s, N. Files in metres or in RAS are converted by their readers.

Frames
    image    frame of the CT or surface, LPS: +x to the patient's left, +y posterior, +z superior. Points of a plan,
             structures, zones and clearances are in it.
    patient  frame of the patient during the procedure, such as a tracker's. Without a registration, as in a simulation,
             it equals the image frame.
    base     frame of the robot. Its joints, and a master that is aligned with it, are in this frame.

    RAS has x and y reversed: ``RAS_TO_LPS`` is its own inverse.

Transforms
    Right-handed, rigid, active: ``transform_a_to_b`` (4, 4) maps the coordinates of a point in a to those in b,
    ``p_b = transform_a_to_b @ (x, y, z, 1)``. So ``transform_b_to_c @ transform_a_to_b`` is ``transform_a_to_c``, read
    from the right. A direction uses the rotation only. Vectors are columns; a file stores a transform row by row.
    Quaternions, where a library requires them, are (w, x, y, z); those of Pinocchio and scipy are (x, y, z, w).

Image and base
    Two transforms lie between them, and each has one owner:

    placement     ``transform_base_to_patient``: the robot's base placement. A plan may contain it.
    registration  ``transform_image_to_patient``, or directly ``transform_image_to_base``: the pose of the
                  image relative to the patient. A document of its own; see ``ImageRegistration``.

    Only ``transform_image_to_base``, ``transform_base_to_image`` and ``placement_of`` in this module compose them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array
from .errors import InputError
from .validate import rigid_transform

RegisteredTo = Literal["patient", "base"]

RAS_TO_LPS: Array = np.array([-1.0, -1.0, 1.0])
RAS_TO_LPS.setflags(write=False)


@dataclass(frozen=True, eq=False)
class ImageRegistration:
    """Pose of the image relative to the patient.

    transform: ``transform_image_to_patient`` (4, 4), rigid, mm; or ``transform_image_to_base`` if ``to`` is 'base',
        as a hand-eye calibration gives it.

    Raises:
        InputError: the transform is not rigid, or ``to`` is neither 'patient' nor 'base'.
    """

    transform: Array
    to: RegisteredTo = "patient"

    def __post_init__(self) -> None:
        if self.to not in ("patient", "base"):
            raise InputError(f"an image is registered to 'patient' or to 'base', not to {self.to!r:.40}")
        object.__setattr__(self, "transform", rigid_transform(self.transform, "the registration"))


def inverse(transform: ArrayLike) -> Array:
    """Return the inverse (4, 4) of a rigid transform; its rotation is exactly the transpose.

    Raises:
        InputError: the transform is not rigid.
    """
    given = rigid_transform(transform, "the transform")
    turned = given[:3, :3].T
    result = np.eye(4)
    result[:3, :3] = turned
    result[:3, 3] = -(turned @ given[:3, 3])
    return result


def transform_base_to_image(
    transform_base_to_patient: ArrayLike, registration: ImageRegistration | None = None
) -> Array:
    """Transform from the robot's base to the image (4, 4), mm, with which a robot is drawn, placed and driven.

    registration: None if image and patient frame are equal, as in a simulation; the result is then the placement.
        A registration to the base does not use the placement.

    Raises:
        InputError: the placement is not rigid.
    """
    placement = rigid_transform(transform_base_to_patient, "the robot's base")
    if registration is None:
        return placement
    back = inverse(registration.transform)
    return back if registration.to == "base" else back @ placement


def transform_image_to_base(
    transform_base_to_patient: ArrayLike, registration: ImageRegistration | None = None
) -> Array:
    """Transform from the image to the robot's base (4, 4), mm: placement⁻¹ ∘ registration."""
    if registration is None:
        return inverse(transform_base_to_patient)
    if registration.to == "base":
        return np.array(registration.transform, dtype=np.float64)
    return inverse(transform_base_to_patient) @ np.asarray(registration.transform, dtype=np.float64)


def placement_of(transform_base_to_image: ArrayLike, registration: ImageRegistration | None = None) -> Array:
    """Placement (4, 4), mm, of a robot from its base's pose in the image: the inverse of `transform_base_to_image`.

    registration: None if image and patient frame are equal.

    Raises:
        InputError: the transform is not rigid, or the image is registered to the base, so that the patient is unknown.
    """
    base = rigid_transform(transform_base_to_image, "the robot's base")
    if registration is None:
        return base
    if registration.to == "base":
        raise InputError("a registration to the robot's base does not say where the patient's frame is.")
    return np.asarray(registration.transform @ base, dtype=np.float64)


def direction_in_base(direction_in_patient: ArrayLike, transform_base_to_patient: ArrayLike) -> Array:
    """Convert a direction, force or velocity (3,) from the patient frame to the base frame."""
    rotation = np.asarray(transform_base_to_patient, dtype=np.float64)[:3, :3]
    turned: Array = rotation.T @ np.asarray(direction_in_patient, dtype=np.float64)
    return turned
