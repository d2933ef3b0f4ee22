"""A drag and a wheel in a camera's picture: places that the robot makes up for while the hand holds.

What a robot carries out of a command depends on its limits and on a machine that skips control periods. So both are
positions and no speeds: each step commands what is left of a drag's way, of which it counts what the robot has made, or
of the depth that the wheel wants.
"""

from __future__ import annotations

import math
from typing import NamedTuple

ARRIVED_MM = 1e-3  # of the way: much less than a pixel

Way = tuple[float, float]  # mm, to the right and down in the picture


class DrivenCamera(NamedTuple):
    """A camera that axes move across its picture and along the lumen.

    obeyed_mm: what the robot has carried out of the hand's commands, summed since the start; motions that were not
        commanded, such as an insertion, are none of it. step_mm: by which a full axis moves it in one control period.
    depth_mm: of the tip along the lumen. insertion_step_mm: by which a full axis inserts it in one control period.
    """

    obeyed_mm: Way
    step_mm: float
    depth_mm: float = 0.0
    insertion_step_mm: float = 0.0


def own_part(moved: Way, commanded: Way, others: Way) -> Way:
    """What of a motion is due to one of two commands that were added.

    commanded: their sum; others: the second command. Both are carried out to the same share.
    """
    length = commanded[0] ** 2 + commanded[1] ** 2
    if length == 0.0:
        return moved
    share = min(max((moved[0] * commanded[0] + moved[1] * commanded[1]) / length, 0.0), 1.0)
    return moved[0] - share * others[0], moved[1] - share * others[1]


class CameraDrag:
    """What is left of the newest drag; used by the control loop alone."""

    def __init__(self) -> None:
        self._number = 0
        self._gone: Way = (0.0, 0.0)
        self._obeyed: Way | None = None  # of the camera at the last step of this drag
        self._commanded: Way = (0.0, 0.0)
        self._others: Way = (0.0, 0.0)

    def axes(self, camera: DrivenCamera, others: Way, drag: int, wanted: Way, share: float) -> Way:
        """Axes of the camera in the next step, from -1 to +1.

        Args:
            others: axes of what else moves the camera, to which those of the drag are added.
            drag: number of the drag; wanted: its way so far. share: of the hand's hold, 0 where nobody drags.
        """
        if drag != self._number:
            self._number, self._gone = drag, (0.0, 0.0)
        elif self._obeyed is not None:
            moved = camera.obeyed_mm[0] - self._obeyed[0], camera.obeyed_mm[1] - self._obeyed[1]
            right, down = own_part(moved, self._commanded, self._others)
            self._gone = self._gone[0] + right, self._gone[1] + down
        own = self._left(wanted, camera.step_mm, share) if share > 0.0 else (0.0, 0.0)
        x, y = _axis(others[0] + own[0]), _axis(others[1] + own[1])
        self._obeyed = camera.obeyed_mm
        self._commanded = x * camera.step_mm, y * camera.step_mm
        self._others = others[0] * camera.step_mm, others[1] * camera.step_mm
        return x, y

    def forget(self, drag: int, wanted: Way) -> None:
        """What is left of a drag's way so far moves nothing any more."""
        self._number, self._gone, self._obeyed = drag, wanted, None

    def _left(self, wanted: Way, step_mm: float, share: float) -> Way:
        """Axes that go the rest of the way in one step, or as far as a full axis does."""
        right, down = wanted[0] - self._gone[0], wanted[1] - self._gone[1]
        way = math.hypot(right, down)
        if way < ARRIVED_MM:
            return 0.0, 0.0
        scale = share / max(way, step_mm)
        return scale * right, scale * down


class WheelDepth:
    """The depth that a wheel wants the tip at, until something else inserts; used by the control loop alone."""

    def __init__(self) -> None:
        self._given_up = 0

    def axis(self, camera: DrivenCamera, insert: float, number: int, wanted_mm: float, share: float) -> float:
        """Axis of the insertion in the next step, from -1 to +1.

        Args:
            insert: axis of what else inserts; for it the depth is given up.
            number: of the depth; wanted_mm: the depth. share: of the wheel's hold, 0 where nobody turns it.
        """
        if insert:
            self.forget(number)
        if number == self._given_up or share == 0.0 or camera.insertion_step_mm == 0.0:
            return insert
        left = wanted_mm - camera.depth_mm
        return 0.0 if abs(left) < ARRIVED_MM else share * _axis(left / camera.insertion_step_mm)

    def forget(self, number: int) -> None:
        """The depth moves nothing any more; the next one does."""
        self._given_up = number


def _axis(value: float) -> float:
    return min(max(value, -1.0), 1.0)
