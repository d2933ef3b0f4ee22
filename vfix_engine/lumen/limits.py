"""Hard limits of a snake in its pathway: no link deviates by more than its bound b_i (Kwok 2013, eq. 17).

A motion is taken only when it is certified from its start to its end. What that guarantees, and why, is in
docs/safety.md, "The snake in its pathway".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..robots.snake import SnakeModel
from .limits_kernel import HIGH, LENGTH, LOW, REACH, SHAPE_SIZE, TOLERANCE, certify_motion
from .packed import PackedPathway
from .query import Deviations, Query

Array = NDArray[np.float64]
Index = NDArray[np.int64]

WAY_TOLERANCE_MM = 0.05  # [mm] so much beyond its bound a link may be between two poses that were measured


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a snake is: base (4, 4) transform_base_to_patient, q (2L,) rad; both are copied and read-only."""

    base: Array
    q: Array

    def __post_init__(self) -> None:
        for name in ("base", "q"):
            array = np.array(getattr(self, name), dtype=np.float64, order="C")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def finite(self) -> bool:
        """Whether all its numbers are."""
        return bool(np.isfinite(self.base).all() and np.isfinite(self.q).all())


class Verdict(NamedTuple):
    """What the certificate says of one motion."""

    taken: bool
    """Whether all of it is certified."""
    part: float
    """Share of it, from its start on, that is."""
    deviation: Deviations
    """(L,) of its end where it is taken, else of the pose that was refused."""
    poses: int
    """So many poses were measured."""
    held_by: str | None
    """In words what refused it; None where it is taken."""


class HardLimits:
    """The certificate for one snake and one bound a link; ``first`` is the number of its first link in the robot.

    Raises:
        InputError: bounds that are not (L,) numbers of at least 0 (infinity: not limited).
    """

    def __init__(self, query: Query, snake: SnakeModel, bound: ArrayLike, first: int = 0) -> None:
        given = np.array(bound, dtype=np.float64, order="C")
        if given.shape != (snake.links,) or not (given >= 0.0).all():
            raise InputError(f"bounds are {snake.links} numbers of at least 0 mm, not {given}")
        if query.links != snake.links:
            raise InputError(f"a query of {query.links} links for a snake of {snake.links}")
        self.query, self.snake, self.bound, self._first = query, snake, given, first
        points = query.vertices.points
        shape = np.zeros(SHAPE_SIZE)
        shape[LENGTH], shape[TOLERANCE] = snake.length_mm, WAY_TOLERANCE_MM
        # From the joint that a link hangs on, which is its own length behind its frame, to its farthest vertex.
        shape[REACH] = float(np.linalg.norm(points + np.array([0.0, 0.0, snake.length_mm]), axis=1).max())
        shape[LOW : LOW + 3], shape[HIGH : HIGH + 3] = points.min(axis=0), points.max(axis=0)
        self._shape = shape

    def certify(
        self, packed: PackedPathway, windows: Index, before: Pose, after: Pose, bound: Array | None = None
    ) -> Verdict:
        """Whether the motion from one pose to the other keeps every link within its bound, all the way.

        Joints go linearly, the base's origin in a straight line, its axes by one turn. A link that is beyond its bound
        at the start, because the pathway moved, may go nowhere deeper than it is.

        Args:
            packed: the pathway of this moment.
            windows: (L, 2) segments that each link is measured against.
            bound: (L,) in place of the set ones, mm.
        """
        links = self.snake.links
        found = Deviations(np.full(links, np.inf), np.zeros(links, dtype=np.int64), np.zeros(links, dtype=np.int64))
        if not (before.finite and after.finite):
            return Verdict(False, 0.0, found, 0, "a joint or the base is not a finite number")
        if float(np.abs(after.q).max()) > self.snake.q_max:
            joint = int(np.abs(after.q).argmax())
            return Verdict(False, 0.0, found, 0, f"joint {joint + 1} is beyond its range")
        limit = self.bound if bound is None else bound
        part, poses = certify_motion(
            packed.rows, packed.polar, windows, before.base, before.q, after.base, after.q, self._shape, limit,
            *self.query.blocks, *found,
        )  # fmt: skip
        if part >= 1.0:
            return Verdict(True, 1.0, found, poses, None)
        return Verdict(False, part, found, poses, self._reason(found, limit))

    def _reason(self, found: Deviations, bound: Array) -> str:
        beyond = found.depth - bound
        link = int(beyond.argmax())
        if not beyond[link] > 0.0:
            return "the motion is too wild to be followed in parts"
        name, deep, most = self._first + link + 1, found.depth[link], bound[link]
        return f"link {name} would be {deep:.2f} mm outside of the pathway; its bound is {most:g} mm"
