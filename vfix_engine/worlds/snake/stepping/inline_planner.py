"""Plans that a drive without a clock makes within its step: the present tissue, and the shapes of an insertion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ....errors import PathwayError
from ....geometry.curve import Curve
from ....pathway.packed import PackedPathway
from ....pathway.pathway import Pathway
from ....robots.snake import SnakeModel
from ....snake.conform.conformance import Insertion, ShapeSolution, conform


@dataclass(frozen=True, eq=False)
class InlinePlanner:
    """One robot in one lumen.

    insertion: along the curve at the start, None on a fixed base, where none is planned; every_s: period at which the
    tissue is sampled.
    """

    snake: SnakeModel
    pathway: Pathway
    insertion: Insertion | None
    every_s: float

    @property
    def _insertion(self) -> Insertion:
        assert self.insertion is not None, "a robot on a fixed base is not inserted"
        return self.insertion

    def look(self, t: float) -> tuple[PackedPathway, Curve] | str:
        """The pathway and its curve at the time t in s, or the reason why there is no valid one."""
        try:
            return self.pathway.packed(t), self.pathway.curve(t)
        except PathwayError as error:
            return f"the tissue leaves no pathway: {error}"

    def following(self, curve: Curve, tip_s: float, near: ShapeSolution, most: float) -> ShapeSolution:
        """The shape that conforms to a moved curve, no angle more than ``most`` rad from the previous one."""
        return conform(self.snake, curve, tip_s, near, None, self._insertion.roll, most=most)

    def inserted(self, curve: Curve, place_mm: float, last: ShapeSolution, planned: ShapeSolution) -> ShapeSolution:
        """The shape with its tip at an arc length; on a still curve it starts from the shape planned last."""
        if self.pathway.motion is None:
            return self._insertion.after(planned, place_mm - planned.tip_s)
        return self.following(curve, place_mm, last, math.inf)
