"""A pointer that is not there: touches a place of the image and says where it was measured, with a stated noise."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from app.services.plan_model import Position
from app.services.plan_points import number
from app.services.registration import RegistrationContent
from vfix_engine.errors import InputError

MAX_NOISE_MM = 20.0
DEFAULT_NOISE_MM = 0.3

_FARTHEST_MM = 200.0  # of the simulated tracker from where the image has its origin, along each axis
_WIDEST_RAD = 0.6  # that the head is turned by
Floats = npt.NDArray[np.float64]


def simulated_pose(registration_id: str) -> Floats:
    """How the head lies before the simulated tracker: from the image to the tracker (4, 4), mm.

    The same for every touch of one registration, on every machine; another one for another registration.
    """
    from scipy.spatial.transform import Rotation  # imported here: slow to load

    seed = int.from_bytes(hashlib.sha256(registration_id.encode()).digest()[:8], "big")
    rng = np.random.default_rng(seed)
    axis = rng.standard_normal(3)
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * rng.uniform(0.2, _WIDEST_RAD))
    pose = np.eye(4)
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


def simulated_touch(
    registration_id: str, place: Position, noise_mm: float, seed: Sequence[int] | None = None
) -> Position:
    """Where a place of the image is measured.

    noise_mm: rms length of the error; seed: of the error, None for another one each time.

    Raises InputError for a noise that is negative or beyond MAX_NOISE_MM.
    """
    x, y, z = simulated_touches(registration_id, [place], noise_mm, seed)[0].tolist()
    return x, y, z


def simulated_touches(
    registration_id: str, places: npt.ArrayLike, noise_mm: float, seed: int | Sequence[int] | None = None
) -> Floats:
    """Where places (n, 3) of the image are measured (n, 3), as `simulated_touch` measures one."""
    noise = number(noise_mm, "the pointer's noise")
    if not 0.0 <= noise <= MAX_NOISE_MM:
        raise InputError(f"a noise of {noise:g} mm cannot be simulated; say 0 to {MAX_NOISE_MM:g} mm.")
    pose, at = simulated_pose(registration_id), np.asarray(places, dtype=np.float64)
    off = np.random.default_rng(seed).normal(0.0, noise / np.sqrt(3.0), at.shape)
    touched: Floats = at @ pose[:3, :3].T + pose[:3, 3] + off
    return touched
