"""The placement of a plan's robot in the image frame."""

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
    """Return the placement that a plan holds for its robot, if image and patient share a frame, as in a simulation.

    None if it holds none, so that the robot has to be placed.
    """
    if robot.get("base") is None:
        return None
    return StoredPlacement(transform_base_to_image(_placement(robot)), np.array(robot["q_start"], dtype=np.float64))


def standing_base(robot: Mapping[str, Any], registration: ImageRegistration) -> Array | None:
    """Return transform_base_to_image (4, 4), mm, of a robot at a registered patient; None if it has to be placed.

    A registration to the base defines it alone; a registration to the patient needs the placement held by the plan.
    """
    if registration.to == "patient" and robot.get("base") is None:
        return None
    placement = _placement(robot) if registration.to == "patient" else np.eye(4)
    return transform_base_to_image(placement, registration)


def placed_robot(
    robot: Mapping[str, Any], base: Array, q_start: Array, registration: ImageRegistration | None
) -> dict[str, Any]:
    """Return a plan's robot with a placement. base (4, 4): transform_base_to_image, mm.

    Raises PlanError for a registration to the base, which already defines where the robot stands.
    """
    if registration is not None and registration.to == "base":
        raise PlanError("no placing is kept; the plan's registration to the robot's base says where it stands.")
    # The inverse registration continues the transform from the image to the patient.
    onward = None if registration is None else ImageRegistration(inverse(registration.transform))
    placement = transform_base_to_image(base, onward)
    return {**robot, "base": placement.ravel().tolist(), "q_start": q_start.tolist()}


def _placement(robot: Mapping[str, Any]) -> Array:
    return np.array(robot["base"], dtype=np.float64).reshape(4, 4)
