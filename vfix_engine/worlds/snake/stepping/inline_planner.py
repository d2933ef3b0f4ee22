"""What a drive without a clock plans within its step: the tissue of now, and the shapes of an insertion."""

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

    insertion: along the curve at the start; every_s: so often the tissue is looked at.
    """

    snake: SnakeModel
    pathway: Pathway
    insertion: Insertion
    every_s: float

    def look(self, t: float) -> tuple[PackedPathway, Curve] | str:
        """The pathway and its curve at the time t in s; in words, why the tissue leaves none."""
        try:
            return self.pathway.packed(t), self.pathway.curve(t)
        except PathwayError as error:
            return f"the tissue leaves no pathway: {error}"

    def following(self, curve: Curve, tip_s: float, near: ShapeSolution, most: float) -> ShapeSolution:
        """The shape that conforms to a curve that has moved, no angle ``most`` rad from that of before."""
        return conform(self.snake, curve, tip_s, near, None, self.insertion.roll, most=most)

    def inserted(self, curve: Curve, place_mm: float, last: ShapeSolution, planned: ShapeSolution) -> ShapeSolution:
        """The shape with its tip at a place: along a curve that never moves from the one that was planned last."""
        if self.pathway.motion is None:
            return self.insertion.after(planned, place_mm - planned.tip_s)
        return self.following(curve, place_mm, last, math.inf)
