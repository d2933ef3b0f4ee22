"""Where the tool truly is: the error chain, sample by sample, of a drive that goes on or of a recorded one.

    q_true   = play(lag(q)) + noise                      joints: servo, backlash, encoders
    x        = FK(q_true) + C (f + weight)               tip in the robot's belief of the head, under the hand
    x_true   = T_registration x − d(t)                   tip in the head as it is, which has moved by d

Backlash is the play operator: the joint rests until the motor has crossed the play, then it is carried along. The
chain knows only the samples that it is given: between two of them a set point moves straight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array
from ...geometry.capsules import Segments
from ...robots import PlacedRobot, Tool
from ...worlds.rigid.snapshot import RigidSnapshot, camera_at
from .chain import ErrorChain


class Sample(NamedTuple):
    """What the chain needs of one step of a drive; patient frame, mm.

    t, step: simulated time in s and number of the step; q: (n,) joints, None without a robot.
    position, rotation: (3,) and (3, 3), pose of the tip that goes with q.
    force: (3,) in N of a hand on the handle, None where there is none: teleoperated, or in a free hand.
    deflection: (3,) that the controller knows of and has led the tip by, 0 without compensation.
    """

    t: float
    step: int
    q: Array | None
    position: Array
    rotation: Array
    force: Array | None
    deflection: Array


@dataclass(frozen=True, eq=False)
class Truth:
    """Where the tool is believed to be and where it is; LPS, mm.

    believed, true: (3,) tips; rotation: (3, 3) true; segments: the true tool.
    """

    believed: Array
    true: Array
    rotation: Array
    segments: Segments

    @property
    def difference_mm(self) -> float:
        """Distance of both tips."""
        return float(np.linalg.norm(self.true - self.believed))


class TrueTool:
    """Follows a drive with one chain: give it the samples in their order.

    A sample earlier than the last is a return to the start, where the servo has arrived and the joints lie in the
    middle of their play. The same sample again gives the same answer.

    Args:
        robot: with the tool's tip as its tip; None in a free hand, whose chain is ``for_free_hand``.
    """

    def __init__(self, chain: ErrorChain, tool: Tool, robot: PlacedRobot | None):
        self.chain = chain if robot is not None else chain.for_free_hand()
        self._tool, self._robot = tool, robot
        self._registration = np.eye(4) if self.chain.registration is None else self.chain.registration.transform
        self._t, self._set_point = math.inf, np.zeros(0)
        self._motor = self._joint = self._set_point

    def at(self, sample: Sample) -> Truth:
        """The truth of a sample."""
        chain, believed = self.chain, sample.position + sample.deflection
        if chain.empty:
            segments = self._tool.segments(sample.rotation, sample.position)
            return Truth(believed, sample.position, sample.rotation, segments)
        position, rotation = self._by_joints(sample)
        if chain.compliance is not None and sample.force is not None:
            position = position + chain.compliance.deflection(sample.force)
        turn = self._registration[:3, :3]
        position, rotation = turn @ position + self._registration[:3, 3], turn @ rotation
        if chain.head is not None:
            position = position - chain.head.displacement(sample.t)
        return Truth(believed, position, rotation, self._tool.segments(rotation, position))

    def _by_joints(self, sample: Sample) -> tuple[Array, Array]:
        """Pose of the tip without compliance, in the robot's belief of the head."""
        if self._robot is None or sample.q is None or not self.chain.moves_joints:
            return sample.position, sample.rotation
        rotation, position = self._robot.tip_pose(self._joints(self._robot, sample.t, sample.step, sample.q))
        return position, rotation

    def _joints(self, robot: PlacedRobot, t: float, step: int, q: Array) -> Array:
        """True joints (n,) under a set point; updates what servo and play remember."""
        encoders, servo = self.chain.encoders, self.chain.servo
        if t < self._t:  # also before the first
            self._motor = self._joint = q
        elif servo is None:
            self._motor = q
        elif t > self._t:
            self._motor = q - lag_behind(self._set_point - self._motor, q - self._set_point, t - self._t, servo.time_s)
        self._t, self._set_point = t, q
        if encoders is None:
            return self._motor
        turning = robot.robot.revolute
        half = 0.5 * np.where(turning, encoders.backlash_rad, encoders.backlash_mm)
        self._joint = np.clip(self._joint, self._motor - half, self._motor + half)  # the play operator
        # By the number of the step, so that a sample has its noise whichever samples were taken before.
        random = np.random.Generator(np.random.Philox(key=self.chain.seed, counter=[0, 0, 0, step]))
        noise = np.where(turning, encoders.noise_rad, encoders.noise_mm) * random.standard_normal(len(q))
        return np.asarray(self._joint + noise)


def lag_behind(before: Array, moved: Array, dt_s: float, time_s: float) -> Array:
    """How far (n,) a first-order lag is behind a set point that moved (n,) straight within ``dt_s``, exactly.

    before: how far it was behind; after long it is moved / dt · time.
    """
    if time_s == 0.0:
        return np.zeros_like(moved)
    kept = math.exp(-dt_s / time_s)
    return np.asarray(kept * before + (1.0 - kept) * (time_s / dt_s) * moved)


def sample_of(snapshot: Any, tool: Tool) -> Sample:
    """The sample of a snapshot of a rigid tool, on a robot or in a free hand."""
    unturned = camera_at(np.eye(3), np.zeros(3), tool)[:3, :3]
    rotation = snapshot.camera[:3, :3] @ unturned.T
    on_robot = isinstance(snapshot, RigidSnapshot)
    force = snapshot.force if on_robot and not snapshot.teleoperated else None
    deflection = snapshot.deflection if on_robot else np.zeros(3)
    return Sample(snapshot.t, snapshot.steps, snapshot.q, snapshot.tip, rotation, force, deflection)
