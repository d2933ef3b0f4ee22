"""Frames, transforms and units of vfix, and the only functions that compose image and base.

Units
    mm, rad, s, N. Files in metres or in RAS are converted by their readers.

Frames
    image    of the CT or surface, LPS: +x to the patient's left, +y posterior, +z superior. Points of a plan,
             structures, zones and clearances are in it.
    patient  of the patient during the procedure, such as a tracker's. Without a registration, as in a simulation, it is
             the image's frame.
    base     of the robot. Its joints, and a master that is aligned with it, are in this frame.

    RAS has x and y reversed: ``RAS_TO_LPS`` is its own inverse.

Transforms
    Right-handed, rigid, active: ``transform_a_to_b`` (4, 4) takes a point given in a to the same point given in b, as
    ``p_b = transform_a_to_b @ (x, y, z, 1)``. So ``transform_b_to_c @ transform_a_to_b`` is ``transform_a_to_c``, read
    from the right. A direction takes the rotation alone. Vectors are columns; a file stores a transform row by row.
    Quaternions, where a library asks for them, are (w, x, y, z); Pinocchio's and scipy's own are (x, y, z, w).

Image and base
    Two transforms lie between them, and each has one owner:

    placement     ``transform_base_to_patient``: the robot's base placement. A plan may contain it.
    registration  ``transform_image_to_patient``, or directly ``transform_image_to_base``: how the image lies on the
                  patient. A document of its own; see ``ImageRegistration``.

    Nothing else composes them: ``transform_image_to_base``, ``transform_base_to_image`` and ``placement_of`` here do.
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
    """How the image lies on the patient.

    transform: ``transform_image_to_patient`` (4, 4), rigid, mm; or ``transform_image_to_base`` where ``to`` is 'base',
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
    """The inverse (4, 4) of a rigid transform; its rotation is exactly the transpose.

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
    """From the robot's base to the image (4, 4), mm: the transform with which a robot is drawn, placed and driven.

    registration: None where image and patient are one frame, as in a simulation; the result is then the placement.
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
    """From the image to the robot's base (4, 4), mm: placement⁻¹ ∘ registration."""
    if registration is None:
        return inverse(transform_base_to_patient)
    if registration.to == "base":
        return np.array(registration.transform, dtype=np.float64)
    return inverse(transform_base_to_patient) @ np.asarray(registration.transform, dtype=np.float64)


def placement_of(transform_base_to_image: ArrayLike, registration: ImageRegistration | None = None) -> Array:
    """The placement (4, 4), mm, of a robot whose base lies like this in the image: undoes `transform_base_to_image`.

    registration: None where image and patient are one frame.

    Raises:
        InputError: the transform is not rigid, or the image is registered to the base, which leaves the patient open.
    """
    base = rigid_transform(transform_base_to_image, "the robot's base")
    if registration is None:
        return base
    if registration.to == "base":
        raise InputError("a registration to the robot's base does not say where the patient's frame is.")
    return np.asarray(registration.transform @ base, dtype=np.float64)


def direction_in_base(direction_in_patient: ArrayLike, transform_base_to_patient: ArrayLike) -> Array:
    """A direction, force or velocity (3,) of the patient's frame in the base's."""
    rotation = np.asarray(transform_base_to_patient, dtype=np.float64)[:3, :3]
    turned: Array = rotation.T @ np.asarray(direction_in_patient, dtype=np.float64)
    return turned
