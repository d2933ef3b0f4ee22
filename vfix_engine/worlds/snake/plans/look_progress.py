"""A look-round in the control process: in each direction by bends that a planner computes a few at a time, and back."""

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
_SAME = 1e-6  # [rad] a piece of a path that begins farther from the end of the last one belongs to another position
_STUCK = 200  # steps in a row without progress
_NOT_STRAIGHT = -1  # instead of a direction: straightening before the first


@dataclass(frozen=True)
class Looking:
    """Progress of a look-round; ``ahead``: bends (2L',) rad off the conforming shape that are planned and not reached.

    aim: rad, where a path ends. ends: the reason why the path in this direction ends, '' while it continues. back: the
    next step straightens. least, stuck: remaining rad, and steps in a row without progress.
    turned_deg: the largest actual angle of the view in each direction.
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
        """The goal of the next step; None where it is still being planned."""
        return self.ahead[0] if self.ahead and not self.back else None

    def wanted(self, drive: DriveConstants, state: SnakeState) -> LookWanted | None:
        """The request to a planner: the path beyond the last known bend, before that is reached."""
        if self.back or self.ends or len(self.ahead) > 1:
            return None
        at = bends_place(drive, state)
        return LookWanted(at, at.rest + (self.ahead[-1] if self.ahead else bend_of(drive, state)), self.side, self.aim)

    def taken(self, part: LookPart, drive: DriveConstants, state: SnakeState) -> Looking:
        """With a piece of the path from a planner; one for another position is ignored."""
        end = np.array(self.ahead[-1]) if self.ahead else bend_of(drive, state)
        if self.back or self.ends or part.side != self.side or float(np.abs(part.start - end).max()) > _SAME:
            return self
        return replace(self, ahead=self.ahead + part.bends, ends=part.ends)

    def stepped(self, drive: DriveConstants, state: SnakeState) -> Looking | None:
        """After a step; None where the look-round is finished, or cannot return."""
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
        """Record the angle of the view, and its direction."""
        view = view_of(snake.camera(state.q_nominal, state.base), snake.camera(state.q, state.base)[:3, 2])
        turned, side = list(self.turned_deg), view.side()
        turned[side] = max(turned[side], math.degrees(view.turned))
        return replace(self, turned_deg=tuple(turned))
