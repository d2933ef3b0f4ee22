"""The row of numbers that is recorded of every step of a snake."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, get_args

import numpy as np

from ...arrays import Array
from ...robots.snake import SnakeModel
from ...robots.snake_kernel import snake_frames
from ...runtime.system import Column
from .settings import Arm
from .stepping.outcome import LimitedBy

if TYPE_CHECKING:  # its codes are needed without the state, which is slow to load
    from .stepping.state import SnakeState

OUTCOMES = {"rest": "idle", "moved": "moved", "shrunk": "shrunk", "held": "held"}
LIMITS: tuple[LimitedBy | None, ...] = (None, *get_args(LimitedBy))  # by their codes in a row
_CODES = {name: float(code) for code, name in enumerate(OUTCOMES)}
_LIMIT_CODES = {name: float(code) for code, name in enumerate(LIMITS)}
ARM_CODES: dict[Arm, float] = {"manual": 0.0, "guided": 1.0, "certified": 2.0}  # fixed: runs have them
# By column: what its numbers are called.
CODES: dict[str, tuple[str, ...]] = {
    "outcome": tuple(OUTCOMES.values()),
    "limit": tuple(name or "" for name in LIMITS),
    "arm": tuple(ARM_CODES),
}
# What has been added since the first runs, at the end; a run of before is replayed without.
_ADDED = (
    ("deviation", "mm"), ("bound", "mm"), ("link", ""), ("guidance_x", "N"), ("guidance_y", "N"), ("limit", ""),
    ("limit_link", ""), ("arm", ""), ("bend", ""),
)  # fmt: skip


class SnakeRow:
    """Writes rows of one snake; ``layout``: names and units. outcome: 0 idle, 1 moved, 2 shrunk, 3 held.

    outside_linkN: depth of one of the last links outside the pathway, which is not the wall. Its depth
    behind a surface's triangles takes too long for a tick; ``behind_wall`` of a finished drive has it.
    link: number from the base, from 1, of the link that has used most of its bound, with its deviation and bound; 0, 0
    and infinity while none is inside. guidance: the part (33)-(35) of the force, the rest is resistance.
    limit: code in ``LIMITS`` of what scaled or held the step, limit_link: the link whose bound that is, 0 for none.
    arm: code in ``ARM_CODES``. bend: r of the distal links, as in ``SnakeSnapshot``; (u, v) have it under control by
    bends alone.

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
        joints, added = 24 + len(q), len(out) - len(_ADDED)
        out[24:joints], out[joints:added] = q, pose.deviation.depth[self._first :]
        out[added : added + 3] = _nearest(state)
        out[added + 3 : added + 5], limit = forces.guidance, state.limit
        out[added + 5], out[added + 6] = _LIMIT_CODES[limit], _limit_link(state) if limit == "bound" else 0.0
        bent = state.control.bent(pose.q[2 * self._first :], pose.shape.q[2 * self._first :])
        out[added + 7], out[added + 8] = ARM_CODES[state.settings.arm], bent


def _nearest(state: SnakeState) -> tuple[float, float, float]:
    """Deviation, bound and number of the link that has used most of its bound."""
    pose = state.pose
    share = np.where(pose.measured, pose.deviation.depth / pose.bound, -1.0)
    link = int(share.argmax())
    if share[link] < 0.0:
        return 0.0, math.inf, 0.0
    return float(pose.deviation.depth[link]), float(pose.bound[link]), float(link + 1)


def _limit_link(state: SnakeState) -> float:
    """Number of the link whose bound the certificate refused last."""
    refused = state.refused
    return 0.0 if refused is None else float(refused.link + 1 + len(state.bound) - refused.snake.links)


def _layout(dof: int, told: range) -> tuple[Column, ...]:
    first = [("t", "s"), ("tip_s", "mm"), ("u", ""), ("v", ""), ("beyond_bound", "mm"), ("tissue_age", "s")]
    first += [("force_x", "N"), ("force_y", "N"), ("outcome", "")]
    first += [(f"tip_{axis}", "mm") for axis in "xyz"]
    first += [(f"base_{row}{column}", "mm" if column == 3 else "") for row in range(3) for column in range(4)]
    joints = [(f"q{joint}", "rad") for joint in range(dof)]
    last = [(f"outside_link{link + 1}", "mm") for link in told]  # at the end: older runs have none of them
    return tuple(Column(*one) for one in [*first, *joints, *last, *_ADDED])
