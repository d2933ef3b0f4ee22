"""How much deeper than its vertices the surface of a driven snake is, measured with denser ones."""

from __future__ import annotations

import numpy as np

from ....pathway.query.query import Query
from ....robots.snake import SnakeModel
from .drive_view import DriveView

EVERY_MM = 10.0  # of insertion between two measurements
_EACH = 3000  # vertices a link, 0.6 mm apart on links of 28 mm and 6 mm radius


class BetweenVertices:
    """The surface of a snake between the vertices at which its deviations are measured.

    bound_mm: by how much it can be deeper where the pathway is convex, see ``SnakeModel.between_vertices_mm``.
    most_mm: by how much it was, at the poses that were measured, also where the pathway bends. A link's rear end lies
        in the link before it, so it is compared with the deeper of the two.
    """

    def __init__(self, snake: SnakeModel, each: int) -> None:
        self.bound_mm, self.most_mm = snake.between_vertices_mm(each), 0.0
        self._query = Query(snake.vertices(_EACH * snake.links))
        self._next_mm = -np.inf

    def look(self, drive: DriveView, always: bool = False) -> None:
        """Measure the links that are inside, if the tip has advanced by ``EVERY_MM``, or ``always``."""
        state = drive.state
        if not state.measured.any() or (not always and drive.tip_s < self._next_mm):
            return
        self._next_mm = drive.tip_s + EVERY_MM
        frames = drive.snake.frames(state.q, state.base)
        dense = self._query.deviations(state.packed, frames, state.windows).depth
        known = np.maximum(state.deviation.depth, np.append(0.0, state.deviation.depth[:-1]))
        self.most_mm = max(self.most_mm, float((dense - known)[state.measured].max()))

    def to_dict(self) -> dict[str, float]:
        """JSON's types only."""
        return {"bound_mm": self.bound_mm, "most_mm": self.most_mm}
