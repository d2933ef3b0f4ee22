"""Beads, targets and noise that the tests of registration share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

BEADS = np.array([(8.2, 4.9, 71.8), (51.5, 13.7, 20.6), (72.7, 77.1, 20.4), (-73.5, 73.3, 10.4), (-9.9, -7.6, -63.2)])
TARGETS = np.array([(9.2, 32.4, 19.4), (4.2, 52.0, 27.4), (2.0, 74.7, -4.7)])


def some_pose(seed: int, reach_mm: float = 200.0) -> Array:
    """A random rigid transform (4, 4)."""
    random = np.random.default_rng(seed)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=random).as_matrix()
    pose[:3, 3] = random.uniform(-reach_mm, reach_mm, 3)
    return pose


def placed(transform: Array, points: Array) -> Array:
    """Points (n, 3) moved by a rigid transform."""
    return points @ transform[:3, :3].T + transform[:3, 3]
