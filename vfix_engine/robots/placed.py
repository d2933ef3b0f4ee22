"""A robot with its base in the patient frame: kinematics and Jacobian through Pinocchio, and the kernels' chain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from .chain_kernel import Chain
from .description import check_transform

if TYPE_CHECKING:
    from .model import RobotModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TipState:
    """Tip pose and Jacobian at one configuration, in the patient frame.

    rotation: (3, 3). position: (3,) mm.
    jacobian: (6, n) per mm or rad of each joint; rows 0-2 tip velocity in mm, rows 3-5 angular velocity in rad.
    """

    rotation: Array
    position: Array
    jacobian: Array


class PlacedRobot:
    """Forward kinematics and Jacobian of a robot whose base is placed in the patient frame.

    base: transform_base_to_patient (4, 4); tip_in_link: transform (4, 4) of the tip in the last joint's moving frame.
    chain: the same kinematics as arrays, for compiled code (see ``chain_kernel.forward``).

    Raises:
        RobotError: base or tip is not a rigid transform.
    """

    def __init__(self, robot: RobotModel, base: ArrayLike, tip_in_link: Array):
        self.robot = robot
        self.base = check_transform(np.asarray(base, dtype=float))
        tip = check_transform(tip_in_link, "the tip's placement")
        model = pin.Model()
        before = self.base
        parent = 0
        for joint in robot.joints:
            axis = np.array(joint.axis)
            kind = pin.JointModelPrismaticUnaligned if joint.kind == "prismatic" else pin.JointModelRevoluteUnaligned
            placement = before @ joint.placement
            parent = model.addJoint(parent, kind(axis), pin.SE3(placement[:3, :3], placement[:3, 3]), joint.name)
            before = np.eye(4)
        offset = pin.SE3(tip[:3, :3], tip[:3, 3])
        self._tip = model.addFrame(pin.Frame("tip", parent, 0, offset, pin.FrameType.OP_FRAME))
        self._model, self._data, self._last = model, model.createData(), parent
        placements = [model.jointPlacements[i] for i in range(1, parent + 1)]
        self.chain = Chain.of(
            robot.revolute,
            np.array([joint.axis for joint in robot.joints]),
            np.stack([place.rotation for place in placements]),
            np.stack([place.translation for place in placements]),
            offset.rotation,
            offset.translation,
        )

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.robot.joints)

    def tip(self, q: Array) -> TipState:
        """Tip pose and Jacobian at q (n,)."""
        pin.computeJointJacobians(self._model, self._data, q)
        placement = pin.updateFramePlacement(self._model, self._data, self._tip)
        jacobian = pin.getFrameJacobian(self._model, self._data, self._tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        return TipState(placement.rotation.copy(), placement.translation.copy(), jacobian)

    def tip_pose(self, q: Array) -> tuple[Array, Array]:
        """Rotation (3, 3) and position (3,) of the tip at q, without the Jacobian."""
        pin.forwardKinematics(self._model, self._data, q)
        placement = pin.updateFramePlacement(self._model, self._data, self._tip)
        return placement.rotation.copy(), placement.translation.copy()

    def link_placements(self, q: ArrayLike) -> Array:
        """Placements (n + 1, 4, 4) of the base and of every moving link in the patient frame, for drawing."""
        pin.forwardKinematics(self._model, self._data, np.asarray(q, dtype=float))
        return np.stack([self.base, *(self._data.oMi[i].homogeneous for i in range(1, self._last + 1))])
