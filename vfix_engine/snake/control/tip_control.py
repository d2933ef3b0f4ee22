"""What a control of the distal links is given, and what it gives: wanted joints, not yet certified."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from ...arrays import Array, IntArray
from ...pathway.packed import PackedPathway
from ...pathway.query.query import Query
from ...robots.snake import SnakeModel
from ..bending.visual_motor_kernel import camera_rows

_AT_BOUND_MM = 0.1
_AT_LIMIT = 1e-6  # [rad]


@dataclass(frozen=True, eq=False)
class DistalContext:
    """Where links are to be moved about: the distal ones as a rule, or all.

    snake: these links alone; query: of their vertices.
    base: (4, 4) of the frame {l} they hang on, patient frame; rest: (2L',) their part of the conforming shape q̃.
    packed, window: the pathway and the segments (L', 2) that the links are measured against; bound: (L',) b_i in mm.
    """

    snake: SnakeModel
    query: Query
    base: Array
    rest: Array
    packed: PackedPathway
    window: IntArray
    bound: Array


class TipControl(Protocol):
    """Turns a camera command into wanted joints of the distal links. Nothing here moves the robot."""

    steering: tuple[float, float]
    """(u, v) = r (cos ϑ, sin ϑ); (0, 0) where the control has none."""
    speed_limited: bool
    """Whether the joints' speed cut what was wanted last."""
    blocked: bool
    """Whether what was wanted last hardly moves the camera as commanded; only 'view' tells."""

    def copy(self) -> Self:
        """One that goes on by itself."""

    def prepare(self, context: DistalContext, q: Array) -> None:
        """Prepare for another context, from joints q (2L',)."""

    def move_to(self, context: DistalContext) -> None:
        """The same context, moved with the tissue."""

    def wanted(self, q: Array, camera_mm: Array, most: float) -> Array:
        """Joints (2L',) that move the camera by so many mm in its plane (2,), none by more than ``most`` rad."""

    def lead(self, steering: tuple[float, float]) -> None:
        """What is wanted next is not steered: it ends with these (u, v)."""

    def ends(self, first: int) -> str:
        """In words, what ends the bends that the control knows, or nothing; ``first`` is the number of their link."""

    def accept(self, share: float) -> None:
        """So much of what was wanted last is done."""

    def bent(self, q: Array, rest: Array) -> float:
        """How far links at q (2L',) are bent from ``rest`` (2L',), about 1 where they can bend no further."""

    def outwards(self, q: Array) -> Array:
        """(2,) where the camera goes in its plane as the links bend more, mm; 0 where they are straight."""


def outwards(snake: SnakeModel, q: Array, rest: Array) -> Array:
    """(2,) where the camera goes in its plane as joints q (2L',) leave ``rest`` in proportion, mm."""
    found: Array = camera_jacobian(snake, q) @ (q - rest)
    return found


def at_bounds(context: DistalContext, q: Array, first: int) -> list[str]:
    """Links at their bounds at joints q (2L',), in words; ``first`` is the number of the first link."""
    frames = context.snake.frames(q, context.base)
    depth = context.query.deviations(context.packed, frames, context.window).depth
    near = np.flatnonzero(depth > context.bound - _AT_BOUND_MM)
    return [f"link {first + i + 1} at its bound of {context.bound[i]:g} mm" for i in near]


def stops(context: DistalContext, q: Array, first: int) -> list[str]:
    """Links at their bounds and joints at their limits; as ``at_bounds``."""
    limits = int((np.abs(q) > context.snake.q_max - _AT_LIMIT).sum())
    words = at_bounds(context, q, first)
    return [*words, f"{limits} of {context.snake.dof} joints at their limit"] if limits else words


def camera_jacobian(snake: SnakeModel, q: Array) -> Array:
    """Motion of the camera in its own plane, (2, 2L') mm/rad: rows of eq. 26."""
    return camera_rows(q, snake.length_mm, snake.camera_offset_mm)
