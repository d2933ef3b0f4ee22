"""Frames, transforms and units: what they mean everywhere in vfix, and the one place that composes image and base.

Units
    mm, rad, s, N. A file in metres or in RAS is converted where it is read, nowhere else.

Frames
    image    of the CT or surface, LPS: +x to the patient's left, +y posterior, +z superior. What is drawn, planned and
             measured is in it: points of a plan, structures, zones, clearances.
    patient  where the patient lies while the robot works: the frame of a tracker or of the room. Without a registration
             it is the image's frame, which is what a simulation drives in and what ``transform_base_to_patient`` of a
             simulated robot is.
    base     of the robot. Its joints, and a master that is aligned with it, are in this frame.

    RAS has x and y reversed: ``RAS_TO_LPS`` is its own inverse.

Transforms
    Right-handed, rigid, active: ``transform_a_to_b`` (4, 4) takes a point given in a to the same point given in b, as
    ``p_b = transform_a_to_b @ (x, y, z, 1)``. So ``transform_b_to_c @ transform_a_to_b`` is ``transform_a_to_c``, read
    from the right. A direction takes the rotation alone. Vectors are columns; a file stores a transform row by row.
    Quaternions, where a library asks for them, are (w, x, y, z); Pinocchio's and scipy's own are (x, y, z, w).

Image and base
    Two transforms lie between them, and each has one owner:

    placement     ``transform_base_to_patient``: where the robot stands. A plan may hold it.
    registration  ``transform_image_to_patient``, or directly ``transform_image_to_base``: how the image lies on the
                  patient. A document of its own; see ``Registration``.

    Nothing else composes them: ``transform_image_to_base`` and ``transform_base_to_image`` here do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
RegisteredTo = Literal["patient", "base"]

RAS_TO_LPS: Array = np.array([-1.0, -1.0, 1.0])
RAS_TO_LPS.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Registration:
    """How the image lies on the patient.

    transform: ``transform_image_to_patient`` (4, 4), rigid, mm; or ``transform_image_to_base`` where ``to`` is 'base',
        as a hand-eye calibration gives it.
    """

    transform: Array
    to: RegisteredTo = "patient"


def inverse(transform: ArrayLike) -> Array:
    """The inverse (4, 4) of a rigid transform; its rotation is the transpose, to the last bit."""
    given = np.asarray(transform, dtype=np.float64)
    turned = given[:3, :3].T
    result = np.eye(4)
    result[:3, :3] = turned
    result[:3, 3] = -(turned @ given[:3, 3])
    return result


def transform_base_to_image(transform_base_to_patient: ArrayLike, registration: Registration | None = None) -> Array:
    """Where the base stands in the image (4, 4), mm: what a robot is drawn, placed and driven with.

    registration: None where image and patient are one frame, as in a simulation; then the placement itself, unchanged.
        One to the base does not need the placement.
    """
    placement = np.array(transform_base_to_patient, dtype=np.float64)
    if registration is None:
        return placement
    back = inverse(registration.transform)
    return back if registration.to == "base" else back @ placement


def transform_image_to_base(transform_base_to_patient: ArrayLike, registration: Registration | None = None) -> Array:
    """From the image to the robot's base (4, 4), mm: placement⁻¹ ∘ registration."""
    if registration is None:
        return inverse(transform_base_to_patient)
    if registration.to == "base":
        return np.array(registration.transform, dtype=np.float64)
    return inverse(transform_base_to_patient) @ np.asarray(registration.transform, dtype=np.float64)


def direction_in_base(direction_in_patient: ArrayLike, transform_base_to_patient: ArrayLike) -> Array:
    """A direction, force or velocity (3,) of the patient's frame in the base's."""
    rotation = np.asarray(transform_base_to_patient, dtype=np.float64)[:3, :3]
    turned: Array = rotation.T @ np.asarray(direction_in_patient, dtype=np.float64)
    return turned
