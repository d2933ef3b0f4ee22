"""Hard limits of a snake in its pathway: no link deviates by more than its bound b_i (Kwok 2013, eq. 17).

A motion is accepted only if it is certified from start to end. For the guarantee and its proof see docs/safety.md,
"The snake in its pathway".
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

ROUNDING_MM = 1e-9  # [mm] tolerance for the measured depth of a link that has not moved
_EXHAUSTED = "the motion is too large to be certified even in parts: ask for a shorter step"
MOTION_TOLERANCE_MM = 0.05  # [mm] a link may exceed its bound by this between two measured poses


@dataclass(frozen=True, eq=False)
class Configuration:
    """Pose of a snake: base (4, 4) transform_base_to_patient, q (2L,) rad; both are copied and read-only.

    Raises:
        InputError: arrays of another shape or not of real numbers. Non-finite numbers are accepted here; the
            certificate refuses them.
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
        """Build from arrays of a step, whose shapes and dtypes are known."""
        pose = object.__new__(cls)
        for name, array in (("base", base.copy()), ("q", q.copy())):
            array.setflags(write=False)
            object.__setattr__(pose, name, array)
        return pose

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite."""
        return math.isfinite(self.base.sum() + self.q.sum()) or bool(
            np.isfinite(self.base).all() and np.isfinite(self.q).all()
        )


class MotionVerdict(NamedTuple):
    """Result of the certificate for one motion."""

    taken: bool
    """Whether the whole motion is certified."""
    part: float
    """Certified fraction of it, from its start."""
    deviation: Deviations
    """(L,) deviations at its end if it is accepted, else in the refused pose."""
    poses: int
    """Number of measured poses."""
    held_by: str | None
    """Reason of the refusal in words; None if it is accepted."""
    exhausted: bool = False
    """Whether it is refused because the limit of bisections was reached, although no pose exceeded a bound."""


class HardLimits:
    """The certificate for one snake with one bound per link; ``first`` is the robot's index of its first link.

    Raises:
        InputError: bounds are not (L,) numbers ≥ 0 (infinity: unlimited).
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
        # From the joint of the link, one link length behind its frame, to its farthest vertex.
        shape[REACH] = float(np.linalg.norm(points + np.array([0.0, 0.0, snake.length_mm]), axis=1).max())
        shape[LOW : LOW + 3], shape[HIGH : HIGH + 3] = points.min(axis=0), points.max(axis=0)
        self._shape = shape

    def certify(
        self,
        packed: PackedPathway,
        windows: IntArray,
        before: Configuration,
        after: Configuration,
        bound: Array | None = None,
        known: Array | None = None,
    ) -> MotionVerdict:
        """Certify that every link stays within its bound during the whole motion from one pose to the other.

        Joints are interpolated linearly, the base's origin on a straight line, its axes by one rotation. A link that
        exceeds its bound at the start because the pathway moved may not get deeper; one that exceeds it because it is
        measured against other segments now, or for the first time, is refused if ``known`` has its previous depth.

        Args:
            packed: the present pathway; validated once, or every time if it is writeable.
            before, after: with the joints of this snake; the base is assumed to be a rigid transform.
            windows: (L, 2) segments that each link is measured against.
            bound: (L,) replaces the configured bounds, mm, ≥ 0; infinity: unlimited.
            known: (L,) mm, known depths of the links at the start; None: as measured.

        Raises:
            InputError: arrays of other shapes or kinds, windows that are empty or not in the pathway, bounds below 0
                or not numbers, a pathway with non-finite values. Non-finite configurations are refused instead.
        """
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
        """Validate windows and bounds, whose shapes and values the kernel does not check."""
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
        """Known depths plus the rounding tolerance."""
        found = np.asarray(known)
        if found.shape != (self.snake.links,) or found.dtype.kind not in "iuf" or not (found >= 0.0).all():
            raise InputError(f"known depths are ({self.snake.links},) mm of at least 0, not {found}")
        return np.asarray(found + ROUNDING_MM, dtype=np.float64)

    def _reason(self, found: Deviations, bound: Array, link: int) -> str:
        name, deep, most = self.first + link + 1, found.depth[link], bound[link]
        return f"link {name} would be {beyond_text(deep, most)} mm outside of the pathway; its bound is {most:g} mm"


def beyond_text(deep: float, most: float) -> str:
    """Format a depth in mm with enough digits to show that it exceeds ``most``, at least two."""
    return next((text for text in (f"{deep:.{digits}f}" for digits in range(2, 9)) if float(text) > most), f"{deep!r}")


def _copied(name: str, value: ArrayLike) -> Array:
    try:
        given = np.asarray(value)
    except ValueError:  # rows of different lengths
        given = np.empty(0, dtype=object)
    if given.dtype.kind not in "iuf":
        raise InputError(f"the {name} of a pose is not an array of real numbers: give one of floats")
    return np.array(given, dtype=np.float64, order="C")
