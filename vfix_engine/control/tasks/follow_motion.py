"""A motion from outside, such as of a vision sensor or another program (Li 2004, III, step 1c; Li 2007, III.C)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...geometry.rotations import rotation_vector
from ...validate import real_array
from ...virtual_fixtures import StepState, stoppable_step
from ..context import context_of
from ..step_request import HandCommand, StepRequest
from .move_freely import MoveFreely

_FREELY = MoveFreely()


@dataclass(frozen=True, eq=False)
class DesiredMotion:
    """A desired velocity of the tip in the patient frame: ``velocity`` (3,) in mm/s, ``turn`` (3,) in rad/s.

    Raises:
        InputError: one of them is not three finite numbers.
    """

    velocity: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for name, unit in (("velocity", "mm/s"), ("turn", "rad/s")):
            vector = real_array(f"the {name}", getattr(self, name))
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise InputError(f"the {name} is {vector.tolist()!r:.60}; it is three finite numbers in {unit}")
            object.__setattr__(self, name, vector)


@dataclass(frozen=True, eq=False)
class DesiredPose:
    """A desired pose of the tip, and the speeds with which it is approached.

    transform_tip_to_patient: (4, 4) rigid, mm.

    Raises:
        InputError: the transform is not rigid, or a speed is not a finite number above 0.
    """

    transform_tip_to_patient: Array
    speed_mm_per_s: float = 10.0
    turn_rad_per_s: float = 0.5

    def __post_init__(self) -> None:
        pose = real_array("the pose", self.transform_tip_to_patient)
        turn = pose[:3, :3] if pose.shape == (4, 4) else np.zeros((3, 3))
        rigid = np.abs(turn @ turn.T - np.eye(3)).max() < 1e-6 and np.linalg.det(turn) > 0.0
        if not (rigid and np.isfinite(pose).all() and np.abs(pose[3] - [0.0, 0.0, 0.0, 1.0]).max() < 1e-9):
            raise InputError("the pose of the tip is a rigid transform of 4 x 4 finite numbers, in mm")
        for speed in (self.speed_mm_per_s, self.turn_rad_per_s):
            if not 0.0 < speed < np.inf:
                raise InputError(f"a speed towards a pose is {speed!r:.40}; it is a finite number above 0")
        object.__setattr__(self, "transform_tip_to_patient", pose)


@dataclass(frozen=True)
class FollowMotion:
    """The tip moves as it is told from outside, as far as fixtures and the certificate allow; no hand is needed.

    Its command is a ``DesiredMotion`` or a ``DesiredPose``. Rows and bounds of speed and acceleration are those of free
    motion (``MoveFreely``), with the velocity in place of the hand's; towards a pose the tip can stop in time.
    """

    def request(self, state: StepState, command: DesiredMotion | DesiredPose) -> StepRequest:
        """Return six objective rows in mm. Raises InputError for a command of another type."""
        settings = context_of(state).settings
        if isinstance(command, DesiredMotion):
            velocity, turn = command.velocity, command.turn
        elif isinstance(command, DesiredPose):
            pose, tip, dt = command.transform_tip_to_patient, state.tip, settings.dt_s
            slowing = settings.acceleration_mm_per_s2 * dt * dt, settings.turn_acceleration_rad_per_s2 * dt * dt
            velocity = _towards(pose[:3, 3] - tip.position, command.speed_mm_per_s, slowing[0], dt)
            turn = _towards(rotation_vector(pose[:3, :3] @ tip.rotation.T), command.turn_rad_per_s, slowing[1], dt)
        else:
            raise InputError(f"FollowMotion is driven by a DesiredMotion or a DesiredPose, not by {command!r:.60}")
        force = velocity / settings.gain_mm_per_s_per_n
        return _FREELY.request(state, HandCommand(force, turn / settings.rotation_gain_rad_per_s_per_nmm))


def _towards(way: Array, fastest: float, change: float, dt: float) -> Array:
    """Velocity (3,) along the remaining ``way`` (3,) from which the motion can stop at its end."""
    size = float(np.linalg.norm(way))
    if size == 0.0:
        return np.zeros(3)
    velocity: Array = way * (min(fastest, stoppable_step(size, change) / dt) / size)
    return velocity
