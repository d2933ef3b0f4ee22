"""Tables of poses of a simulated tracker, for the tests of calibrations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from vfix_engine.registration import SimulatedTracker

Floats = npt.NDArray[np.float64]
TRACKER_TO_BASE = np.eye(4)
TRACKER_TO_BASE[:3, :3] = Rotation.from_euler("zyx", [70.0, -20.0, 35.0], degrees=True).as_matrix()
TRACKER_TO_BASE[:3, 3] = [900.0, -200.0, 400.0]
MARKER_TO_FLANGE = np.eye(4)
MARKER_TO_FLANGE[:3, 3] = [10.0, 25.0, 40.0]


def table(poses: Floats, kind: str, *, unit: str = "mm", numbers: list[int] | None = None) -> bytes:
    """The table that `read_poses` takes."""
    scale = {"mm": 1.0, "m": 1e-3}[unit]
    rows = [f"# unit={unit}\n# pose={kind}\n", "number," if numbers else "", "x,y,z,qx,qy,qz,qw\n"]
    for at, pose in enumerate(poses):
        values = [*(scale * pose[:3, 3]).tolist(), *Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()]
        rows.append((f"{numbers[at]}," if numbers else "") + ",".join(map(repr, values)) + "\n")
    return "".join(rows).encode()


def swung(sigma_mm: float = 0.05, seed: int = 1) -> Floats:
    """Poses of a pointer that was swung about its tip."""
    return SimulatedTracker(seed, sigma_mm=sigma_mm).pivot([10.0, -20.0, 900.0], 40)


def paired_poses(count: int = 20, sigma_mm: float = 0.05, seed: int = 2) -> tuple[Floats, Floats]:
    """Poses of a robot's flange, and of the marker on it as tracked."""
    random, tracker = np.random.default_rng(seed), SimulatedTracker(seed, sigma_mm=sigma_mm)
    robot = np.tile(np.eye(4), (count, 1, 1))
    robot[:, :3, :3] = Rotation.from_rotvec(random.uniform(-0.6, 0.6, (count, 3))).as_matrix()
    robot[:, :3, 3] = np.array([500.0, 0.0, 300.0]) + random.uniform(-100.0, 100.0, (count, 3))
    away = np.linalg.inv(TRACKER_TO_BASE)
    return robot, np.array([tracker.measured(away @ pose @ MARKER_TO_FLANGE) for pose in robot])
