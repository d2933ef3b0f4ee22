"""Whether a label's whole line can be traced, and by which bends: the preimage of the line on the surface of bends."""

from __future__ import annotations

import math

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from .bend_map import BendMap, Steering
from .labels import HALF_MM, Label, axis_on_plane

STEP_MM, BEYOND_MM = 0.5, 0.5  # between two bends along the line, and how far it goes on behind the arrow's tip
STEEPEST_DEG = 60.0  # between the optical axis and the label's normal
NEAREST_MM, FARTHEST_MM = 10.0, 90.0  # from the camera to a point of the line
_FROM_MM = 8.0  # of a node's marker from the line's start, for a search from there
_STARTS, _APART = 6, 0.15  # searches, and how far apart in (u, v) they start
_JUMP = 0.12  # in (u, v) between two bends along the line: a larger one is no continuation
_ROUNDS, _NEAR_MM, _DIFFERENCE = 12, 0.02, 1e-4  # of Newton's method
_LINK_MM = 1.0  # that the line of sight keeps from the robot's own links


class Tracer:
    """Finds bends that trace lines, with a free line of sight past organs and the robot itself.

    Args:
        bends: of the robot; wall: of the cavity.
    """

    def __init__(self, bends: BendMap, wall: Wall) -> None:
        self.bends, self._wall = bends, wall

    def trace(self, label: Label) -> list[Steering] | None:
        """Bends whose marker goes along the arrow from its tail to behind its tip; None where there are none.

        All are within the bounds, reached from rest, and see the label at 60° to its normal at most.
        """
        for start in self._starts(label):
            found = self._traced(label, start)
            if found is not None and self._seen(label, found):
                return found
        return None

    def _starts(self, label: Label) -> list[Steering]:
        """Free nodes whose marker is near the arrow's tail, the nearest first."""
        bends = self.bends
        nodes = np.argwhere(bends.free)
        cameras = bends.camera[bends.free]
        eye, ahead = cameras[:, :3, 3], cameras[:, :3, 2]
        facing = ahead @ label.normal
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = ((label.centre - eye) @ label.normal) / facing
        met = eye + distance[:, None] * ahead - label.at(-HALF_MM)
        away = np.where((facing < -0.05) & (distance > 0.0), np.linalg.norm(met, axis=1), np.inf)
        found: list[Steering] = []
        for number in np.argsort(away, kind="stable"):
            if away[number] > _FROM_MM or len(found) == _STARTS:
                break
            i, j = nodes[number]
            place = (float(bends.at[i]), float(bends.at[j]))
            if all(math.dist(place, other) > _APART for other in found):
                found.append(place)
        return found

    def _traced(self, label: Label, start: Steering) -> list[Steering] | None:
        """Along the line from its tail, each bend by Newton's method from the one before."""
        found: list[Steering] = []
        count = round((2.0 * HALF_MM + BEYOND_MM) / STEP_MM)
        for step in range(count + 1):
            here = self._aimed(label, -HALF_MM + step * STEP_MM, found[-1] if found else start)
            if here is None or (found and math.dist(here, found[-1]) > _JUMP) or not self._usable(label, here):
                return None
            found.append(here)
        return found if self.bends.is_free(found[0]) and self.bends.is_free(found[-1]) else None

    def _aimed(self, label: Label, along_mm: float, start: Steering) -> Steering | None:
        """The bend whose marker is at a place of the arrow, near another bend."""
        place = np.array(start)
        for _ in range(_ROUNDS):
            here = self._marker(label, place)
            if here is None:
                return None
            error = here - (along_mm, 0.0)
            if float(np.hypot(*error)) < _NEAR_MM:
                return float(place[0]), float(place[1])
            columns = []
            for axis in np.eye(2):
                moved = self._marker(label, place + _DIFFERENCE * axis)
                if moved is None:
                    return None
                columns.append((moved - here) / _DIFFERENCE)
            jacobian = np.column_stack(columns)
            if abs(float(np.linalg.det(jacobian))) < 1e-6:
                return None
            move = np.linalg.solve(jacobian, error)
            place = place - move * min(1.0, 0.1 / max(float(np.hypot(*move)), 1e-12))
            if float(np.hypot(*place)) > self.bends.r_max:
                return None
        return None

    def _marker(self, label: Label, place: Array) -> Array | None:
        found = axis_on_plane(label, self.bends.view((float(place[0]), float(place[1]))))
        return None if found is None else np.array([found.along, found.across])

    def _usable(self, label: Label, steering: Steering) -> bool:
        if not self.bends.usable(steering):
            return False
        camera = self.bends.view(steering)
        marker = axis_on_plane(label, camera)
        steep = -float(label.normal @ camera[:3, 2]) < math.cos(math.radians(STEEPEST_DEG))
        return marker is not None and not steep and NEAREST_MM <= marker.distance <= FARTHEST_MM

    def _seen(self, label: Label, line: list[Steering]) -> bool:
        """Whether nothing is between the camera and the marker, all along the line."""
        for steering in line[::4]:
            frames = self.bends.context.snake.frames(self.bends.joints(steering), self.bends.context.base)
            camera = self.bends.view(steering)
            marker, eye = axis_on_plane(label, camera), camera[:3, 3]
            if marker is None:
                return False
            point = label.at(marker.along, marker.across)
            if not self._wall.free(eye, point):
                return False
            snake = self.bends.context.snake
            for one, two in zip(frames[:-2, :3, 3], frames[1:-1, :3, 3], strict=True):
                if _between(eye, point, one, two) < snake.sphere_mm + _LINK_MM:
                    return False
        return True


def _between(a: Array, b: Array, c: Array, d: Array) -> float:
    """Least distance between the segments ab and cd (3,), mm, to a hundredth of their lengths."""
    share = np.linspace(0.0, 1.0, 101)
    points = a + share[:, None] * (b - a)
    along = d - c
    t = np.clip((points - c) @ along / (along @ along), 0.0, 1.0)
    return float(np.linalg.norm(points - c - t[:, None] * along, axis=1).min())
