"""Hard limits of a snake in its pathway: no link deviates by more than its bound b_i (Kwok 2013, eq. 17).

A motion is taken only when it is certified from its start to its end. What that guarantees, and why, is in
docs/safety.md, "The snake in its pathway".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, IntArray
from ...errors import InputError
from ...robots.snake import SnakeModel
from ..packed import PackedPathway
from ..query.query import Deviations, Query
from .limits_kernel import HIGH, LENGTH, LOW, REACH, SHAPE_SIZE, TOLERANCE, certify_motion, unfit_bound, unfit_window

ROUNDING_MM = 1e-9  # [mm] so much deeper than it was known to be a link may be found that has not moved
_EXHAUSTED = "the motion is too large to be certified even in parts: ask for a shorter step"
MOTION_TOLERANCE_MM = 0.05  # [mm] so much beyond its bound a link may be between two poses that were measured


@dataclass(frozen=True, eq=False)
class Configuration:
    """Where a snake is: base (4, 4) transform_base_to_patient, q (2L,) rad; both are copied and read-only.

    Raises:
        InputError: arrays of another shape or not of real numbers. Numbers that are not finite are taken here: no
            certificate takes them.
    """

    base: Array
    q: Array

    def __post_init__(self) -> None:
        for name in ("base", "q"):
            array = _copied(name, getattr(self, name))
            if name == "base" and array.shape != (4, 4):
                raise InputError(f"the base of a pose is a transform (4, 4), not {array.shape}: give all four rows")
            if name == "q" and (array.ndim != 1 or len(array) % 2):
                raise InputError(f"the joints of a pose are (2L,), not {array.shape}: give two angles for every link")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def of(cls, base: Array, q: Array) -> Self:
        """Of arrays of a step, whose shapes and kinds are known."""
        pose = object.__new__(cls)
        for name, array in (("base", base.copy()), ("q", q.copy())):
            array.setflags(write=False)
            object.__setattr__(pose, name, array)
        return pose

    @property
    def finite(self) -> bool:
        """Whether all its numbers are."""
        return math.isfinite(self.base.sum() + self.q.sum()) or bool(
            np.isfinite(self.base).all() and np.isfinite(self.q).all()
        )


class LinksAt(NamedTuple):
    """Links before a motion, and what they are held to.

    packed: the pathway of this moment; looked at once, or every time where it may be written to.
    windows: (L, 2) segments that each link is measured against; pose: with the joints of this snake; the base is taken
        to be a rigid transform.
    bound: (L,) mm, at least 0, infinity: not limited; None: the certificate's own.
    known: (L,) mm, how deep the links are known to be; None: as deep as they are measured.
    """

    packed: PackedPathway
    windows: IntArray
    pose: Configuration
    bound: Array | None = None
    known: Array | None = None


class MotionVerdict(NamedTuple):
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
    exhausted: bool = False
    """Whether it is refused because it was parted as often as it may be: no pose of it was beyond a bound."""


class HardLimits:
    """The certificate for one snake and one bound a link; ``first`` is the number of its first link in the robot.

    Raises:
        InputError: bounds that are not (L,) numbers of at least 0 (infinity: not limited).
    """

    def __init__(self, query: Query, snake: SnakeModel, bound: ArrayLike, first: int = 0) -> None:
        given = np.array(bound, dtype=np.float64, order="C")
        given.setflags(write=False)
        if given.shape != (snake.links,) or not (given >= 0.0).all():
            raise InputError(f"bounds are {snake.links} numbers of at least 0 mm, not {given}")
        if query.links != snake.links:
            raise InputError(f"a query of {query.links} links for a snake of {snake.links}")
        self.query, self.snake, self.bound, self.first = query, snake, given, first
        points = query.vertices.points
        shape = np.zeros(SHAPE_SIZE)
        shape[LENGTH], shape[TOLERANCE] = snake.length_mm, MOTION_TOLERANCE_MM
        # From the joint that a link hangs on, which is its own length behind its frame, to its farthest vertex.
        shape[REACH] = float(np.linalg.norm(points + np.array([0.0, 0.0, snake.length_mm]), axis=1).max())
        shape[LOW : LOW + 3], shape[HIGH : HIGH + 3] = points.min(axis=0), points.max(axis=0)
        self._shape = shape

    def certify(self, state: LinksAt, motion: Configuration) -> MotionVerdict:
        """Whether the motion to a pose keeps every link within its bound and every joint within its range throughout.

        Joints go linearly, the base's origin in a straight line, its axes by one turn. A link that is beyond its bound
        at the start, because the pathway moved, may go nowhere deeper than it is; one that is, because it is measured
        against other segments now or for the first time, goes nowhere where ``known`` says what it was before.

        Raises:
            InputError: arrays of other shapes or kinds, windows that are empty or not in the pathway, bounds below 0
                or not numbers, a pathway with non-finite values. Non-finite configurations are refused instead.
        """
        packed, windows, before, bound, known = state
        after = motion
        links = self.snake.links
        limit = self.bound if bound is None else bound
        windows, limit = self._checked(packed, windows, before, after, limit)
        was = np.full(links, np.inf) if known is None else self._checked_known(known)
        found = Deviations(np.full(links, np.inf), np.zeros(links, dtype=np.int64), np.zeros(links, dtype=np.int64))
        if not (before.finite and after.finite):
            return MotionVerdict(False, 0.0, found, 0, "a joint or the base is not finite: give finite numbers")
        if float(np.abs(after.q).max()) > self.snake.q_max:
            joint = int(np.abs(after.q).argmax())
            most = np.degrees(self.snake.q_max)
            return MotionVerdict(False, 0.0, found, 0, f"joint {joint + 1} would be beyond its range of ± {most:g}°")
        part, poses = certify_motion(
            packed.rows, packed.polar, windows, before.base, before.q, after.base, after.q, self._shape, limit,
            was, *self.query.blocks, *found,
        )  # fmt: skip
        if part >= 1.0:
            return MotionVerdict(True, 1.0, found, poses, None)
        beyond = found.depth - limit
        if not (beyond > 0.0).any():
            return MotionVerdict(False, part, found, poses, _EXHAUSTED, True)
        return MotionVerdict(False, part, found, poses, self._reason(found, limit, int(beyond.argmax())))

    def _checked(
        self, packed: PackedPathway, windows: IntArray, before: Configuration, after: Configuration, bound: Array
    ) -> tuple[IntArray, Array]:
        """Windows and bounds as the kernel reads them, which looks at no shape and no number of a row."""
        links = self.snake.links
        self.query.check(packed)
        for pose in (before, after):
            if pose.q.shape != (2 * links,):
                raise InputError(f"a pose of {len(pose.q)} joints: give {2 * links}, two for each of {links} links")
        windows, bound = np.asarray(windows), np.asarray(bound)
        if windows.shape != (links, 2) or windows.dtype.kind not in "iu":
            raise InputError(
                f"windows are whole numbers ({links}, 2), not {windows.dtype} {windows.shape}: "
                "give each link its first segment and the one after its last"
            )
        if bound.shape != (links,) or bound.dtype.kind not in "iuf":
            raise InputError(f"bounds are ({links},) mm, not {bound.dtype} {bound.shape}: give one for each link")
        windows, bound = np.ascontiguousarray(windows, np.int64), np.ascontiguousarray(bound, np.float64)
        link = unfit_window(windows, len(packed.rows))
        if link >= 0:
            raise InputError(
                f"link {self.first + link + 1} has the window {windows[link].tolist()}: "
                f"give 0 ≤ first < last ≤ {len(packed.rows)}, the segments of the pathway"
            )
        link = unfit_bound(bound)
        if link >= 0:
            raise InputError(
                f"link {self.first + link + 1} has a bound of {bound[link]} mm: give at least 0, or infinity for none"
            )
        return windows, bound

    def _checked_known(self, known: Array) -> Array:
        """Depths that are known, with what rounding may add."""
        found = np.asarray(known)
        if found.shape != (self.snake.links,) or found.dtype.kind not in "iuf" or not (found >= 0.0).all():
            raise InputError(f"known depths are ({self.snake.links},) mm of at least 0, not {found}")
        return np.asarray(found + ROUNDING_MM, dtype=np.float64)

    def _reason(self, found: Deviations, bound: Array, link: int) -> str:
        name, deep, most = self.first + link + 1, found.depth[link], bound[link]
        return f"link {name} would be {beyond_text(deep, most)} mm outside of the pathway; its bound is {most:g} mm"


def beyond_text(deep: float, most: float) -> str:
    """A depth in mm with as many digits as it takes to read that it is more than ``most``, two at least."""
    return next((text for text in (f"{deep:.{digits}f}" for digits in range(2, 9)) if float(text) > most), f"{deep!r}")


def _copied(name: str, value: ArrayLike) -> Array:
    try:
        given = np.asarray(value)
    except ValueError:  # rows of different lengths
        given = np.empty(0, dtype=object)
    if given.dtype.kind not in "iuf":
        raise InputError(f"the {name} of a pose is not an array of real numbers: give one of floats")
    return np.array(given, dtype=np.float64, order="C")
