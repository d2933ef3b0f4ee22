"""The placement of a plan's robot in the image, as a scene takes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.errors import PlanError
from vfix_engine.frames import ImageRegistration, inverse, transform_base_to_image


class StoredPlacement(NamedTuple):
    """base (4, 4): transform_base_to_image, mm; q_start (n,): joints at the entry, mm and rad."""

    base: Array
    q_start: Array


def stored_placement(robot: Mapping[str, Any]) -> StoredPlacement | None:
    """The placement that a plan holds for its robot, where image and patient are one frame, as in a simulation.

    None where it holds none and the robot is to be placed.
    """
    if robot.get("base") is None:
        return None
    return StoredPlacement(transform_base_to_image(_placement(robot)), np.array(robot["q_start"], dtype=np.float64))


def standing_base(robot: Mapping[str, Any], registration: ImageRegistration) -> Array | None:
    """transform_base_to_image (4, 4) of a robot beside a registered patient, mm; None where it is to be placed.

    A registration to the base says it alone; one to the patient needs the placement that the plan holds.
    """
    if registration.to == "patient" and robot.get("base") is None:
        return None
    placement = _placement(robot) if registration.to == "patient" else np.eye(4)
    return transform_base_to_image(placement, registration)


def placed_robot(
    robot: Mapping[str, Any], base: Array, q_start: Array, registration: ImageRegistration | None
) -> dict[str, Any]:
    """A plan's robot that holds a placement; base (4, 4): transform_base_to_image, mm, of a robot beside the patient.

    Raises PlanError where the registration is to the base: it says already where the robot stands.
    """
    if registration is not None and registration.to == "base":
        raise PlanError("the plan's registration is to the robot's base and says where it stands; no placing is kept.")
    # The way back of the registration takes the place of the registration: from the base on, to the patient.
    onward = None if registration is None else ImageRegistration(inverse(registration.transform))
    placement = transform_base_to_image(base, onward)
    return {**robot, "base": placement.ravel().tolist(), "q_start": q_start.tolist()}


def _placement(robot: Mapping[str, Any]) -> Array:
    return np.array(robot["base"], dtype=np.float64).reshape(4, 4)
