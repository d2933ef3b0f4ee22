"""A robot from a Pinocchio model: the chain of joints from the base to one frame."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from ..arrays import Array
from ..errors import RobotError
from .description import transform_of
from .joints import Joint, Mount, RobotParts
from .serial import ASSUMED_SPEED, ASSUMED_STOP_S, CONTINUOUS_RANGE

MM_PER_M = 1000.0
Z_ALONG_SHAFT = (0.5 * np.pi, 0.0, 0.0)  # rotates the flange's y axis, along the shaft, to z of the tool frame
_LARGEST = 1e6  # a limit above it means no limit


def robot_from_pinocchio(
    model: pin.Model, tip_frame: str, weights: Mapping[str, float] | None = None, hold: str = "tail"
) -> RobotParts:
    """See ``RobotModel.from_pinocchio``."""
    if not model.existFrame(tip_frame):
        names = ", ".join(frame.name for frame in list(model.frames)[:20])
        raise RobotError(f"the Pinocchio model has no frame '{tip_frame}'; it has {names}")
    frame = model.frames[model.getFrameId(tip_frame)]
    chain: list[int] = []
    joint = int(frame.parentJoint)
    while joint > 0:
        chain.insert(0, joint)
        joint = int(model.parents[joint])
    known = {model.names[i] for i in chain}
    if unknown := sorted(set(weights or {}) - known):
        raise RobotError(f"a weight is given for '{unknown[0]}', which is no joint between the base and '{tip_frame}'")
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    joints, notes = [], []
    for i in chain:
        made, assumed = _joint(model, data, i, (weights or {}).get(model.names[i]))
        joints.append(made)
        notes += assumed
    mount = Mount(_in_mm(frame.placement) @ transform_of((0.0, 0.0, 0.0), Z_ALONG_SHAFT), hold)
    return RobotParts(model.name, model.name, "Pinocchio", tuple(joints), (), mount, notes=tuple(notes))


def _joint(model: pin.Model, data: pin.Data, i: int, weight: float | None) -> tuple[Joint, list[str]]:
    """Convert one joint to mm and rad, and list the assumptions made."""
    name, given = model.names[i], model.joints[i]
    where, assumed = f"joint '{name}'", []
    if given.nv != 1:
        raise RobotError(f"{where} is a {given.shortname()}: a chain needs revolute and prismatic joints")
    jacobian = pin.getJointJacobian(model, data, i, pin.ReferenceFrame.LOCAL)
    column = jacobian.reshape(6, -1)[:, given.idx_v]  # the Jacobian is a vector for a model with one joint
    shift, turn = column[:3], column[3:]
    if np.allclose(shift, 0.0) == np.allclose(turn, 0.0):
        raise RobotError(f"{where} is a {given.shortname()}: a chain needs revolute and prismatic joints")
    kind = "prismatic" if np.allclose(turn, 0.0) else "revolute"
    axis, unit = (shift, MM_PER_M) if kind == "prismatic" else (turn, 1.0)
    lower, upper = -np.inf, np.inf
    if given.nq == 1:  # a continuous joint may have two coordinates, cosine and sine
        lower, upper = float(model.lowerPositionLimit[given.idx_q]), float(model.upperPositionLimit[given.idx_q])
    if not max(abs(lower), abs(upper)) < _LARGEST:
        if kind == "prismatic":
            raise RobotError(f"{where} has no limits; set lowerPositionLimit and upperPositionLimit of the model")
        lower, upper = -CONTINUOUS_RANGE, CONTINUOUS_RANGE
        assumed.append(f"{where} has no limits: eight turns either way are assumed")
    speed = float(model.velocityLimit[given.idx_v]) * unit
    if not 0.0 < speed < _LARGEST * unit:
        speed = ASSUMED_SPEED[kind]
        assumed.append(f"{where} has no speed: {speed:g} {'mm' if kind == 'prismatic' else 'rad'}/s is assumed")
    assumed.append(f"{where} has no acceleration: a stop from top speed within {ASSUMED_STOP_S:g} s is assumed")
    x, y, z = (axis / np.linalg.norm(axis)).tolist()
    lower, upper = lower * unit, upper * unit
    source = "; ".join(["Pinocchio", *(note.removeprefix(f"{where} ") for note in assumed)])
    made = Joint(
        name, kind, (x, y, z), lower, upper, speed, speed / ASSUMED_STOP_S, source,
        _in_mm(model.jointPlacements[i]), weight,
    )  # fmt: skip
    return made, assumed


def _in_mm(placement: pin.SE3) -> Array:
    transform: Array = placement.homogeneous.copy()
    transform[:3, 3] *= MM_PER_M
    return transform
