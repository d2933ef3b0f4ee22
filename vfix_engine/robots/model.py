"""A serial robot read from its data file, and the same robot placed in the patient frame."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ..errors import RobotError
from ..resources import assets_dir
from .chain_kernel import Chain

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """One joint: range, speed and acceleration in mm, mm/s, mm/s² (prismatic) or rad, rad/s, rad/s² (revolute)."""

    name: str
    kind: str
    axis: tuple[float, float, float]
    lower: float
    upper: float
    speed: float
    acceleration: float
    range_source: str

    @property
    def unit(self) -> str:
        return "mm" if self.kind == "prismatic" else "rad"


@dataclass(frozen=True)
class Visual:
    """A box or cylinder that rides on a link; size in mm: box (x, y, z), cylinder (radius, length along y, 0)."""

    link: int
    kind: str
    size: tuple[float, float, float]
    position: tuple[float, float, float]
    colour: tuple[int, int, int]


@dataclass(frozen=True)
class TipState:
    """Tip pose and Jacobian at one configuration, in the patient frame.

    rotation (3, 3), position (3,) in mm, jacobian (6, n): rows 0-2 tip velocity, rows 3-5 angular velocity.
    """

    rotation: Array
    position: Array
    jacobian: Array


class RobotModel:
    """A robot as data: joints from the base outwards; the last link's frame is the flange that holds the tool.

    The shaft runs along the flange's y axis.
    At q = 0 the flange frame is the base frame; at zero insertion the remote-centre rotations cross in its origin.
    """

    def __init__(self, name: str, title: str, source: str, joints: tuple[Joint, ...], visuals: tuple[Visual, ...]):
        self.name, self.title, self.source, self.joints, self.visuals = name, title, source, joints, visuals
        self.lower = np.array([j.lower for j in joints])
        self.upper = np.array([j.upper for j in joints])
        self.speed = np.array([j.speed for j in joints])
        self.acceleration = np.array([j.acceleration for j in joints])
        self.revolute = np.array([j.kind == "revolute" for j in joints])
        for array in (self.lower, self.upper, self.speed, self.acceleration, self.revolute):
            array.setflags(write=False)

    @classmethod
    def load(cls, name_or_path: str | Path) -> RobotModel:
        """Read a robot file, or a shipped robot by its name.

        Raises:
            RobotError: the file is missing, is no robot file, or a joint makes no sense.
        """
        data = read_description(name_or_path, "robots", "vfix-robot/1")
        try:
            joints = tuple(_joint(i, entry) for i, entry in enumerate(data["joints"], 1))
            visuals = tuple(_visual(entry, len(joints)) for entry in data.get("visuals", []))
            return cls(str(data["name"]), str(data["title"]), str(data["source"]), joints, visuals)
        except (KeyError, TypeError, ValueError) as error:
            raise RobotError(f"robot file {Path(name_or_path).name}: {error!r} is missing or not usable") from error

    @property
    def travel(self) -> float:
        """Longest lever in mm that prismatic joints can put between a revolute joint and the tip (a bound)."""
        extent = np.maximum(np.abs(self.lower), np.abs(self.upper))
        return float(extent[~self.revolute].sum())

    def placed(self, base: ArrayLike, tip_in_flange: ArrayLike = (0.0, 0.0, 0.0)) -> PlacedRobot:
        """The robot with its base at transform_base_to_patient (4, 4) in mm and a tool's tip (3,) off its flange."""
        return PlacedRobot(self, np.asarray(base, dtype=float), np.asarray(tip_in_flange, dtype=float))


class PlacedRobot:
    """Forward kinematics and Jacobian of a robot whose base stands in the patient frame."""

    def __init__(self, robot: RobotModel, base: Array, tip_in_flange: Array):
        self.robot, self.base = robot, check_transform(base)
        model = pin.Model()
        placement = pin.SE3(base[:3, :3], base[:3, 3])
        parent = 0
        for joint in robot.joints:
            axis = np.array(joint.axis)
            kind = pin.JointModelPrismaticUnaligned if joint.kind == "prismatic" else pin.JointModelRevoluteUnaligned
            parent = model.addJoint(parent, kind(axis), placement, joint.name)
            placement = pin.SE3.Identity()
        offset = pin.SE3(np.eye(3), tip_in_flange)
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
        """Placements (n + 1, 4, 4) of the base and of every link in the patient frame, for drawing."""
        pin.forwardKinematics(self._model, self._data, np.asarray(q, dtype=float))
        return np.stack([self.base, *(self._data.oMi[i].homogeneous for i in range(1, self._last + 1))])


def read_description(name_or_path: str | Path, folder: str, schema: str) -> dict[str, Any]:
    """A JSON description from a path, or from the assets by its name; checks the schema's name and version."""
    text = str(name_or_path)
    shipped = text.replace("_", "").replace("-", "").isalnum()
    path = assets_dir() / folder / f"{text}.json" if shipped else Path(text)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        known = ", ".join(sorted(p.stem for p in (assets_dir() / folder).glob("*.json")))
        raise RobotError(f"no {folder[:-1]} '{text}'; shipped are: {known}") from error
    except (OSError, ValueError) as error:
        raise RobotError(f"{path.name} cannot be read as JSON: {error}") from error
    if not isinstance(data, dict) or data.get("schema") != schema:
        raise RobotError(f"{path.name} is not a {schema} file")
    return data


def check_transform(transform: Array) -> Array:
    """A copy of a rigid transform (4, 4), refused when it is not one."""
    matrix = np.array(transform, dtype=float)
    rigid = (
        matrix.shape == (4, 4)
        and bool(np.isfinite(matrix).all())
        and np.allclose(matrix[3], [0, 0, 0, 1])
        and np.allclose(matrix[:3, :3].T @ matrix[:3, :3], np.eye(3), atol=1e-6)
        and np.linalg.det(matrix[:3, :3]) > 0
    )
    if not rigid:
        raise RobotError("the robot's base is not a rigid transform (4 x 4, orthonormal, right-handed)")
    matrix.setflags(write=False)
    return matrix


def _joint(number: int, entry: dict[str, Any]) -> Joint:
    axis = tuple(float(v) for v in entry["axis"])
    joint = Joint(
        str(entry["name"]),
        str(entry["kind"]),
        (axis[0], axis[1], axis[2]),
        float(entry["lower"]),
        float(entry["upper"]),
        float(entry["speed"]),
        float(entry["acceleration"]),
        str(entry["range_source"]),
    )
    if joint.kind not in ("prismatic", "revolute"):
        raise RobotError(f"joint {number}: kind '{joint.kind}' is not prismatic or revolute")
    numbers = (*joint.axis, joint.lower, joint.upper, joint.speed, joint.acceleration)
    if not all(math.isfinite(v) for v in numbers) or abs(math.hypot(*joint.axis) - 1) > 1e-9:
        raise RobotError(f"joint {number}: axis must have length 1 and every number be finite")
    if not joint.lower < joint.upper:
        raise RobotError(f"joint {number}: range {joint.lower} … {joint.upper} is empty")
    if joint.speed <= 0 or joint.acceleration <= 0:
        raise RobotError(f"joint {number}: speed {joint.speed} and acceleration {joint.acceleration} must be positive")
    return joint


def _visual(entry: dict[str, Any], joints: int) -> Visual:
    if not 0 <= int(entry["link"]) <= joints or entry["kind"] not in ("box", "cylinder"):
        raise RobotError(f"visual on link {entry['link']}: unknown link or kind '{entry['kind']}'")
    size, position, colour = entry["size"], entry["position"], entry["colour"]
    return Visual(
        int(entry["link"]),
        str(entry["kind"]),
        (float(size[0]), float(size[1]), float(size[2])),
        (float(position[0]), float(position[1]), float(position[2])),
        (int(colour[0]), int(colour[1]), int(colour[2])),
    )
