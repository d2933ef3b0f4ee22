"""A look-round in the control process: to each side by bends that a planner finds a few at a time, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ....robots.snake import SnakeModel
from ..requests import SIDES
from ..stepping.constants import DriveConstants
from ..stepping.distal import bend_of
from ..stepping.state import SnakeState
from .adoption import bends_place
from .look_plan import view_of
from .messages import LookPart, LookWanted

BendAngles = tuple[float, ...]

_REACHED = 1e-9  # [rad]
_SAME = 1e-6  # [rad] a piece of a path that begins farther from where the last one ends is for another place
_STUCK = 200  # steps in a row that come no nearer
_NOT_STRAIGHT = -1  # in the place of a side: straightening before the first


@dataclass(frozen=True)
class Looking:
    """Where a look-round is; ``ahead``: bends (2L',) rad off the conforming shape that are planned and not reached.

    aim: rad, where a path ends. ends: in words, what ends the path to this side, '' while it goes on. back: the
    next step straightens. least, stuck: rad still to go, and steps in a row that brought it no nearer.
    turned_deg: the most that the view was really turned to each side.
    """

    aim: float
    side: int = _NOT_STRAIGHT
    ahead: tuple[BendAngles, ...] = ()
    ends: str = ""
    back: bool = True
    least: float = math.inf
    stuck: int = 0
    turned_deg: tuple[float, ...] = (0.0,) * SIDES

    @property
    def goal(self) -> BendAngles | None:
        """The bend that the next step goes towards; None where one is still being planned."""
        return self.ahead[0] if self.ahead and not self.back else None

    def wanted(self, drive: DriveConstants, state: SnakeState) -> LookWanted | None:
        """What a planner is to find: the path beyond the last bend that is known, before that is reached."""
        if self.back or self.ends or len(self.ahead) > 1:
            return None
        at = bends_place(drive, state)
        return LookWanted(at, at.rest + (self.ahead[-1] if self.ahead else bend_of(drive, state)), self.side, self.aim)

    def taken(self, part: LookPart, drive: DriveConstants, state: SnakeState) -> Looking:
        """With a piece of the path that a planner has found; one for another place is left out."""
        end = np.array(self.ahead[-1]) if self.ahead else bend_of(drive, state)
        if self.back or self.ends or part.side != self.side or float(np.abs(part.start - end).max()) > _SAME:
            return self
        return replace(self, ahead=self.ahead + part.bends, ends=part.ends)

    def stepped(self, drive: DriveConstants, state: SnakeState) -> Looking | None:
        """After a step; None where the look-round is over, or cannot get back."""
        left = float(np.abs(bend_of(drive, state) - (self.goal or 0.0)).max())
        now = (
            replace(self, least=left, stuck=0) if left < self.least - _REACHED else replace(self, stuck=self.stuck + 1)
        )
        if self.back:
            if state.straight:
                return now._next_side()
            return now if now.stuck < _STUCK else None
        if self.ahead and left < _REACHED:
            now = replace(now._seen(drive.snake, state), ahead=self.ahead[1:], least=math.inf, stuck=0)
        if not now.ahead:
            return replace(now, back=True, least=math.inf, stuck=0) if now.ends else replace(now, stuck=0)
        if now.stuck < _STUCK:
            return now
        return replace(now._seen(drive.snake, state), ahead=(), back=True, least=math.inf, stuck=0)

    def _next_side(self) -> Looking | None:
        side = self.side + 1
        return replace(self, side=side, ends="", back=False, least=math.inf, stuck=0) if side < SIDES else None

    def _seen(self, snake: SnakeModel, state: SnakeState) -> Looking:
        """Note how far the view is turned, and to which side."""
        view = view_of(snake.camera(state.q_nominal, state.base), snake.camera(state.q, state.base)[:3, 2])
        turned, side = list(self.turned_deg), view.side()
        turned[side] = max(turned[side], math.degrees(view.turned))
        return replace(self, turned_deg=tuple(turned))
