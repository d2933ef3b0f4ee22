"""The volume that a plan lays over its head: an MR or another CT, where it lies, and how much of it is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.kit.values import check_id, number
from vfix_engine.errors import PlanError

IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_RIGID = 1e-3  # what rotation and last row may be off
_FARTHEST_MM = 1e4  # of its shift
_WIDEST = 1e6  # of a window, in the values of the volume


@dataclass(frozen=True)
class SecondVolume:
    """A volume that is drawn over the slices of the head.

    case: id of the case that it belongs to, the plan's own or another one. volume: its name there; None: the widest CT.
    transform: 16 numbers row by row, from the second volume's LPS to the head's, mm; rigid.
    opacity: from 0 to 1. window, level: its values from black to white, and the value in their middle.
    other_head: somebody confirmed that this volume, of another case, shows the same patient (HAZ-38).
    """

    case: str
    volume: str | None = None
    transform: tuple[float, ...] = IDENTITY
    opacity: float = 0.5
    window: float = 2500.0
    level: float = 600.0
    other_head: bool = False


def check_second(second: SecondVolume | None) -> SecondVolume | None:
    """The volume, checked. Raises PlanError."""
    if second is None:
        return None
    check_id(second.case, "a case")
    if second.volume is not None:
        check_id(second.volume, "a volume")
    if not isinstance(second.transform, (list, tuple)) or len(second.transform) != 16:
        raise PlanError("the transform of a second volume has 16 numbers, row by row.")
    transform = tuple(number(value, "the second volume's transform") for value in second.transform)
    matrix = np.array(transform).reshape(4, 4)
    turned = matrix[:3, :3]
    if np.abs(turned.T @ turned - np.eye(3)).max() > _RIGID or np.abs(matrix[3] - [0, 0, 0, 1]).max() > _RIGID:
        raise PlanError("the transform of a second volume must be rigid: a rotation without scale or shear, and mm.")
    if np.linalg.det(turned) < 0.0:  # a reflection is orthonormal too, and would exchange left and right
        raise PlanError("the transform of a second volume mirrors it: left would be drawn as right. Check its axes.")
    if np.abs(matrix[:3, 3]).max() > _FARTHEST_MM:
        raise PlanError(f"the transform of a second volume shifts it beyond {_FARTHEST_MM:g} mm; check the unit.")
    opacity, window, level = (number(getattr(second, name), f"the {name}") for name in ("opacity", "window", "level"))
    if not 0.0 <= opacity <= 1.0:
        raise PlanError(f"a second volume's opacity is from 0 to 1, not {opacity:g}.")
    if not 0.0 < window <= _WIDEST or abs(level) > _WIDEST:
        raise PlanError("a second volume needs a positive window and a sensible level.")
    if not isinstance(second.other_head, bool):
        raise PlanError("other_head of a second volume is true or false.")
    return SecondVolume(second.case, second.volume, transform, opacity, window, level, second.other_head)
