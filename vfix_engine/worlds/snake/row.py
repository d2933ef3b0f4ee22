"""The row of numbers that is recorded of every step of a snake."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...robots.snake import SnakeModel
from ...robots.snake_kernel import snake_frames
from ...runtime.system import Column
from .stepping.state import SnakeState

OUTCOMES = {"rest": "idle", "moved": "moved", "shrunk": "shrunk", "held": "held"}
_CODES = {name: float(code) for code, name in enumerate(OUTCOMES)}


class SnakeRow:
    """Writes rows of one snake; ``layout``: names and units. outcome: 0 idle, 1 moved, 2 shrunk, 3 held.

    outside_linkN: depth of one of the last links outside the pathway, which is not the wall. Its depth
    behind a surface's triangles takes too long for a tick; ``behind_wall`` of a finished drive has it.

    Args:
        manipulated: number of the last links in a row.
    """

    def __init__(self, snake: SnakeModel, manipulated: int) -> None:
        self._first = max(snake.links - manipulated, 0)
        self.layout = _layout(snake.dof, range(self._first, snake.links))
        self._length, self._frames = snake.length_mm, np.empty((snake.links, 3, 4))

    def write(self, state: SnakeState, tissue_age_s: float, out: Array) -> None:
        """Write the row of a state to ``out``; ``tissue_age_s``: age of its pathway."""
        pose, forces = state.pose, state.felt.forces
        base, q = pose.shape.base, pose.q
        snake_frames(q, base, self._length, self._frames)
        over = pose.deviation.depth - pose.bound
        out[0], out[1], out[2], out[3] = state.t, state.tip_s, *state.control.steering
        out[4], out[5] = over[pose.measured].max(initial=-np.inf), tissue_age_s
        out[6:8] = forces.total
        out[8] = _CODES[state.result.name]
        out[9:12], out[12:24] = self._frames[-1, :, 3], base[:3].ravel()
        joints = 24 + len(q)
        out[24:joints], out[joints:] = q, pose.deviation.depth[self._first :]


def _layout(dof: int, told: range) -> tuple[Column, ...]:
    first = [("t", "s"), ("tip_s", "mm"), ("u", ""), ("v", ""), ("beyond_bound", "mm"), ("tissue_age", "s")]
    first += [("force_x", "N"), ("force_y", "N"), ("outcome", "")]
    first += [(f"tip_{axis}", "mm") for axis in "xyz"]
    first += [(f"base_{row}{column}", "mm" if column == 3 else "") for row in range(3) for column in range(4)]
    joints = [(f"q{joint}", "rad") for joint in range(dof)]
    last = [(f"outside_link{link + 1}", "mm") for link in told]  # at the end: older runs have none of them
    return tuple(Column(*one) for one in [*first, *joints, *last])
