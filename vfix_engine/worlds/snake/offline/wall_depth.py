"""Depth of the links of a driven snake behind the triangles of the lumen's surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....anatomy.lumen.wall import Wall, outward_side
from ....arrays import Array, IntArray
from ....geometry.curve import Curve
from ....geometry.mesh import TriangleMesh
from ....pathway.pathway import Pathway
from ....validate import point_text
from .drive_view import DriveView

EVERY_MM = 10.0  # of insertion between two measurements of links against the wall
_RAYS = 12
_ALONG_MM = 0.5  # between two positions on a link's axis


class WallDepth:
    """Depth of links beyond the path's start behind the triangles of a lumen that does not move.

    Measured at the links' vertices, and from the triangles to the links' axes: the ball around a position on an axis is
    as deep as the distance that the ball, or the fold that pierces it, would have to move, also where no vertex is
    behind it.

    deepest: {mm, link, at_lps, tip_mm} of the deepest measured position, 0 mm where none was behind the wall, or
        none was measured, which ``words`` and ``to_dict`` distinguish.
    per_link: (L,) mm, the same for every link; NaN for links that were never measured.
    """

    def __init__(self, mesh: TriangleMesh, pathway: Pathway, curve: Curve, links: int) -> None:
        self._wall = Wall(mesh)
        rest = pathway.contours()
        psi = 2.0 * np.pi * np.arange(_RAYS) / _RAYS
        second = np.cross(rest.tangent, rest.first)
        around = np.cos(psi)[:, None] * rest.first[:, None] + np.sin(psi)[:, None] * second[:, None]
        self._outward = outward_side(self._wall.seen(rest.centre[:, None], around)[1])
        self._start, self._ahead = curve.position(0.0), curve.tangent(0.0)
        self._next_mm = -np.inf
        self.deepest: dict[str, Any] = {"mm": 0.0, "link": None, "at_lps": None, "tip_mm": None}
        self.per_link = np.full(links, np.nan)

    def look(self, drive: DriveView, always: bool = False) -> None:
        """Measure the links that are inside, if the tip has advanced by ``EVERY_MM``, or ``always``."""
        if not always and drive.tip_s < self._next_mm:
            return
        self._next_mm = drive.tip_s + EVERY_MM
        state, vertices = drive.state, drive.query.vertices
        frames = drive.snake.frames(state.q, state.base)[1:]
        link = np.repeat(np.arange(drive.snake.links), np.diff(vertices.start))
        inside = state.measured[link]
        if not inside.any():
            return
        link = link[inside]
        points = np.einsum("nij,nj->ni", frames[link, :3, :3], vertices.points[inside]) + frames[link, :3, 3]
        # The start's plane decides only for the links at it: a lumen may pass through that plane again later.
        past = (state.joint_s[link] >= drive.snake.sphere_mm) | ((points - self._start) @ self._ahead > 0.0)
        if not past.any():
            return
        link, points = link[past], points[past]
        depth = -self._wall.clearance(points, self._outward)[0]
        of_axes = self._of_axes(drive, frames)
        link, points, depth = (np.concatenate(pair) for pair in zip((link, points, depth), of_axes, strict=True))
        np.fmax.at(self.per_link, link, np.maximum(depth, 0.0))
        worst = int(depth.argmax())
        if depth[worst] > self.deepest["mm"]:
            self.deepest = {
                "mm": float(depth[worst]), "link": int(link[worst]) + 1, "at_lps": points[worst].tolist(),
                "tip_mm": float(drive.tip_s),
            }  # fmt: skip

    def _of_axes(self, drive: DriveView, frames: Array) -> tuple[IntArray, Array, Array]:
        """Depths between the vertices: links (n,), points of the wall (n, 3) and depths (n,) in mm.

        The ball around a position on a link's axis is part of the link, except at the joint's end, where it is part of
        the previous link. Wall behind the start's plane does not count near it: there the robot enters.
        """
        snake, state = drive.snake, drive.state
        places = np.linspace(0.0, snake.length_mm, int(np.ceil(snake.length_mm / _ALONG_MM)) + 1)
        link = np.flatnonzero(state.measured)
        axis = frames[link, None, :3, 3] - places[:, None] * frames[link, None, :3, 2]
        radius = np.tile(np.where(places > 0.0, snake.radius_mm, snake.sphere_mm), len(link))
        link, centre = np.repeat(link, len(places)), axis.reshape(-1, 3)
        clear, inward = self._wall.clearance(centre, self._outward)
        near = state.joint_s[link] < snake.sphere_mm
        wall = centre - clear[:, None] * inward
        past = ~near | (np.minimum((wall - self._start) @ self._ahead, (centre - self._start) @ self._ahead) > 0.0)
        depth = radius - clear
        return link[past], wall[past], depth[past]

    @property
    def words(self) -> str:
        """The depth, for people."""
        if np.isnan(self.per_link).all():
            return (
                "how deep the robot is behind the lumen's wall is not known: no part of it came past the path's start"
            )
        if self.deepest["link"] is None:
            return "no part of the robot was measured behind the lumen's wall"
        return (
            f"deepest behind the lumen's wall: {self.deepest['mm']:.1f} mm, link {self.deepest['link']} at "
            f"{point_text(self.deepest['at_lps'])}, with the tip {self.deepest['tip_mm']:.0f} mm in"
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        per_link = [None if np.isnan(mm) else mm for mm in self.per_link.tolist()]
        never = {"mm": None} if np.isnan(self.per_link).all() else {}
        return self.deepest | never | {"per_link_mm": per_link, "words": self.words}


UNMEASURED: dict[str, Any] = {
    "mm": None, "link": None, "at_lps": None, "tip_mm": None, "per_link_mm": None,
    "words": "how deep the robot is behind the lumen's wall is not known: the surface does not move with the tissue",
}  # fmt: skip
