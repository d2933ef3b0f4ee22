"""Contents of registrations for tests: the beads of the shipped head, measured at a patient who lies somewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from app.registration.document import FiducialPair, RegistrationContent
from app.registration.fit_report import refitted
from vfix_engine.anatomy.phantom import load_landmarks

BEADS = [tuple(bead.centroid.tolist()) for bead in load_landmarks().beads]
NAMES = [bead.name for bead in load_landmarks().beads]


def pose() -> np.ndarray:
    """How the head lies in these tests, from the image to the patient."""
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_euler("xyz", [20.0, -15.0, 40.0], degrees=True).as_matrix()
    transform[:3, 3] = [120.0, -30.0, 55.0]
    return transform


def measured(places: list[tuple[float, ...]], sigma: float = 0.0, seed: int = 1) -> list[tuple[float, float, float]]:
    at = np.array(places) @ pose()[:3, :3].T + pose()[:3, 3]
    noisy = at + np.random.default_rng(seed).normal(0.0, sigma, at.shape)
    return [(x, y, z) for x, y, z in noisy.tolist()]


def pairs_of(places: list[Any], points: list[Any]) -> tuple[FiducialPair, ...]:
    rows = enumerate(zip(places, points, strict=True))
    return tuple(FiducialPair(f"F{i}", place, point, f"pair-{i}") for i, (place, point) in rows)


def content_of(sigma: float = 0.0, count: int = 5, seed: int = 1) -> RegistrationContent:
    points = measured(BEADS, sigma, seed)
    pairs = [
        FiducialPair(NAMES[i], BEADS[i], points[i], f"pair-{i}")  # type: ignore[arg-type]
        for i in range(count)
    ]
    return refitted(RegistrationContent(pairs=tuple(pairs)))
