"""The placing of a plan's robot in the image, as a scene takes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vfix_engine.frames import ImageRegistration, transform_base_to_image

Array = NDArray[np.float64]


class StoredPlacing(NamedTuple):
    """base (4, 4): transform_base_to_image, mm; q_start (n,): joints at the entry, mm and rad."""

    base: Array
    q_start: Array


def stored_placing(robot: Mapping[str, Any], registration: ImageRegistration | None = None) -> StoredPlacing | None:
    """The placing that a plan holds for its robot; None where it holds none and the robot is to be placed.

    registration: of the image to the patient beside the robot; None in a simulation, where they are one.
    """
    if robot.get("base") is None:
        return None
    base = transform_base_to_image(np.array(robot["base"], dtype=np.float64).reshape(4, 4), registration)
    return StoredPlacing(base, np.array(robot["q_start"], dtype=np.float64))
