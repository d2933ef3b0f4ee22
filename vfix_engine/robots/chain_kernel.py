"""Forward kinematics and Jacobian of a serial robot, compiled for the control step; equal to Pinocchio's."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..kernels.compiled import inlined


class Chain(NamedTuple):
    """A serial robot with n joints placed in the patient frame; lengths in mm.

    revolute: (n,) bool; axis: (n, 3) unit vectors in the joint's own frame.
    rotation: (n, 3, 3), offset: (n, 3) placement of each joint's frame in the frame of the previous joint; that of the
    first joint is in the patient frame and includes the base.
    tip_rotation: (3, 3), tip_offset: (3,) placement of the tip frame in the last joint's moving frame.
    """

    revolute: NDArray[np.bool_]
    axis: Array
    rotation: Array
    offset: Array
    tip_rotation: Array
    tip_offset: Array

    @classmethod
    def of(
        cls,
        revolute: NDArray[np.bool_],
        axis: Array,
        rotation: Array,
        offset: Array,
        tip_rotation: Array,
        tip_offset: Array,
    ) -> Chain:
        """Make read-only copies of the arrays, so that every chain has the one type for which kernels are compiled."""
        floats = (axis, rotation, offset, tip_rotation, tip_offset)
        kinds = np.array(revolute, dtype=np.bool_, order="C")
        copies = [np.array(a, dtype=np.float64, order="C") for a in floats]
        for array in (kinds, *copies):
            array.setflags(write=False)
        return cls(kinds, *copies)


@inlined
def _lever_arms(chain: Chain, position: Array, jacobian: Array) -> None:
    """Replace the joint positions in the columns of revolute joints by ω × (tip − position)."""
    for j in range(jacobian.shape[1]):
        if chain.revolute[j]:
            x, y, z = jacobian[3, j], jacobian[4, j], jacobian[5, j]
            rx, ry, rz = position[0] - jacobian[0, j], position[1] - jacobian[1, j], position[2] - jacobian[2, j]
            jacobian[0, j], jacobian[1, j], jacobian[2, j] = y * rz - z * ry, z * rx - x * rz, x * ry - y * rx


@inlined
def forward(chain: Chain, q: Array, rotation_out: Array, position_out: Array, jacobian_out: Array) -> None:
    """Write tip pose and Jacobian in the patient frame at joints q (n,), mm and rad.

    Args:
        chain: the robot; q: joints (n,).
        rotation_out: (3, 3); position_out: (3,) mm.
        jacobian_out: (6, n), rows 0-2 the tip's velocity, rows 3-5 the angular velocity per unit of joint speed.
    """
    frame, origin = rotation_out, position_out  # of the present joint, until the tip is reached
    for i in range(3):
        origin[i] = 0.0
        for k in range(3):
            frame[i, k] = 1.0 if i == k else 0.0
    for j in range(len(q)):
        x, y, z = chain.axis[j, 0], chain.axis[j, 1], chain.axis[j, 2]
        c, s = np.cos(q[j]), np.sin(q[j])
        v = 1.0 - c
        for i in range(3):
            a, b, e = frame[i, 0], frame[i, 1], frame[i, 2]
            origin[i] += a * chain.offset[j, 0] + b * chain.offset[j, 1] + e * chain.offset[j, 2]
            for k in range(3):
                frame[i, k] = a * chain.rotation[j, 0, k] + b * chain.rotation[j, 1, k] + e * chain.rotation[j, 2, k]
            a, b, e = frame[i, 0], frame[i, 1], frame[i, 2]
            along = a * x + b * y + e * z
            if chain.revolute[j]:
                # Holds the joint's position until the tip is known, see ``_lever_arms``.
                jacobian_out[i, j], jacobian_out[3 + i, j] = origin[i], along
                # Times Rot(axis, q) by Rodrigues' formula.
                frame[i, 0] = a * (c + x * x * v) + b * (y * x * v + z * s) + e * (z * x * v - y * s)
                frame[i, 1] = a * (x * y * v - z * s) + b * (c + y * y * v) + e * (z * y * v + x * s)
                frame[i, 2] = a * (x * z * v + y * s) + b * (y * z * v - x * s) + e * (c + z * z * v)
            else:
                jacobian_out[i, j], jacobian_out[3 + i, j] = along, 0.0
                origin[i] += along * q[j]
    for i in range(3):
        a, b, e = frame[i, 0], frame[i, 1], frame[i, 2]
        position_out[i] = origin[i] + (a * chain.tip_offset[0] + b * chain.tip_offset[1] + e * chain.tip_offset[2])
        for k in range(3):
            rotation_out[i, k] = (
                a * chain.tip_rotation[0, k] + b * chain.tip_rotation[1, k] + e * chain.tip_rotation[2, k]
            )
    _lever_arms(chain, position_out, jacobian_out)
