"""A patient, a tracker and a robot that are not there: how they stand, and where a simulated pointer touches."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from app.kit.values import Position, number
from app.registration.document import RegistrationContent
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo, inverse

MAX_NOISE_MM = 20.0
DEFAULT_NOISE_MM = 0.3
NOISE_REFUSED = f"a noise of {{:g}} mm cannot be simulated; say 0 to {MAX_NOISE_MM:g} mm."

_FARTHEST_MM = 200.0  # of the simulated tracker from where the image has its origin, along each axis
_WIDEST_RAD = 0.6  # that the head is turned by
# How the head lies before the simulated robot, so that it reaches the shipped head's sample: turned about the head's
# long axis, then tilted towards the robot, in degrees, and shifted in mm.
_TURN_DEG, _TILT_DEG, _BEFORE_ROBOT_MM = 12.9, -26.0, (-16.6, 13.4, 4.3)


def simulated_pose(case_id: str, to: RegisteredTo = "patient") -> Array:
    """How the head of a case lies: from the image to the simulated tracker, or to the robot's base; (4, 4), mm.

    The same for every registration of the case and on every machine; another one before the tracker for another case.
    """
    from scipy.spatial.transform import Rotation  # imported here: slow to load

    pose = np.eye(4)
    if to == "base":
        pose[:3, :3] = Rotation.from_euler("zx", [_TURN_DEG, _TILT_DEG], degrees=True).as_matrix()
        pose[:3, 3] = _BEFORE_ROBOT_MM
        return pose
    rng = np.random.default_rng(int.from_bytes(hashlib.sha256(case_id.encode()).digest()[:8], "big"))
    axis = rng.standard_normal(3)
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * rng.uniform(0.2, _WIDEST_RAD))
    pose[:3, :3] = turn.as_matrix()
    pose[:3, 3] = rng.uniform(-_FARTHEST_MM, _FARTHEST_MM, 3)
    return pose


def check_simulated(content: RegistrationContent) -> None:
    """Whether what was measured for a registration was measured by the simulated pointer, before the same head.

    Raises InputError where some was not, or the transform came from elsewhere: the pointer would touch another head.
    """
    sources = {pair.measured_from for pair in content.pairs if pair.enabled and pair.measured is not None}
    if content.surface is not None and content.made_from == "surface":
        sources.add(content.surface.measured_from)
    if sources - {"simulated"} or content.made_from == "given":
        raise InputError(
            "this registration is not of the head that the simulated pointer touches; practise with one whose points "
            "were all touched by it."
        )


def simulated_tracker_to_base(case_id: str) -> Array:
    """Where the simulated tracker truly stands beside the simulated robot, (4, 4), mm."""
    placed: Array = simulated_pose(case_id, "base") @ inverse(simulated_pose(case_id))
    return placed


def simulated_touch(
    case_id: str,
    place: Position,
    noise_mm: float,
    seed: Sequence[int] | None = None,
    *,
    tracker_to_base: npt.ArrayLike | None = None,
) -> Position:
    """Where a place of the image is measured: in the tracker's frame, or taken from there to the robot's base.

    noise_mm: rms length of the error; seed: of the error, None for another one each time. tracker_to_base: (4, 4), as
    it was calibrated; None leaves the point in the tracker's frame.

    Raises InputError for a noise that is negative or beyond MAX_NOISE_MM.
    """
    x, y, z = simulated_touches(case_id, [place], noise_mm, seed, tracker_to_base=tracker_to_base)[0].tolist()
    return x, y, z


def simulated_touches(
    case_id: str,
    places: npt.ArrayLike,
    noise_mm: float,
    seed: int | Sequence[int] | None = None,
    *,
    tracker_to_base: npt.ArrayLike | None = None,
) -> Array:
    """Where places (n, 3) of the image are measured (n, 3), as `simulated_touch` measures one."""
    noise = checked_noise(noise_mm)
    pose, at = simulated_pose(case_id), np.asarray(places, dtype=np.float64)
    off = np.random.default_rng(seed).normal(0.0, noise / np.sqrt(3.0), at.shape)
    touched: Array = at @ pose[:3, :3].T + pose[:3, 3] + off
    if tracker_to_base is None:
        return touched
    matrix = np.asarray(tracker_to_base, dtype=np.float64)
    placed: Array = touched @ matrix[:3, :3].T + matrix[:3, 3]
    return placed


def checked_noise(noise_mm: float) -> float:
    """A noise that can be simulated. Raises InputError."""
    noise = number(noise_mm, "the pointer's noise")
    if not 0.0 <= noise <= MAX_NOISE_MM:
        raise InputError(NOISE_REFUSED.format(noise))
    return noise
