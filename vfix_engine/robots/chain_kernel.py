"""Forward kinematics and Jacobian of a serial robot, compiled: the copy of Pinocchio's model that the step uses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import compiled

Array = NDArray[np.float64]


class Chain(NamedTuple):
    """A serial robot with n joints placed in the patient frame; lengths in mm.

    revolute: (n,) bool; axis: (n, 3) unit vectors in the joint's own frame.
    rotation: (n, 3, 3), offset: (n, 3) placement of each joint's frame in the frame of the joint before it; the first
    one is its placement in the patient frame, the robot's base included.
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
        """Read-only copies of the arrays, so that every chain has the one type the kernels are compiled for."""
        floats = (axis, rotation, offset, tip_rotation, tip_offset)
        kinds = np.array(revolute, dtype=np.bool_, order="C")
        copies = [np.array(a, dtype=np.float64, order="C") for a in floats]
        for array in (kinds, *copies):
            array.setflags(write=False)
        return cls(kinds, *copies)


@compiled
def _turned(rotation: Array, axis: Array, angle: float, out: Array) -> None:
    """out = rotation · Rot(axis, angle) by Rodrigues' formula."""
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    x, y, z = axis[0], axis[1], axis[2]
    for i in range(3):
        a, b, e = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        out[i, 0] = a * (c + x * x * v) + b * (y * x * v + z * s) + e * (z * x * v - y * s)
        out[i, 1] = a * (x * y * v - z * s) + b * (c + y * y * v) + e * (z * y * v + x * s)
        out[i, 2] = a * (x * z * v + y * s) + b * (y * z * v - x * s) + e * (c + z * z * v)


@compiled
def _times(one: Array, two: Array, out: Array) -> None:
    for i in range(3):
        for j in range(3):
            out[i, j] = one[i, 0] * two[0, j] + one[i, 1] * two[1, j] + one[i, 2] * two[2, j]


@compiled
def forward(chain: Chain, q: Array, rotation_out: Array, position_out: Array, jacobian_out: Array) -> None:
    """Tip pose and Jacobian in the patient frame at joints q (n,), written into the last three arguments.

    Args:
        rotation_out: (3, 3); position_out: (3,) mm.
        jacobian_out: (6, n), rows 0-2 the tip's velocity, rows 3-5 the angular velocity per unit of joint speed.
    """
    n = len(q)
    frame, placed, origin = np.empty((3, 3)), np.empty((3, 3)), np.zeros(3)
    for i in range(3):
        for k in range(3):
            frame[i, k] = 1.0 if i == k else 0.0
    for j in range(n):
        for i in range(3):
            for k in range(3):
                origin[i] += frame[i, k] * chain.offset[j, k]
        _times(frame, chain.rotation[j], placed)
        for i in range(3):
            along = placed[i, 0] * chain.axis[j, 0] + placed[i, 1] * chain.axis[j, 1] + placed[i, 2] * chain.axis[j, 2]
            if chain.revolute[j]:
                jacobian_out[i, j], jacobian_out[3 + i, j] = (
                    origin[i],
                    along,
                )  # the joint's place until the tip's is known
            else:
                jacobian_out[i, j], jacobian_out[3 + i, j] = along, 0.0
                origin[i] += along * q[j]
        if chain.revolute[j]:
            _turned(placed, chain.axis[j], q[j], frame)
        else:
            for i in range(3):
                for k in range(3):  # a slice would compile numba's texts about shapes, which takes seconds
                    frame[i, k] = placed[i, k]
    for i in range(3):
        position_out[i] = origin[i]
        for k in range(3):
            position_out[i] += frame[i, k] * chain.tip_offset[k]
    _times(frame, chain.tip_rotation, rotation_out)
    for j in range(n):
        if chain.revolute[j]:
            x, y, z = jacobian_out[3, j], jacobian_out[4, j], jacobian_out[5, j]
            rx, ry, rz = (
                position_out[0] - jacobian_out[0, j],
                position_out[1] - jacobian_out[1, j],
                position_out[2] - jacobian_out[2, j],
            )
            jacobian_out[0, j] = y * rz - z * ry
            jacobian_out[1, j] = z * rx - x * rz
            jacobian_out[2, j] = x * ry - y * rx
