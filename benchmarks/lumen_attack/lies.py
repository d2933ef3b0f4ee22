"""What the certificate is handed by parts that are not to be trusted: each is replaced by one that lies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.pathway.limits.limits import Configuration
from vfix_engine.snake.conform.conformance import ShapeSolution
from vfix_engine.worlds.snake.snake_drive import SnakeDrive

Random = np.random.Generator


def _wild(random: Random, q: Array, q_max: float) -> Array:
    """Joints that nobody in his senses would ask for."""
    kind = int(random.integers(5))
    if kind == 0:
        return np.asarray(random.uniform(-q_max, q_max, len(q)))
    if kind == 1:
        return np.asarray(q + random.normal(size=len(q)) * 10.0 ** random.uniform(-4.0, 3.0))
    found = np.clip(q + random.normal(size=len(q)) * 10.0 ** random.uniform(-3.0, 0.0), -q_max, q_max)
    if kind == 2 and random.random() < 0.3:
        found[int(random.integers(len(q)))] = random.choice([np.nan, np.inf, 1e300])
    return np.asarray(found)


def control(drive: SnakeDrive, random: Random) -> None:
    """The control of the distal links wants anything."""
    part: Any = drive.control
    part.wanted = lambda q, camera_mm, most: _wild(random, q, drive.snake.q_max)


def conformance(drive: SnakeDrive, random: Random) -> None:
    """The shape that is to conform lies anywhere."""
    part: Any = drive
    ahead, anew = part._waypoint, part._waypoints.at

    def wrong(found: ShapeSolution) -> ShapeSolution:
        base = found.base.copy()
        base[:3, 3] += random.normal(size=3) * 10.0 ** random.uniform(-3.0, 1.0)
        q = np.clip(_wild(random, found.q, drive.snake.q_max), -drive.snake.q_max, drive.snake.q_max)
        return replace(found, q=np.where(np.isfinite(q), q, 0.0), base=base, exact=False)

    def lying_ahead(sign: float) -> tuple[float, ShapeSolution]:
        place, shape = ahead(sign)
        return place, wrong(shape)

    part._waypoint = lying_ahead
    part._waypoints.at = lambda tip_s, near, *most: wrong(anew(tip_s, near, *most))


def easing(drive: SnakeDrive, random: Random) -> None:
    """The program that is to find a way back within the bounds finds something else."""
    part: Any = drive
    honest = part._projected

    def lying(wanted: ShapeSolution, end: Configuration, dt: float) -> tuple[ShapeSolution, Configuration]:
        shape, pose = honest(wanted, end, dt)
        change = random.normal(size=len(pose.q)) * 10.0 ** random.uniform(-5.0, -1.0)
        most = drive.settings.speed_max * dt  # the joints' speed is kept by the program's box, not by the certificate
        q = drive.snake.clamp(np.clip(pose.q + change, drive.q - most, drive.q + most))
        shape = replace(shape, q=drive.snake.clamp(shape.q + (q - pose.q)), exact=False)
        return shape, Configuration(pose.base, q)

    part._projected = lying


LIES: dict[str, Callable[[SnakeDrive, Random], None]] = {
    "control": control,
    "conformance": conformance,
    "easing": easing,
}
