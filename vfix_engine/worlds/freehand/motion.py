"""One control period of a free tool: the hand's force and torque against those of contact, without inertia.

    v_tip = gain · (f + Σ f_i),   ω = rotation gain · (|τ| − resistance) · τ / |τ|

with f_i the forces of contact. It is the admittance of the robot's free motion without robot and certificate. The hand
holds the tool's orientation: contact reduces a turn that the hand makes, but makes none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...geometry.capsules import Segments
from ...geometry.shaft_kernels import turned
from ...kernels.triples import triple
from ...robots import Tool
from .contact import MOST_SIDES, NO_CONTACT, ContactForces, ContactModel

STIFF_SHARE = 0.25  # of the penetration that contact forces take back within a substep, all sides together
CORE_SHARE = 0.9  # of the radius: bone never comes nearer to the axis, whose distance says how deep it is
MOVE_SHARE = 0.05  # of the least radius: the longest motion of any part within a substep; no axis passes bone in it
_DONE = 1e-9  # of a control period: less than that is rounding


class ToolPose(NamedTuple):
    """Pose of the tip, and the tool in it."""

    position: Array
    rotation: Array
    segments: Segments


def pose_of(tool: Tool, position: Array, rotation: Array) -> ToolPose:
    """The tool with its tip at (3,) and (3, 3)."""
    return ToolPose(position, rotation, tool.segments(rotation, position))


def moved(
    tool: Tool,
    around: ContactModel,
    pose: ToolPose,
    clearance: float,
    force: Array,
    torque: Array,
    settings: ControlSettings,
) -> tuple[ToolPose, ContactForces, bool]:
    """The pose after one control period, the contact forces there, and whether bone held the tool in all of it.

    clearance: no bone is nearer to the tool, in mm. force: (3,) in N; torque: (3,) in N·mm about the tip.
    """
    dt, gain, turning = settings.dt_s, settings.gain_mm_per_s_per_n, settings.rotation_gain_rad_per_s_per_nmm
    reach = float(np.linalg.norm(tool.segments(np.eye(3), np.zeros(3)).start, axis=1).max())
    if dt * _speed(gain * force, turning * torque, reach) < clearance:  # bone is out of reach
        position = pose.position + dt * gain * force
        rotation = _turned(pose.rotation, dt * turning * torque)
        return pose_of(tool, position, rotation), NO_CONTACT, False
    stiff = gain * around.stiffness_n_per_mm * MOST_SIDES * dt / STIFF_SHARE
    stable, furthest = dt / max(math.ceil(stiff), 1), MOVE_SHARE * float(tool.radius.min())
    push, left, free = around.push(pose.segments), dt, False
    while left > _DONE * dt:
        velocity = gain * (force + push.force.sum(axis=0))
        turn = turning * _against(torque, push, pose.position)
        speed = _speed(velocity, turn, reach)
        h = min(left, stable, furthest / speed if speed > 0.0 else math.inf)  # no part passes bone within a substep
        left -= h
        for share in (1.0, 0.5, 0.25):
            there = pose_of(tool, pose.position + share * h * velocity, _turned(pose.rotation, share * h * turn))
            after = around.push(there.segments)
            if after.deepest <= max(CORE_SHARE, push.deepest):
                pose, push, free = there, after, True
                break
    return pose, push, not free


def _speed(velocity: Array, turn: Array, reach: float) -> float:
    """At most so fast in mm/s is any part of the tool, which reaches ``reach`` mm from its tip."""
    return float(np.linalg.norm(velocity)) + float(np.linalg.norm(turn)) * reach


def _against(torque: Array, push: ContactForces, tip: Array) -> Array:
    """The hand's torque (3,) less what contact resists of it; never reversed."""
    size = float(np.linalg.norm(torque))
    if size == 0.0 or not len(push.force):
        return torque
    about_tip = np.cross(push.at - tip, push.force).sum(axis=0)
    resistance = max(-float(about_tip @ torque) / size, 0.0)
    return torque * max(1.0 - resistance / size, 0.0)


def _turned(rotation: Array, turn: Array) -> Array:
    """The rotation (3, 3) after a rotation vector (3,) in rad, orthonormal again."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return rotation
    axis = triple(turn / angle)
    found = np.column_stack([turned(triple(one), axis, angle) for one in rotation.T])
    first = found[:, 0] / np.linalg.norm(found[:, 0])
    second = found[:, 1] - (found[:, 1] @ first) * first
    second /= np.linalg.norm(second)
    return np.column_stack([first, second, np.cross(first, second)])
