"""What a hand can do with the control bends of one place: poses on the surface Q(r, ϑ), and ways between them.

A hand that moves the camera in its picture (28) follows a way in (u, v) only while the camera's Jacobian keeps its
sign: at a fold two bends have the camera at one place, and no command leads from one side to the other.
So a way is sought among bends that are within their bounds, on this side of every fold, and reached from the rest.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ...arrays import Array, BoolArray
from ...snake.control.parameterised import ParameterisedControl
from ...snake.control.tip_control import DistalContext
from ...worlds.snake.offline.script import ScriptSystem
from ...worlds.snake.stepping.distal import distal_context, ready_to_look

MARGIN_MM = 0.15  # that a bend of a way is within its bounds: the certificate of a motion needs some
RANK_MM = 3.0  # least singular value of the Jacobian, mm per unit of r: below it the camera hardly moves
NODES = 73  # across the disc of bends
_NEIGHBOURS = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))

Steering = tuple[float, float]


class BendPose(NamedTuple):
    """A bend: joints (2L',) rad and camera (4, 4); the least distance of a link to its bound in mm, negative beyond."""

    q: Array
    camera: Array
    inside_mm: float


class BendMap:
    """Bends of a robot on a fixed base, on a grid of (u, v) with |(u, v)| ≤ r_max.

    Args:
        system: of a drive under the paper's parameterised control, at its start.

    Attributes:
        at: (n,) values of u and of v. camera: (n, n, 4, 4). free: (n, n) bends to which a way from rest leads.
    """

    def __init__(self, system: ScriptSystem) -> None:
        state = ready_to_look(system.constants, system.start())
        if not isinstance(state.control, ParameterisedControl):
            raise TypeError("a map of bends is of the parameterised control")
        self.context: DistalContext = distal_context(system.constants, state)
        self.r_max = state.settings.r_max
        self._control = state.control.copy()
        self.at: Array = np.linspace(-self.r_max, self.r_max, NODES)
        self.camera = np.zeros((NODES, NODES, 4, 4))
        good = np.zeros((NODES, NODES), dtype=bool)
        for i, j in np.argwhere(np.hypot(*np.meshgrid(self.at, self.at, indexing="ij")) <= self.r_max):
            place = (float(self.at[i]), float(self.at[j]))
            pose = self.pose(place)
            self.camera[i, j] = pose.camera
            good[i, j] = pose.inside_mm >= MARGIN_MM and self.steers(place)
        middle = NODES // 2
        good[middle, middle] = True
        pieces = ndimage.label(good)[0]
        self.free: BoolArray = pieces == pieces[middle, middle]

    def pose(self, steering: Steering) -> BendPose:
        """The pose of a bend."""
        q, context = self.joints(steering), self.context
        frames = context.snake.frames(q, context.base)
        depth = context.query.deviations(context.packed, frames, context.window).depth
        camera = frames[-1].copy()
        camera[:3, 3] += context.snake.camera_offset_mm * camera[:3, 2]
        return BendPose(q, camera, float((context.bound - depth).min()))

    def joints(self, steering: Steering) -> Array:
        """(2L',) rad of a bend."""
        self._control.steering = steering
        return self._control.shape()

    def view(self, steering: Steering) -> Array:
        """The camera (4, 4) at a bend."""
        return self.context.snake.camera(self.joints(steering), self.context.base)

    def steers(self, steering: Steering) -> bool:
        """Whether commands move the camera well at a bend, and it is on this side of every fold."""
        if math.hypot(*steering) < 0.05:  # at the rest itself every direction has its own slope
            return True
        self._control.steering = steering
        jacobian = self._control.camera_per_steering()
        return float(np.linalg.det(jacobian)) > 0.0 and float(np.linalg.svd(jacobian)[1][1]) >= RANK_MM

    def usable(self, steering: Steering) -> bool:
        """Whether a way may go through a bend."""
        if math.hypot(*steering) > self.r_max:
            return False
        return self.pose(steering).inside_mm >= MARGIN_MM and self.steers(steering)

    def is_free(self, steering: Steering) -> bool:
        """Whether the node nearest to a bend is reached from rest."""
        return bool(self.free[self._node(steering)])

    def way(self, start: Steering, end: Steering) -> list[Steering] | None:
        """The shortest way for the camera from one bend to another through free nodes; None where there is none.

        By Dijkstra's algorithm, a step costs the camera's travel in mm.
        """
        first, last = self._node(start), self._node(end)
        cost, before = {first: 0.0}, dict[tuple[int, int], tuple[int, int]]()
        queue: list[tuple[float, tuple[int, int]]] = [(0.0, first)]
        done = set[tuple[int, int]]()
        while queue:
            here_cost, here = heapq.heappop(queue)
            if here in done:
                continue
            done.add(here)
            if here == last:
                nodes = [last]
                while nodes[-1] != first:
                    nodes.append(before[nodes[-1]])
                inner = [(float(self.at[i]), float(self.at[j])) for i, j in reversed(nodes)][1:-1]
                return [start, *inner, end]
            for step in _NEIGHBOURS:
                near = (here[0] + step[0], here[1] + step[1])
                if not (0 <= near[0] < NODES and 0 <= near[1] < NODES and self.free[near]):
                    continue
                travel = float(np.linalg.norm(self.camera[near][:3, 3] - self.camera[here][:3, 3]))
                if here_cost + travel < cost.get(near, math.inf):
                    cost[near], before[near] = here_cost + travel, here
                    heapq.heappush(queue, (here_cost + travel, near))
        return None

    def _node(self, steering: Steering) -> tuple[int, int]:
        """The node nearest to a bend."""
        share = (np.array(steering) / self.r_max + 1.0) * 0.5 * (NODES - 1)
        i, j = np.clip(np.rint(share), 0, NODES - 1).astype(int).tolist()
        return i, j
