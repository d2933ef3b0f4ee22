"""The placement of a robot's base at which its tool has a desired pose."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import StartRefused
from ...robots import PlacedRobot, RobotModel, Tool
from ...robots.inverse import IkResult, inverse_kinematics

UP = np.array([0.0, 0.0, 1.0])  # vertical of the operating room: superior, as on the page
_PARALLEL = 1e-6
_SAME_LINE_MM = 0.05  # a joint's axis this near to the shaft counts as the shaft's


class BasePlacement:
    """One robot with one tool; ``at`` finds a base for every pose of the tip.

    base: transform_base_to_image (4, 4) of a robot with a fixed base; ``at`` then computes only its joints.
    """

    def __init__(self, robot: RobotModel, tool: Tool, base: Array | None = None):
        self._robot, self._tool, self._base = robot, tool, base
        self._at_origin = robot.placed(np.eye(4), tool)
        self._roll_joint, self._sense = self._find_roll_joint()

    def at(self, rotation: Array, position: Array, roll: float) -> tuple[Array, Array]:
        """Base (4, 4) and joints (n,) for the tip at (rotation, position).

        A robot that can rotate the tool about its shaft makes the roll by that joint, so that its base does not tilt;
        the base follows from the home configuration: T_base = T_tip · FK(home)⁻¹.
        The base of a robot with ``stands`` is then rotated upright about the tip, and its joints are solved again from
        home.

        Args:
            rotation: (3, 3), including the roll about the shaft.

        Raises:
            StartRefused: a robot with an upright or fixed base cannot hold the tool in this pose.
        """
        q = self._robot.home.copy()
        if self._roll_joint is not None:
            q[self._roll_joint] = self._turned(self._roll_joint, self._sense * roll)
        base = self._beside(rotation, position, q) if self._base is None else self._base
        if self._base is None and not self._robot.upright:
            return base, q
        reached = inverse_kinematics(self._robot.placed(base, self._tool), rotation, position, q)
        if not reached.found:
            how = "while it stands upright" if self._base is None else "from where it stands"
            raise StartRefused(f"{self._robot.title} cannot hold the tool like that {how}{self._stops(reached)}")
        return base, reached.q

    def _beside(self, rotation: Array, position: Array, q: Array) -> Array:
        """Base (4, 4) that brings the tip to a pose with these joints; an upright one to the position alone."""
        tip_rotation, tip_position = self._at_origin.tip_pose(q)
        base = np.eye(4)
        base[:3, :3] = rotation @ tip_rotation.T
        if self._robot.upright:
            base[:3, :3] = _upright(base[:3, :3])
        base[:3, 3] = position - base[:3, :3] @ tip_position
        return base

    def _stops(self, reached: IkResult) -> str:
        """The limiting joints, and the distance from the entry."""
        if not reached.stopped:
            return ""
        joints = " and ".join(f"joint {j + 1} ({self._robot.joints[j].name})" for j in reached.stopped)
        verb = "is at its limit" if len(reached.stopped) == 1 else "are at their limits"
        return f": {joints} {verb}, {reached.position_error_mm:.0f} mm from there"

    def _turned(self, joint: int, angle: float) -> float:
        """Home and a turn, by a full turn less where the range asks for it; home where its range has neither."""
        home, lower, upper = (float(a[joint]) for a in (self._robot.home, self._robot.lower, self._robot.upper))
        for turns in (0.0, -2.0 * np.pi, 2.0 * np.pi):
            if lower <= home + angle + turns <= upper:
                return home + angle + turns
        return home

    def _find_roll_joint(self) -> tuple[int | None, float]:
        """The joint nearest to the tool whose axis is the shaft's at home, and whether it turns the same way round."""
        tip = self._at_origin.tip(self._robot.home)
        tail = self._tool.segments(tip.rotation, tip.position).start[-1]
        shaft = tip.rotation[:, 1]
        for joint in reversed(np.flatnonzero(self._robot.revolute)):
            axis = tip.jacobian[3:, joint]
            moved = tip.jacobian[:3, joint] + np.cross(axis, tail - tip.position)
            if abs(abs(float(axis @ shaft)) - 1.0) < _PARALLEL and float(np.linalg.norm(moved)) < _SAME_LINE_MM:
                return int(joint), float(np.sign(axis @ shaft))
        return None, 1.0


def tip_freedom(placed: PlacedRobot, q: Array) -> int:
    """Number of directions in which the robot can move its tip at q (n,)."""
    return int(np.linalg.matrix_rank(placed.tip(q).jacobian[:3], tol=1e-6))


def _upright(rotation: Array) -> Array:
    """The nearest rotation (3, 3) whose z axis points up."""
    z = rotation[:, 2]
    axis, cosine = np.cross(z, UP), float(z @ UP)
    if cosine < -1.0 + 1e-9:  # upside down: about x, as an arbitrary perpendicular axis
        return np.column_stack([rotation[:, 0], -rotation[:, 1], -z])
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turned: Array = (np.eye(3) + cross + cross @ cross / (1.0 + cosine)) @ rotation
    return turned
