"""The paper's control of the distal links: a polar Hermite surface of optimal bends, steered by the camera command.

Kwok 2013, eq. 10-29: control bends within the bounds, the surface Q(r, ϑ) through them, and the inverse of its
Jacobian in the camera's plane.
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np

from ...arrays import Array
from ..bending.bending import BendProblem
from ..bending.hermite import PolarHermite
from ..bending.optimise import DistalBend, control_bends
from ..bending.visual_motor import BendDirection, VisualMotor
from .tip_control import DistalContext, at_bounds


def found_bends(context: DistalContext, count: Literal[4, 8]) -> tuple[DistalBend, ...]:
    """The control bends at a place (10)-(20); 5 to 30 ms."""
    problem = BendProblem(
        context.snake, context.query, context.packed, context.window, context.base, context.rest, context.bound
    )
    return control_bends(problem, count)


class ParameterisedControl:
    """Steers (u, v) = r (cos ϑ, sin ϑ); q = Q(r, ϑ) about the conforming shape q̃ (Kwok 2013, section III.B.3)."""

    def __init__(self, count: Literal[4, 8] = 8, r_max: float = 1.4) -> None:
        self.steering, self.speed_limited, self.blocked = (0.0, 0.0), False, False
        self.bends: tuple[DistalBend, ...] = ()
        self._count, self._r_max = count, r_max
        self._next = (0.0, 0.0)

    def copy(self) -> Self:
        """One that goes on by itself."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        return other

    def prepare(self, context: DistalContext, q: Array) -> None:
        """Find the control bends anew; done only while r is small, so that the surface moves little under the hand."""
        self.take(found_bends(context, self._count), context)

    def take(self, bends: tuple[DistalBend, ...], context: DistalContext) -> None:
        """Lay the surface through control bends that were found in a context."""
        self.bends = bends
        angles = np.array([bend.angle for bend in self.bends])
        shapes = np.array([context.snake.clamp(context.rest + bend.delta) for bend in self.bends])
        self._hermite = PolarHermite(context.rest, angles, shapes, self._r_max)
        self._rest_then = self._hermite.value(0.0, 0.0)
        self._ends: str | None = None
        self.move_to(context)

    def move_to(self, context: DistalContext) -> None:
        """The same bends about another rest: q = Q(r, ϑ) + (q̃ now − q̃ then)."""
        self._context = context
        self._offset = context.rest - self._rest_then
        self._motor = VisualMotor(context.snake, self._hermite, context.base)

    def wanted(self, q: Array, camera_mm: Array, most: float) -> Array:
        """Q at the steering that (28) leads to; the command is shortened until no joint goes farther than ``most``."""
        here = self._at(self.steering)
        command, target, self.speed_limited = camera_mm, here, False
        for _ in range(4):
            self._next = self._steered(command)
            target = self._at(self._next)
            ratio = float(np.abs(target - here).max()) / most
            if ratio <= 1.0:
                break
            self.speed_limited = True
            command = command * min(0.98 / ratio, 0.9)
        return target

    def lead(self, steering: tuple[float, float]) -> None:
        """The joints go where that steering is."""
        self._next = steering

    def ends(self, first: int) -> str:
        """Links that the control bends bring to their bounds, looked at once for each set of them."""
        if self._ends is None:
            context, found = self._context, set[str]()
            for bend in self.bends:
                found.update(at_bounds(context, context.snake.clamp(context.rest + bend.delta), first))
            self._ends = ", ".join(sorted(found))
        return self._ends

    def accept(self, share: float) -> None:
        """The steering goes as far as the joints did."""
        (u, v), (u_next, v_next) = self.steering, self._next
        self.steering = (u + share * (u_next - u), v + share * (v_next - v))

    def bent(self, q: Array, rest: Array) -> float:
        """r."""
        return math.hypot(*self.steering)

    def outwards(self, q: Array) -> Array:
        """∂(camera)/∂r: the first column of (28)."""
        r = math.hypot(*self.steering)
        if r == 0.0:
            return np.zeros(2)
        outwards: Array = self.camera_per_steering() @ (np.array(self.steering) / r)
        return outwards

    def camera_per_steering(self) -> Array:
        """∂(camera)/∂(u, v) (2, 2) in mm, in the picture (28)."""
        return self._motor.jacobian_uv(BendDirection(*self.steering))

    def shape(self) -> Array:
        """Q at the present steering."""
        return self._at(self.steering)

    def _steered(self, camera_mm: Array) -> tuple[float, float]:
        u, v = self._motor.step(BendDirection(*self.steering), camera_mm)
        r = math.hypot(u, v)
        shrink = min(1.0, self._r_max / r) if r > 0.0 else 1.0
        return float(shrink * u), float(shrink * v)

    def _at(self, steering: tuple[float, float]) -> Array:
        shape: Array = self._hermite.cartesian(*steering)[0] + self._offset
        return self._context.snake.clamp(shape)
