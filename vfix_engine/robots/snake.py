"""A snake robot: identical links behind universal joints (Kwok 2013, section III.A.1, fig. 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import RobotError
from ..validate import rigid_transform
from .joints import MOST_JOINTS, Joint, Mount, Visual
from .model import RobotModel
from .snake_kernel import snake_frames, snake_jacobian
from .snake_surface import LinkVertices, between_vertices_mm, link_vertices

JOINT_SPEED = math.radians(36.0)  # [rad/s] Kwok 2013, Table II
JOINT_TORQUE = 0.0756  # [N·m] Kwok 2013, Table II
MOST_LINKS = 1000
_LEAST_LENGTH_MM, _LEAST_RADIUS_MM = 1.0, 0.05  # smaller values indicate metres
_STOP_S = 0.05  # [s] assumed time from top speed to a stop
_GREY = (170, 175, 180)
_SHEET = {
    "radius_mm": "radius of the links",
    "mass_kg": "mass of a link",
    "camera_offset_mm": "camera ahead of the last link's frame",
}
_UNITS = {"radius_mm": "mm", "mass_kg": "kg", "camera_offset_mm": "mm"}


@dataclass(frozen=True)
class SnakeModel:
    """L identical links in series, each behind a universal joint; lengths in mm, angles in rad, masses in kg.

    The frame {0} is the base, with its origin at the centre of the first joint. The frame {i} of link i = 1 … L is at
    the link's far end, the centre of the next joint, with z along the link:
    T_i in {i − 1} = Rot_x(q_{2i − 1}) · Rot_y(q_{2i}) · Trans_z(length). At q = 0 all frames are parallel. The odd
    joints of the paper rotate about x, the even ones about y. In code links and joints count from 0: link l has the
    joints 2l and 2l + 1 and the frame ``frames[l + 1]``.

    A link's surface is a cylinder of ``radius_mm`` along z ∈ [−length, 0] and a sphere of ``sphere_radius_mm`` about
    its frame's origin (None: the same radius), which rounds the next joint and the robot's end. 28 mm and ± 45° are
    from the paper. Radius, mass and camera offset are assumed, since the paper does not state them. The motors of Table
    II can hold the mass: five horizontal links require 51.5 of 75.6 mN·m.

    Raises:
        RobotError: no link, a number that is not finite and positive, a joint range of 90° or more, lengths that look
            like metres, or radii that violate radius ≤ sphere < length.
    """

    links: int
    length_mm: float = 28.0
    q_max: float = math.radians(45.0)
    radius_mm: float = 6.0
    sphere_radius_mm: float | None = None
    mass_kg: float = 0.015
    camera_offset_mm: float = 6.0

    def __post_init__(self) -> None:
        if isinstance(self.links, bool) or not isinstance(self.links, int | np.integer) or self.links < 1:
            raise RobotError(f"a snake has a whole number of links, at least 1, not {self.links!r}")
        if self.links > MOST_LINKS:
            raise RobotError(f"a snake of {self.links:,} links; at most {MOST_LINKS:,} are taken")
        object.__setattr__(self, "links", int(self.links))
        names = ("length_mm", "q_max", "radius_mm", "sphere_radius_mm", "mass_kg", "camera_offset_mm")
        for name in names:
            value = getattr(self, name)
            if name == "sphere_radius_mm" and value is None:
                continue
            try:
                number = float(value)
            except (TypeError, ValueError) as error:
                raise RobotError(f"a snake's {name} must be a number, not {value!r}") from error
            if not (math.isfinite(number) and number > 0.0):
                raise RobotError(f"a snake's {name} must be finite and positive, not {number:g}")
            object.__setattr__(self, name, number)
        if self.q_max >= math.pi / 2:
            raise RobotError(f"joints of ±{math.degrees(self.q_max):g}°: a universal joint stays below 90°")
        if self.length_mm < _LEAST_LENGTH_MM or self.radius_mm < _LEAST_RADIUS_MM:
            raise RobotError(
                f"links {self.length_mm:g} mm long with a radius of {self.radius_mm:g} mm: is that in millimetres?"
            )
        if not self.radius_mm <= self.sphere_mm < self.length_mm:
            raise RobotError(
                f"links {self.length_mm:g} mm long with a radius of {self.radius_mm:g} mm and a sphere of "
                f"{self.sphere_mm:g} mm: it must be radius ≤ sphere < length"
            )

    @property
    def sphere_mm(self) -> float:
        """Radius of the sphere in mm, given or that of the cylinder."""
        return self.radius_mm if self.sphere_radius_mm is None else self.sphere_radius_mm

    @property
    def dof(self) -> int:
        """Number of joint angles, two per link."""
        return 2 * self.links

    @property
    def assumed(self) -> tuple[str, ...]:
        """Each value that is assumed and has its default, as a phrase with its unit."""
        defaults = {name: type(self).__dataclass_fields__[name].default for name in _SHEET}
        left = [name for name, value in defaults.items() if getattr(self, name) == value]
        return tuple(f"{_SHEET[name]}: {getattr(self, name):g} {_UNITS[name]}" for name in left)

    def reach_mm(self) -> float:
        """Length from the base to the last frame when straight."""
        return self.links * self.length_mm

    def frames(self, q: ArrayLike, transform_base_to_patient: ArrayLike) -> Array:
        """The base and the links' frames in the patient frame (L + 1, 4, 4) at q (2L,), [0] the base.

        Raises:
            RobotError: joints that are not 2L finite numbers, or a base that is no rigid transform.
        """
        joints, base = self._joints(q), _base(transform_base_to_patient)
        out = np.zeros((self.links + 1, 4, 4))
        out[0] = base
        out[1:, :3], out[1:, 3, 3] = self._rows(joints, base), 1.0
        return out

    def frame_before(self, link: int, q: Array, base: Array) -> Array:
        """The frame (4, 4) that a link hangs on, as ``frames`` has it, of joints and a base that are not looked at."""
        frame: Array = np.array(base)
        if link > 0:
            rows = np.empty((link, 3, 4))
            snake_frames(q, base, self.length_mm, rows)
            frame[:3] = rows[-1]
        return frame

    def tip(self, q: ArrayLike, transform_base_to_patient: ArrayLike) -> Array:
        """The last link's frame in the patient frame (4, 4); errors as for ``frames``."""
        tip: Array = self.frames(q, transform_base_to_patient)[-1].copy()
        return tip

    def camera(self, q: ArrayLike, transform_base_to_patient: ArrayLike) -> Array:
        """transform_camera_to_patient (4, 4): ahead of the last frame by ``camera_offset_mm``, with its axes (eq. 24).

        z is the optical axis; x is to the right and y down in the picture.
        """
        camera = self.tip(q, transform_base_to_patient)
        camera[:3, 3] += self.camera_offset_mm * camera[:3, 2]
        return camera

    def point_jacobian(
        self, q: ArrayLike, transform_base_to_patient: ArrayLike, link: int, point_in_link: ArrayLike
    ) -> Array:
        """Jacobian (3, 2L), in mm/rad, of a point (3,) of link 0 … L − 1 given in that link's frame, patient frame.

        Raises:
            RobotError: as for ``frames``, no such link, or a point with non-finite coordinates.
        """
        joints, base = self._joints(q), _base(transform_base_to_patient)
        if not 0 <= link < self.links:
            raise RobotError(f"link {link} is not one of 0 … {self.links - 1}")
        point = np.asarray(point_in_link, dtype=float)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise RobotError("a point of a link has three finite coordinates")
        rows = self._rows(joints, base)
        x, y, z = (float(v) for v in rows[link, :, :3] @ point + rows[link, :, 3])
        out = np.empty((3, self.dof))
        snake_jacobian(rows, base, joints, link, x, y, z, out)
        return out

    def clamp(self, q: ArrayLike) -> Array:
        """Clip joints (2L,) to ± q_max; errors as for ``frames``."""
        joints = self._joints(q)  # a copy; faster than np.clip, as a control step clamps a lot
        np.minimum(np.maximum(joints, -self.q_max, out=joints), self.q_max, out=joints)
        return joints

    def vertices(self, count: int = 500) -> LinkVertices:
        """Return exactly ``count`` vertices of the surface (Kwok 2013, section IV.B: 500 for five links)."""
        return link_vertices(self.links, count, self.length_mm, self.radius_mm, self.sphere_mm)

    def between_vertices_mm(self, each: int) -> float:
        """By how much the surface between ``each`` vertices a link can be deeper than these; ``snake_surface``."""
        return between_vertices_mm(each, self.length_mm, self.radius_mm, self.sphere_mm)

    def distal(self, links: int) -> SnakeModel:
        """Return the last ``links`` links as a snake: L' of Kwok 2013, section III.B.1.

        Raises:
            RobotError: fewer than 1 or more than there are.
        """
        if not 1 <= links <= self.links:
            raise RobotError(f"{links} distal links of a snake that has {self.links}")
        return replace(self, links=links)

    def robot_model(self) -> RobotModel:
        """Return the same robot as a ``RobotModel``; its flange is the last frame.

        Raises:
            RobotError: more joints than a ``RobotModel`` has.
        """
        if self.dof > MOST_JOINTS:
            raise RobotError(
                f"a snake of {self.links} links has {self.dof} joints, a RobotModel at most {MOST_JOINTS} "
                f"({MOST_JOINTS // 2} links)"
            )
        ahead = np.eye(4)
        ahead[2, 3] = self.length_mm
        flange = ahead.copy()
        flange[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]  # the tool's y axis along z
        joints: list[Joint] = []
        visuals: list[Visual] = []
        for link in range(self.links):
            before = ahead if link else np.eye(4)
            joints += [self._joint(link, "x", before), self._joint(link, "y", np.eye(4))]
            size, middle = (self.radius_mm, self.length_mm, 0.0), (0.0, 0.0, 0.5 * self.length_mm)
            visuals.append(Visual(2 * link + 2, "cylinder", size, middle, _GREY))
            ball = (self.sphere_mm, 0.0, 0.0)
            visuals.append(Visual(2 * link + 2, "sphere", ball, (0.0, 0.0, self.length_mm), _GREY))
        return RobotModel(
            f"snake_{self.links}",
            f"Snake of {self.links} links",
            "Kwok 2013, section III.A.1",
            tuple(joints),
            tuple(visuals),
            Mount(flange, "tail"),
            notes=self.assumed,
        )

    def _joint(self, link: int, about: str, placement: Array) -> Joint:
        axis = (1.0, 0.0, 0.0) if about == "x" else (0.0, 1.0, 0.0)
        source = "Kwok 2013, section III.A.1 and Table II; acceleration assumed"
        name, most = f"link {link + 1} about {about}", self.q_max
        return Joint(name, "revolute", axis, -most, most, JOINT_SPEED, JOINT_SPEED / _STOP_S, source, placement)

    def _joints(self, q: ArrayLike) -> Array:
        """Return a validated copy of the joints."""
        joints = np.array(q, dtype=np.float64, order="C")
        if joints.shape != (self.dof,) or not np.isfinite(joints).all():
            raise RobotError(f"a snake of {self.links} links needs {self.dof} finite joint angles")
        return joints

    def _rows(self, joints: Array, base: Array) -> Array:
        rows = np.empty((self.links, 3, 4))
        snake_frames(joints, base, self.length_mm, rows)
        return rows


def _base(transform: ArrayLike) -> Array:
    """Return a validated copy of the base (4, 4)."""
    return rigid_transform(transform, "the snake's base", RobotError)
