"""Inspection of a target: directions of the shaft in which the tool is clear of bone with its tip on the target.

Directions are spread evenly over the sphere, with rolls about the shaft for a bent tool. Each tested pose is
measured exactly. Only poses that can be reached by rotation about the target are tested, beginning with the path's own:
a free direction on the other side of a bone cannot be reached.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array, IndexArray
from ...proximity.proximity import Proximity
from ...robots import Tool
from ...validate import point, rotation_matrix

DIRECTIONS, ROLLS = 2000, 12  # 4.5 and 30 degrees apart
_BESIDE = 6  # neighbours of a direction
_BEGIN_DEG = 25.0  # the search begins with every pose this near to the path's own, which is between them


@dataclass(frozen=True, eq=False)
class InspectionCone:
    """Directions of the shaft, unit vectors (m, 3) from the grip to the tip, in which a target can be inspected.

    rolls (m,): number of the tool's rolls. asked: number of measured poses.
    """

    directions: Array
    rolls: NDArray[np.int64]
    asked: int

    @property
    def solid_angle_sr(self) -> float:
        """Solid angle of all directions, in steradian."""
        return 4.0 * np.pi * len(self.directions) / DIRECTIONS

    @property
    def cone_deg(self) -> float:
        """Full opening angle of the round cone of that solid angle, in degrees; 0 where there is no direction."""
        return float(2.0 * np.degrees(np.arccos(1.0 - self.solid_angle_sr / (2.0 * np.pi))))


def inspection_cone(
    anatomy: Proximity, tool: Tool, target: ArrayLike, margin_mm: float, rotation: ArrayLike
) -> InspectionCone:
    """The directions in which a tool can have its tip on a target, reachable by rotation from a pose.

    Args:
        target: (3,) LPS mm. margin_mm: clearance of the whole tool, except at the target itself: where the target
            is nearer to the anatomy than radius and margin, the margin is reduced accordingly.
        rotation: (3, 3) of the tool's tip frame at the start, such as at the end of the path.

    Raises:
        InputError: an invalid target or rotation.
    """
    place, first = point("the target", target), rotation_matrix(rotation, "the tool's rotation")
    bent = any(part.bend > 0.0 for part in tool.parts)
    frames, beside, turned = _sphere(ROLLS if bent else 1)
    needed = min(margin_mm, float(anatomy.point_distance([place])[0][0]) - float(tool.radius[0]))
    free = np.full(frames.shape[:2], -1, np.int8)

    def is_free(direction: int, roll: int) -> bool:
        if free[direction, roll] < 0:
            segments = tool.segments(frames[direction, roll], place)
            free[direction, roll] = anatomy.clearance(segments, needed + 1.0) >= needed - 1e-9
        return bool(free[direction, roll])

    # The cosine of the angle between the frames, or between the shafts of a straight tool.
    trace = np.einsum("drij,ij->dr", frames, first)
    alike = 0.5 * (trace - 1.0) if bent else frames[..., 1] @ first[:, 1]
    begin = np.argwhere(alike >= np.cos(np.radians(_BEGIN_DEG)))
    waiting = [(int(d), int(r)) for d, r in begin if is_free(int(d), int(r))]
    reached = set(waiting)
    rolls = frames.shape[1]
    while waiting:
        direction, roll = waiting.pop()
        around = [(direction, (roll + step) % rolls) for step in (-1, 1)] if rolls > 1 else []
        around += [
            (int(other), (roll + int(turn)) % rolls)
            for other, turn in zip(beside[direction], turned[direction], strict=True)
        ]
        for pose in around:
            if pose not in reached and is_free(*pose):
                reached.add(pose)
                waiting.append(pose)
    count = np.bincount([direction for direction, _ in reached], minlength=len(frames))
    found = np.flatnonzero(count)
    return InspectionCone(frames[found, 0, :, 1], count[found], int((free >= 0).sum()))


def spread_directions() -> Array:
    """The tested directions: unit vectors (DIRECTIONS, 3), evenly over the sphere along a golden spiral."""
    number = np.arange(DIRECTIONS) + 0.5
    polar, around = np.arccos(1.0 - 2.0 * number / DIRECTIONS), np.pi * (1.0 + np.sqrt(5.0)) * number
    return np.column_stack([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)])


@lru_cache(maxsize=2)
def _sphere(rolls: int) -> tuple[Array, IndexArray, IndexArray]:
    """Rotations (D, rolls, 3, 3) with the shaft +y in each direction; neighbours (D, 6) of each direction, and by
    how many rolls (D, 6) the neighbour's frame is rotated against its own.
    """
    from scipy.spatial import cKDTree  # imported here: slow to load

    y = spread_directions()
    x = np.cross(y, np.where(np.abs(y[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]))
    x /= np.linalg.norm(x, axis=1)[:, None]
    z = np.cross(x, y)
    angle = (2.0 * np.pi / rolls) * np.arange(rolls)
    cos, sin = np.cos(angle)[None, :, None], np.sin(angle)[None, :, None]
    rolled_x, rolled_z = cos * x[:, None] - sin * z[:, None], sin * x[:, None] + cos * z[:, None]
    frames = np.stack([rolled_x, np.broadcast_to(y[:, None], rolled_x.shape), rolled_z], axis=-1)
    beside = cKDTree(y).query(y, k=_BESIDE + 1)[1][:, 1:]
    # The roll of the neighbour whose x is nearest to this direction's.
    along = np.einsum("nj,nkrj->nkr", x, frames[beside][..., 0])
    return frames, beside, along.argmax(axis=2)
