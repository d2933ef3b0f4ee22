"""The last refusal of the certificate, put in words on request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ....arrays import Array
from ....pathway.limits.limits import Configuration, MotionVerdict
from ....pathway.query.query import Query
from ....robots.snake import SnakeModel
from .outcome import Outcome


@dataclass(frozen=True, eq=False)
class Refusal:
    """A verdict on the motion of links (L,) with bounds (L,) mm to a pose."""

    verdict: MotionVerdict
    end: Configuration
    bound: Array
    snake: SnakeModel
    query: Query

    @property
    def link(self) -> int:
        """The link that would be farthest beyond its bound, counted from 0 in this snake."""
        return int((self.verdict.deviation.depth - self.bound).argmax())

    def outcome(self, name: Literal["shrunk", "held"]) -> Outcome:
        """Outcome of a step that it scaled or held; the position is that of the outermost vertex, at the goal."""
        found = self.verdict.deviation
        over = found.depth - self.bound
        link = self.link
        if not (over[link] > 0.0 and np.isfinite(found.depth[link]) and self.end.finite):
            return Outcome(name, self.verdict.held_by, "bound")
        frame = self.snake.frames(self.end.q, self.end.base)[link + 1]
        at = frame[:3, :3] @ self.query.vertices.points[found.vertex[link]] + frame[:3, 3]
        return Outcome(name, self.verdict.held_by, "bound", at)
