"""Whether a lumen is wide enough for the robot: its narrowest place, and how deep links really were behind the wall."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...geometry.mesh import TriangleMesh
from ...given import point_text
from ..anatomy.curve import Curve
from ..anatomy.wall import Wall, outward_side
from ..pathway.pathway import Pathway
from .snake_drive import SnakeDrive

Array = NDArray[np.float64]

EVERY_MM = 10.0  # of insertion between two places at which links are measured against the wall
_RAYS = 12


@dataclass(frozen=True)
class Narrowest:
    """The least radius in mm of a pathway at rest, where along it and where in LPS mm.

    below_robot_mm, below_bound_mm: along how much of it the radius is less than the robot's, or than the bound.
    """

    radius_mm: float
    at_mm: float
    at_lps: tuple[float, float, float]
    below_robot_mm: float
    below_bound_mm: float

    def warnings(self, robot_mm: float, bound_mm: float) -> list[str]:
        """In words, where the lumen is too narrow, and what may be done."""
        where = f"the pathway's radius is {self.radius_mm:.1f} mm at {self.at_mm:.0f} mm, {point_text(self.at_lps)}"
        found = []
        if self.below_robot_mm > 0.0:
            found.append(
                f"the robot is wider than the pathway: {where}, the robot's is {robot_mm:g} mm, and it has less than "
                f"that along {self.below_robot_mm:.0f} mm; take a thinner robot, or a farther start or nearer end"
            )
        if self.below_bound_mm > 0.0:
            found.append(
                f"a bound of {bound_mm:g} mm says little where the pathway is narrower: {where}, and it has less than "
                f"the bound along {self.below_bound_mm:.0f} mm; take a smaller bound"
            )
        return found


def narrowest(pathway: Pathway, robot_mm: float, bound_mm: float, to_mm: float) -> Narrowest:
    """Of a pathway at rest, from its entrance to ``to_mm``; a robot of that radius with that bound goes there."""
    contours = pathway.moved(None).contours()
    reached = contours.s <= max(to_mm, float(contours.s[1]))
    s, radius = contours.s[reached], contours.radius.min(axis=1)[reached]
    least, share = int(radius.argmin()), np.gradient(contours.s)[reached]
    x, y, z = contours.centre[least].tolist()
    below = [float(share[radius < limit].sum()) for limit in (robot_mm, bound_mm)]
    return Narrowest(float(radius[least]), float(s[least]), (x, y, z), *below)


class WallDepth:
    """How far vertices of the links past the path's start were behind the triangles of a lumen that does not move.

    deepest: {mm, link, at_lps, tip_mm} of the deepest vertex that was measured, 0 mm where none was behind the wall.
    """

    def __init__(self, mesh: TriangleMesh, pathway: Pathway, curve: Curve) -> None:
        self._wall = Wall(mesh)
        rest = pathway.contours()
        psi = 2.0 * np.pi * np.arange(_RAYS) / _RAYS
        second = np.cross(rest.tangent, rest.first)
        around = np.cos(psi)[:, None] * rest.first[:, None] + np.sin(psi)[:, None] * second[:, None]
        self._outward = outward_side(self._wall.seen(rest.centre[:, None], around)[1])
        self._start, self._ahead = curve.position(0.0), curve.tangent(0.0)
        self._next_mm = -np.inf
        self.deepest: dict[str, Any] = {"mm": 0.0, "link": None, "at_lps": None, "tip_mm": None}

    def look(self, drive: SnakeDrive, always: bool = False) -> None:
        """Measure the links that are inside, if the tip has gone on by ``EVERY_MM`` or ``always``."""
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
        # The start's plane says what is in only of the links at it: a lumen may come back through that plane later.
        past = (state.joint_s[link] >= drive.snake.sphere_mm) | ((points - self._start) @ self._ahead > 0.0)
        if not past.any():
            return
        link, points = link[past], points[past]
        depth = -self._wall.clearance(points, self._outward)[0]
        worst = int(depth.argmax())
        if depth[worst] > self.deepest["mm"]:
            self.deepest = {
                "mm": float(depth[worst]), "link": int(link[worst]) + 1, "at_lps": points[worst].tolist(),
                "tip_mm": float(drive.tip_s),
            }  # fmt: skip

    @property
    def words(self) -> str:
        """The depth, for people."""
        if self.deepest["link"] is None:
            return "no part of the robot was measured behind the lumen's wall"
        return (
            f"deepest behind the lumen's wall: {self.deepest['mm']:.1f} mm, link {self.deepest['link']} at "
            f"{point_text(self.deepest['at_lps'])}, with the tip {self.deepest['tip_mm']:.0f} mm in"
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        return self.deepest | {"words": self.words}


def narrowest_values(found: Narrowest) -> dict[str, Any]:
    """JSON's types only."""
    return asdict(found) | {"at_lps": list(found.at_lps)}
