"""The scene of the lumen query's benchmark: five links in a curved lumen, a chosen fraction of their vertices outside.

The lumen is that of Kwok 2013, section IV.A: twenty segments, here of 10 mm and with a radius of 12 mm, on an arc of a
circle. The snake follows the arc. It is shifted perpendicular to the plane of the arc until the wanted fraction of its
vertices is outside: since the sections of the arc have no preferred direction there, every fraction is possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.query.query import Query
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.robots.snake_surface import LinkVertices

LINKS, SEGMENTS = 5, 20
RADIUS_MM, SEGMENT_MM, BEND_MM = 12.0, 10.0, 150.0
BEFORE_MM = 25.0  # length of the lumen before the snake's base
JUDGED = 14_800  # vertices by which a fraction is determined: those of the paper's largest robot
STIR = np.radians(0.2)  # [rad] approximate difference of the joints of two poses with the same fraction


@dataclass(frozen=True, eq=False)
class Scene:
    """A snake, a pathway, and the queried window of it, which is the whole pathway."""

    snake: SnakeModel
    packed: PackedPathway
    window: tuple[int, int]

    @classmethod
    def made(cls, radius_mm: float = RADIUS_MM) -> Scene:
        """Return the scene of the benchmark in a lumen of that radius in mm."""
        angle = np.linspace(0.0, SEGMENTS * SEGMENT_MM / BEND_MM, SEGMENTS + 1)
        centre = BEND_MM * np.column_stack([1.0 - np.cos(angle), np.zeros_like(angle), np.sin(angle)])
        tangent = np.column_stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)])
        radius = np.full((len(angle), 1), radius_mm)
        pathway = Pathway(centre, radius, count=len(angle), tangent=tangent, closed_ends=True)
        return cls(SnakeModel(LINKS), pathway.packed(), (0, SEGMENTS))

    def vertices(self, count: int) -> LinkVertices:
        """Return ``count`` vertices on the snake's surface."""
        return self.snake.vertices(count)

    def poses(self, shift_mm: float, count: int, stir: float = STIR, seed: int = 0) -> Array:
        """Return ``count`` poses with different joints as frames (count, L, 3, 4), shifted out of the arc's plane."""
        random = np.random.default_rng(seed)
        base, q = self.base(shift_mm), self.rest()
        frames = [self.snake.frames(q + stir * random.standard_normal(len(q)), base)[1:, :3] for _ in range(count)]
        return np.ascontiguousarray(frames)

    def base(self, shift_mm: float = 0.0) -> Array:
        """Return transform_base_to_patient (4, 4): on the arc along its tangent, shifted out of its plane in mm."""
        turn = BEFORE_MM / BEND_MM
        base = np.eye(4)
        base[:3, :3] = [[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]]
        base[:3, 3] = BEND_MM * (1.0 - np.cos(turn)), shift_mm, BEND_MM * np.sin(turn)
        return base

    def rest(self) -> Array:
        """Return joints (2L,) in rad with which the snake follows the arc."""
        q = np.zeros(2 * LINKS)
        q[1::2] = 2.0 * np.arcsin(0.5 * self.snake.length_mm / BEND_MM)  # as chords of a circle turn
        q[1] *= 0.5  # the first, from the tangent
        return q

    def share_outside(self, query: Query, poses: Array) -> float:
        """Return the fraction of the query's vertices that deviate, over all poses."""
        outside = [query.every_vertex(self.packed, pose, self.window)[0] > 0.0 for pose in poses]
        return float(np.mean(outside))

    def shift_for(self, share: float) -> float:
        """Return the shift in mm at which a fraction ``share`` of the vertices is outside; 0 for 0."""
        if not 0.0 < share < 1.0:
            return 3.0 * RADIUS_MM * share
        query, near, far = Query(self.vertices(JUDGED)), 0.0, 3.0 * RADIUS_MM
        for _ in range(24):
            middle = 0.5 * (near + far)
            less = self.share_outside(query, self.poses(middle, 1, stir=0.0)) < share
            near, far = (middle, far) if less else (near, middle)
        return 0.5 * (near + far)
