"""The judge of a driven snake: positions and depths of its vertices by the paper's printed steps, without the query.

Kinematics are products of 4 × 4 matrices; depths are eq. 1-9 as printed, for every vertex and every segment of its
link's window. For polar contours, which the printed steps do not cover, the engine's scalar function of one point and
one segment is used.
"""

from __future__ import annotations

import numba
import numpy as np

from benchmarks.lumen_peers import section_as_printed
from vfix_engine.arrays import Array, BoolArray, IntArray
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.query.query import deviation_of_points
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.robots.snake_surface import LinkVertices
from vfix_engine.worlds.snake.settings import DriveSettings


@numba.njit(error_model="numpy", cache=True)
def deepest_as_printed(
    points: Array,
    start: IntArray,
    frames: Array,
    rows: Array,
    radius: Array,
    windows: IntArray,
    asked: BoolArray,
    depth: Array,
) -> None:
    """Write d_l of eq. 9 of every requested link into ``depth`` (L,). windows (L, 2): of each link."""
    for link in range(len(start) - 1):
        depth[link] = 0.0
        if not asked[link]:
            continue
        f = frames[link]
        for i in range(start[link], start[link + 1]):
            a, b, c = points[i, 0], points[i, 1], points[i, 2]
            x = f[0, 0] * a + f[0, 1] * b + f[0, 2] * c + f[0, 3]
            y = f[1, 0] * a + f[1, 1] * b + f[1, 2] * c + f[1, 3]
            z = f[2, 0] * a + f[2, 1] * b + f[2, 2] * c + f[2, 3]
            least = np.inf
            for j in range(windows[link, 0], windows[link, 1]):
                least = min(least, section_as_printed(x, y, z, rows, radius, j))
            depth[link] = max(depth[link], least)


class Judge:
    """Measures one snake."""

    def __init__(self, snake: SnakeModel, vertices: LinkVertices):
        self._snake, self._vertices = snake, vertices

    def frames(self, q: Array, base: Array) -> Array:
        """Return the links' frames (L, 4, 4): products of Rot_x(q_{2l−1}) · Rot_y(q_{2l}) · Trans_z(length)."""
        out, here = np.empty((self._snake.links, 4, 4)), np.array(base)
        cosine, sine = np.cos(q), np.sin(q)
        ahead = np.array([0.0, 0.0, self._snake.length_mm, 1.0])
        for link in range(len(out)):
            a, b = 2 * link, 2 * link + 1
            turn = np.eye(4)
            turn[:3, :3] = [
                [cosine[b], 0.0, sine[b]],
                [sine[a] * sine[b], cosine[a], -sine[a] * cosine[b]],
                [-cosine[a] * sine[b], sine[a], cosine[a] * cosine[b]],
            ]
            turn[:, 3] = turn @ ahead
            out[link] = here = here @ turn
        return out

    def depth(self, packed: PackedPathway, windows: IntArray, asked: BoolArray, q: Array, base: Array) -> Array:
        """Return d_l (L,) in mm, 0 for links that are not requested; infinity at a pose that is not finite."""
        frames, points, start = self.frames(q, base), self._vertices.points, self._vertices.start
        if not np.isfinite(frames).all():
            return np.where(asked, np.inf, 0.0)
        depth = np.zeros(len(frames))
        if packed.polar.shape[1] == 1:
            radius = np.ascontiguousarray(packed.polar[:, 0])
            deepest_as_printed(points, start, frames, packed.rows, radius, windows, asked, depth)
            return depth
        for link in np.flatnonzero(asked):
            own = points[start[link] : start[link + 1]]
            placed = own @ frames[link, :3, :3].T + frames[link, :3, 3]
            depth[link] = deviation_of_points(placed, packed, *windows[link])[0].max()
        return depth


def turned(base: Array, end: Array, share: float) -> Array:
    """Return an interpolated base (4, 4): its origin on a straight line, its axes by one rotation, using SciPy."""
    from scipy.spatial.transform import Rotation  # imported here: slow to load

    turn = Rotation.from_matrix(end[:3, :3] @ base[:3, :3].T).as_rotvec()
    found: Array = base.copy()
    found[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ base[:3, :3]
    found[:3, 3] += share * (end[:3, 3] - base[:3, 3])
    return found


def bounds_by_place(pathway: Pathway, settings: DriveSettings, windows: IntArray) -> Array:
    """Return b_i (L,) in mm of links with windows (L, 2), by the segments of the pathway at rest.

    It is at most 8 mm, 4 mm for the last link, and half of the least radius of the segment's sections by its contours
    and by the lumen's surface; or as set.
    """
    rest = pathway.moved(None).contours(extended=True)
    smallest = rest.radius.min(axis=1)
    wall = np.full(2, np.inf) if pathway.wall_radius is None else pathway.wall_radius
    at, step = np.linspace(0.0, pathway.length, len(wall), retstep=True)
    found = np.empty(len(windows))
    for link, (first, last) in enumerate(windows.tolist()):
        is_tip = link == len(windows) - 1
        given = settings.bound_mm
        if is_tip and settings.tip_bound_mm is not None:
            given = settings.tip_bound_mm
        elif is_tip and given is not None:
            given = 0.5 * given
        found[link] = given if given is not None else (4.0 if is_tip else 8.0)
        for j in range(first, last) if given is None else ():
            axis = rest.centre[j + 1] - rest.centre[j]
            axis /= np.linalg.norm(axis)
            for end in (j, j + 1):
                found[link] = min(found[link], 0.5 * smallest[end] * float(rest.tangent[end] @ axis))
            if rest.s[j] >= 0.0 and rest.s[j + 1] <= pathway.length:  # not the straight ends
                near = (at > rest.s[j] - step) & (at < rest.s[j + 1] + step)
                found[link] = min(found[link], 0.5 * float(wall[near].min()))
    return found
