"""Bends of the distal links (Kwok 2013, eq. 10-13) and the problem of finding one (eq. 14-17)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, IntArray
from ...errors import InputError
from ...pathway.query.query import Query
from ...pathway.query.query_simd import WORK
from ...robots.snake import SnakeModel
from .bending_kernel import BendWorkspace, DistalPathway, tip_of

if TYPE_CHECKING:
    from ...pathway.packed import PackedPathway
    from ...robots.snake_surface import LinkVertices


BendAxis = Literal["e+", "o+", "e-", "o-"]

# Directions ϑ / (π/2) in which the tip bends, Kwok 2013, eq. 13: +x, +y, −x, −y of {l}.
# Even joints turn about y and odd ones about x.
DIRECTIONS: dict[BendAxis, int] = {"e+": 0, "o+": 1, "e-": 2, "o-": 3}


def bend_angles(m: float, q_c: float, links: int, odd: bool) -> Array:
    """Δq (2L',) in rad of a planar bend: m (i − 2L') + q_c at the even joints i = 2, 4 … (10), or at the odd ones.

    m in rad per joint number, q_c in rad. Joint limits are not applied here.

    Raises:
        InputError: no link, or numbers that are not finite.
    """
    if links < 1 or not (math.isfinite(m) and math.isfinite(q_c)):
        raise InputError(f"no bend of {links} links with m = {m}, q_c = {q_c}")
    number = np.arange(1, 2 * links + 1)
    delta: Array = np.where(number % 2 == (1 if odd else 0), m * (number - 2 * links) + q_c, 0.0)
    return delta


def tip_displacement(snake: SnakeModel, delta: ArrayLike) -> Array:
    """d_eff (3,) in mm in {l}: position of the tip of the straight links bent by Δq (2L',) (11)-(12).

    Raises:
        RobotError: not 2L' finite joints.
    """
    tip = snake.tip(delta, np.eye(4))[:3, 3]
    d: Array = tip - np.array([0.0, 0.0, snake.reach_mm()])
    return d


@dataclass(frozen=True, eq=False)
class BendProblem:
    """The distal links L' in their part of a pathway; arrays are copied and read-only.

    Args:
        snake: the distal links alone.
        vertices: of their surface; or a ``Query`` of them, which is faster for many problems.
        packed: the present pathway.
        window: (L', 2) segments in which each link is measured, or one pair for all.
        base: (4, 4) of the frame {l} that they are attached to, in the patient frame.
        q_nominal: (2L',) their part of the conforming shape q̃, rad.
        bound: (L',) b_i of (17), mm; infinity: not limited.

    Raises:
        InputError: shapes that do not fit, numbers that are not finite, negative bounds, an invalid pathway,
            windows beyond it; a rest shape beyond the joint limits.
    """

    snake: SnakeModel
    vertices: LinkVertices | Query
    packed: PackedPathway
    window: IntArray
    base: Array
    q_nominal: Array
    bound: Array
    query: Query = field(init=False, repr=False)

    def __post_init__(self) -> None:
        links = self.snake.links
        query = self.vertices if isinstance(self.vertices, Query) else Query(self.vertices)
        if query.links != links:
            raise InputError(f"vertices of {query.links} links for {links}")
        query.check(self.packed)
        window = np.array(self.window)
        if not np.issubdtype(window.dtype, np.integer) or window.shape not in ((2,), (links, 2)):
            raise InputError(f"windows are one pair of segment numbers or ({links}, 2), not {window.shape}")
        window = np.array(np.broadcast_to(window, (links, 2)), dtype=np.int64, order="C")
        if not ((window[:, 0] >= 0) & (window[:, 0] < window[:, 1]) & (window[:, 1] <= len(self.packed.rows))).all():
            raise InputError(f"windows need 0 ≤ first < last ≤ {len(self.packed.rows)}, not {window.tolist()}")
        settled = {"window": window, "base": self._checked("base", (4, 4)), "bound": self._checked("bound", (links,))}
        settled["q_nominal"] = self._checked("q_nominal", (2 * links,))
        if not (settled["bound"] >= 0.0).all():
            raise InputError(f"bounds are not negative: {settled['bound']} mm")
        if np.abs(settled["q_nominal"]).max() > self.snake.q_max:
            raise InputError("the shape to bend from is beyond the joint limits")
        for name, array in settled.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "query", query)

    def lumen(self, bound: Array) -> DistalPathway:
        """For the kernels, with bounds (L',) in mm. Copies can be written to, so kernels are compiled for one type."""
        own = self.window.copy(), self.base.copy(), self.q_nominal.copy(), bound.copy()
        return DistalPathway(self.packed, self.query.blocks, *own, self.snake.q_max, self.snake.length_mm)

    def scratch(self) -> BendWorkspace:
        """Memory for the kernels."""
        links = self.snake.links
        return BendWorkspace(np.empty((links, 3, 4)), np.empty(2 * links), np.empty(2 * links), np.zeros(WORK))

    def deviations(self, delta: ArrayLike) -> Array:
        """D_i (L',) in mm of (16) at clamp(q̃ + Δq), through the query's public interface."""
        frames = self.snake.frames(self.snake.clamp(self.q_nominal + np.asarray(delta)), self.base)
        return self.query.deviations(self.packed, frames, self.window).depth

    def cost(self, delta: ArrayLike) -> float:
        """z_eff/z_max of the straight links bent by Δq (2L',), (14): 1 is straight, below 0 looking back."""
        return float(tip_of(np.array(delta, dtype=np.float64), self.snake.length_mm)[2]) / self.snake.reach_mm()

    def _checked(self, name: str, shape: tuple[int, ...]) -> Array:
        array = np.array(getattr(self, name), dtype=np.float64, order="C")
        if array.shape != shape or np.isnan(array).any() or (name != "bound" and not np.isfinite(array).all()):
            raise InputError(f"the {name} of a bend is {shape} finite numbers, not {array.shape}: {array}")
        return array
