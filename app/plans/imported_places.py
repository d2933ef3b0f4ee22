"""What is doubtful about places that come out of a file: whether their unit is right, and whether they are at the head.

A file in metres that says mm, or that is taken for one, puts a whole path into a fraction of a millimetre.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from app.kit.values import Position
from app.plans.model import PlanContent, PlanPoint
from vfix_engine.arrays import Array

_TINY_PATH_MM = 5.0  # between the first and the last of any points on a way into a head
_TINY_FIDUCIALS_MM = 5.0  # between points at a patient that a registration is made of
_TINY_TARGETS_MM = 0.5  # two targets may lie close together
_METRES_MM = 2.5  # what is smaller is plausible when it is read in metres, up to a whole body


def content_notes(content: PlanContent, bounds: npt.ArrayLike) -> tuple[str, ...]:
    """What is doubtful about the paths and targets of a plan beside the box (2, 3) LPS mm around the anatomy."""
    paths = [note for path in content.paths for note in path_notes(path.points, bounds)]
    return (*dict.fromkeys(paths), *target_notes(content.targets))


def target_notes(points: Sequence[PlanPoint]) -> tuple[str, ...]:
    """What is doubtful about the size of a set of targets."""
    return _tiny(_places(points), _TINY_TARGETS_MM, "The targets", "closer together than targets are")


def path_notes(points: Sequence[PlanPoint], bounds: npt.ArrayLike) -> tuple[str, ...]:
    """What is doubtful about a path beside the box (2, 3) LPS mm around the anatomy: its place, and its size."""
    places = _places(points)
    tiny = _tiny(places, _TINY_PATH_MM, "The points of the path", "which is no way into a head")
    return (*_outside(places, bounds), *tiny)


def measured_notes(points: Sequence[Position]) -> tuple[str, ...]:
    """What is doubtful about the size of a set of measured points, mm."""
    return _tiny(
        np.array(points).reshape(-1, 3), _TINY_FIDUCIALS_MM, "The measured points", "too close for a registration"
    )


def _places(points: Sequence[PlanPoint]) -> Array:
    return np.array([point.position for point in points]).reshape(-1, 3)


def _tiny(places: Array, least_mm: float, what: str, why: str) -> tuple[str, ...]:
    extent = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) > 1 else least_mm
    if extent >= least_mm:
        return ()
    metres = " Is the file in metres?" if 0.0 < extent <= _METRES_MM else ""
    return (f"{what} lie within {extent:.2g} mm, {why}.{metres} Check the unit.",)


def _outside(places: Array, bounds: npt.ArrayLike) -> tuple[str, ...]:
    low, high = np.asarray(bounds, dtype=np.float64)
    away = np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0.0), axis=1)
    if len(away) == 0 or away.min() == 0.0:
        return ()
    box = ", ".join(f"{axis} {a:.0f} to {b:.0f}" for axis, a, b in zip("xyz", low, high, strict=True))
    return (
        f"The path lies outside the head, {away.min():.0f} mm or more away. Check the frame and the unit of both; "
        f"the box around the bone is {box} mm (LPS).",
    )
