"""A serial robot, and the robot with its base in the patient frame: kinematics and Jacobian through Pinocchio."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import RobotError
from ..validate import real_array
from .chain_kernel import Chain
from .config import load_robot, parts_of_urdf
from .description import check_transform
from .joints import Joint, Mount, RobotParts, Visual
from .tool import Tool

# Default costs of a millimetre and of a radian of joint motion. A rotation about a remote centre moves the whole shaft:
# a radian costs as much as 50 mm of translation, the displacement of a point at a third of a shaft of 150 mm.
JOINT_WEIGHT = {"prismatic": 1.0, "revolute": 50.0}


class RobotModel:
    """A serial robot: joints from the base outwards, and the mount of the tool.

    lower, upper, speed, acceleration: (n,) joint limits in mm and rad.
    home: (n,) joints at which placement starts, in mm and rad.
    revolute: (n,) bool.
    joint_weights: (n,) relative cost of a mm or rad of each joint's motion, W_j of Li 2007, eq. 19.
    upright: whether the base stays upright when the robot is placed; otherwise its pose follows from the tool's.
    notes: sentences on what was assumed or omitted when the description was read.

    Raises:
        RobotError: no joint, more than 32 joints (HAZ-23), or a home outside the joints' ranges.

    Example:
        >>> robot = RobotModel.load("steady_hand")
        >>> len(robot.joints), robot.joints[0].kind
        (7, 'prismatic')
        >>> placed = robot.placed(np.eye(4))
        >>> tip = placed.tip(robot.home)
        >>> tip.position.shape, tip.jacobian.shape
        ((3,), (6, 7))
    """

    def __init__(
        self,
        name: str,
        title: str,
        source: str,
        joints: tuple[Joint, ...],
        visuals: tuple[Visual, ...] = (),
        mount: Mount | None = None,
        home: ArrayLike | None = None,
        upright: bool = False,
        notes: tuple[str, ...] = (),
    ):
        parts = RobotParts(name, title, source, joints, visuals, mount or Mount(), home, upright, notes)
        self.name, self.title, self.source, self.joints, self.visuals = name, title, source, joints, visuals
        self.mount, self.upright, self.notes = parts.mount, upright, notes
        self.lower = np.array([j.lower for j in joints])
        self.upper = np.array([j.upper for j in joints])
        self.speed = np.array([j.speed for j in joints])
        self.acceleration = np.array([j.acceleration for j in joints])
        self.revolute = np.array([j.kind == "revolute" for j in joints])
        self.joint_weights = np.array([JOINT_WEIGHT[j.kind] if j.weight is None else j.weight for j in joints])
        self.home: Array = np.array(parts.home)
        fixed = (self.lower, self.upper, self.speed, self.acceleration, self.revolute, self.home, self.joint_weights)
        for array in fixed:
            array.setflags(write=False)

    @classmethod
    def load(cls, name_or_path: str | Path, tool_frame: str | None = None) -> RobotModel:
        """Read a shipped robot by its name, a configuration (``vfix-robot/2``, .json) or a plain URDF (.urdf).

        Args:
            name_or_path: name of a shipped robot, or path of a file.
            tool_frame: link that holds the tool, instead of that of the configuration; required for a URDF with several
                leaf links. The shaft runs along its z axis unless a configuration sets a mount.

        Raises:
            RobotError: the file is missing, unreadable or inconsistent (HAZ-19, HAZ-20, HAZ-23).
        """
        return cls(**vars(load_robot(name_or_path, tool_frame)))

    @classmethod
    def from_pinocchio(
        cls, model: Any, tip_frame: str, weights: Mapping[str, float] | None = None, hold: str = "tail"
    ) -> RobotModel:
        """The chain of a ``pinocchio.Model`` (metres) from its universe to a frame; other joints are dropped.

        Args:
            tip_frame: frame that holds the tool; the tool's shaft runs along its z axis.
            model: the Pinocchio model.
            weights: of joints by name, see ``Joint``; hold: see ``Mount``.

        Values that a Pinocchio model lacks are assumed as for a plain URDF and listed in ``notes``: accelerations, and
        infinite speeds and ranges.

        Raises:
            RobotError: there is no such frame, a joint of the chain is neither revolute nor prismatic, or a prismatic
            joint has no limits.
        """
        from .from_pinocchio import robot_from_pinocchio  # imported here: Pinocchio is slow to load

        return cls(**vars(robot_from_pinocchio(model, tip_frame, weights, hold)))

    def transform_tip_to_link(self, tool: Tool) -> Array:
        """transform_tip_to_link (4, 4) in mm of a mounted tool; the link is the last joint's moving frame."""
        transform: Array = self.mount.transform_flange_to_link @ tool.transform_tip_to_flange(self.mount.hold)
        return transform

    def placed(self, base: ArrayLike, tip: Tool | ArrayLike | None = None) -> PlacedRobot:
        """The robot with its base at transform_base_to_patient (4, 4) in mm.

        Args:
            base: rigid transform (4, 4).
            tip: a tool, or a tip frame in the flange: transform (4, 4) or offset (3,) in mm; None is the flange.

        Raises:
            RobotError: base or tip is not a rigid transform.
        """
        if isinstance(tip, Tool):
            return PlacedRobot(self, base, self.transform_tip_to_link(tip))
        transform = np.eye(4)
        if tip is not None:
            given = real_array("the tip's placement", tip, RobotError)
            if given.shape == (3,):
                transform[:3, 3] = given
            else:
                transform = check_transform(given, "the tip's placement")
        return PlacedRobot(self, base, self.mount.transform_flange_to_link @ transform)


def robot_from_urdf(data: bytes, name: str, tool_frame: str | None = None) -> RobotModel:
    """Build the robot of a plain URDF in memory, see ``RobotModel.load``; meshes are not resolved."""
    return RobotModel(**vars(parts_of_urdf(data, name, tool_frame)))


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
        import pinocchio as pin  # imported here: slow to load

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
        import pinocchio as pin  # as above

        pin.computeJointJacobians(self._model, self._data, q)
        placement = pin.updateFramePlacement(self._model, self._data, self._tip)
        jacobian = pin.getFrameJacobian(self._model, self._data, self._tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        return TipState(placement.rotation.copy(), placement.translation.copy(), jacobian)

    def tip_pose(self, q: Array) -> tuple[Array, Array]:
        """Rotation (3, 3) and position (3,) of the tip at q, without the Jacobian."""
        import pinocchio as pin  # as above

        pin.forwardKinematics(self._model, self._data, q)
        placement = pin.updateFramePlacement(self._model, self._data, self._tip)
        return placement.rotation.copy(), placement.translation.copy()

    def link_placements(self, q: ArrayLike) -> Array:
        """Placements (n + 1, 4, 4) of the base and of every moving link in the patient frame, for drawing."""
        import pinocchio as pin  # as above

        pin.forwardKinematics(self._model, self._data, np.asarray(q, dtype=float))
        return np.stack([self.base, *(self._data.oMi[i].homogeneous for i in range(1, self._last + 1))])
