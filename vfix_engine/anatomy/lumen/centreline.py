"""Centreline of a lumen, from its surface and two points.

The path of least cost through the voxels of the inside, where a millimetre costs (10 mm / distance to the wall)^power.
Power 3 keeps it in the lumen: an opening of 2 mm radius and 6 mm length between two touching folds costs as much as
750 mm of open colon, so a path around any loop is cheaper than a false shortcut. Power 1 would take the shortcut.
The path is smoothed; its radius is the distance to the surface itself, not to voxels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from ...errors import InputError, PathwayError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...proximity.proximity import ProximityTree
from ...validate import point as checked_point
from .voxels import VoxelLumen, piece_with, voxels_of

Voxel = tuple[int, int, int]

SNAP_MM = 8.0  # largest distance of a given point from the lumen
_TIE = 0.25  # of a voxel: smaller differences of the distance to the wall count as equal
_OPEN_MM = 10.0  # distance to the wall at which a millimetre costs 1
_SAMPLE_MM = 1.0  # sample spacing of the path during smoothing


@dataclass(frozen=True, eq=False)
class Centreline:
    """curve: from start to end; radius: (N,) mm from each of its points to the nearest point of the surface."""

    curve: Curve
    radius: Array


def centreline_between(
    mesh: TriangleMesh,
    start: ArrayLike,
    end: ArrayLike,
    voxel_mm: float = 1.5,
    power: float = 3.0,
    smooth_mm: float = 4.0,
) -> Centreline:
    """Compute the path through a lumen from one point to another.

    Args:
        mesh: the lumen's surface, closed, in mm; the orientation of its triangles does not matter.
        start, end: (3,) in the patient frame, in the lumen or at most 8 mm outside; each is moved to the point
            farthest from the wall within 8 mm, the nearest of equally far ones.
        voxel_mm: edge of the voxels in which the path is searched.
        power: of the cost near the wall.
        smooth_mm: standard deviation of the smoothing along the path; 0 disables smoothing.

    Raises:
        InputError: start or end is not a point, or a number is out of range.
        PathwayError: the surface encloses nothing, a point is too far from the lumen, or the points are in two pieces
            of it or coincide.
    """
    clicks = np.array([_click(start, "start"), _click(end, "end")])
    if not (math.isfinite(power) and 0.0 < power <= 8.0):
        raise InputError(f"a power of {power} is not in 0 … 8: 3 is the default")
    if not (math.isfinite(smooth_mm) and smooth_mm >= 0.0):
        raise InputError(f"a smoothing of {smooth_mm} mm: give a finite length of at least 0")
    lumen = voxels_of(mesh, voxel_mm)
    seed = _nearest_inside(lumen, clicks[0], "start")
    lumen = piece_with(lumen, seed)
    depth = lumen.depth()
    first, last = (
        _deepest_near(lumen, depth, click, name) for click, name in zip(clicks, ("start", "end"), strict=True)
    )
    if first == last:
        raise PathwayError("start and end lead to the same place of the lumen: set them farther apart")
    path = lumen.place(_cheapest(lumen, depth, first, last, power))
    curve = Curve.through(_smoothed(path, smooth_mm))
    radius = ProximityTree(mesh).point_distance(curve.points)[0]
    radius.setflags(write=False)
    return Centreline(curve, radius)


def _click(point: ArrayLike, name: str) -> Array:
    return checked_point(f"the {name}", point)


def _near(lumen: VoxelLumen, click: Array) -> tuple[NDArray[np.int64], Array]:
    """Voxels (n, 3) inside the lumen within 8 mm of a point, and their distances (n,) from it in mm."""
    size = np.array(lumen.inside.shape)
    low = np.clip(np.floor((click - SNAP_MM - lumen.origin) / lumen.voxel_mm).astype(np.int64), 0, size)
    high = np.clip(np.ceil((click + SNAP_MM - lumen.origin) / lumen.voxel_mm).astype(np.int64) + 1, low, size)
    box = lumen.inside[low[0] : high[0], low[1] : high[1], low[2] : high[2]]
    voxels = np.argwhere(box) + low
    away = np.linalg.norm(lumen.place(voxels) - click, axis=1)
    return voxels[away <= SNAP_MM], away[away <= SNAP_MM]


def _nearest_inside(lumen: VoxelLumen, click: Array, name: str) -> Voxel:
    voxels, away = _near(lumen, click)
    if not len(voxels):
        inside = np.argwhere(lumen.inside)
        distance = np.linalg.norm(lumen.place(inside) - click, axis=1).min()
        raise PathwayError(
            f"the {name} {click.tolist()} lies {distance:.1f} mm from the lumen; a click is at most {SNAP_MM:g} mm off"
            ": set it inside, in LPS mm"
        )
    return _as_voxel(voxels[away.argmin()])


def _deepest_near(lumen: VoxelLumen, depth: Array, click: Array, name: str) -> Voxel:
    """Voxel of this piece of the lumen that is farthest from the wall, within 8 mm of the point.

    In a lumen of constant width many are equally far; the one nearest to the point is used.
    """
    voxels, away = _near(lumen, click)
    if not len(voxels):
        raise PathwayError(
            f"the {name} {click.tolist()} lies in another piece of the surface than the start: no lumen joins them; "
            "set both in one piece, or close the gap in the segmentation"
        )
    deep = depth[tuple(voxels.T)]
    as_deep = np.flatnonzero(deep >= deep.max() - _TIE * lumen.voxel_mm)
    return _as_voxel(voxels[as_deep[away[as_deep].argmin()]])


def _as_voxel(indices: NDArray[np.int64]) -> Voxel:
    return int(indices[0]), int(indices[1]), int(indices[2])


def _cheapest(lumen: VoxelLumen, depth: Array, first: Voxel, last: Voxel, power: float) -> NDArray[np.int64]:
    """Voxels (n, 3) of the path of least cost; each is a neighbour of the previous one, at a face, edge or corner."""
    from skimage.graph import MCP_Geometric  # imported here: slow to load

    wall = np.maximum(depth, 0.5 * lumen.voxel_mm)
    cost = np.where(lumen.inside, (_OPEN_MM / wall) ** power, -1.0)
    paths = MCP_Geometric(cost, sampling=(lumen.voxel_mm,) * 3)
    paths.find_costs([first], [last])
    return np.array(paths.traceback(last))


def _smoothed(path: Array, smooth_mm: float) -> Array:
    """Resample the path (m, 3) at about 1 mm and smooth it; its ends are fixed."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    samples = np.linspace(0.0, along[-1], max(math.ceil(along[-1] / _SAMPLE_MM), 1) + 1)
    points = np.column_stack([np.interp(samples, along, path[:, k]) for k in range(3)])
    if smooth_mm == 0.0 or len(points) < 3:
        return points
    step = along[-1] / (len(points) - 1)
    return smoothed_between_ends(points, smooth_mm / step)


def smoothed_between_ends(points: Array, deviation: float) -> Array:
    """Smooth points (m, 3) with a Gaussian of that many points; the ends are fixed, and a straight line is invariant.

    Each end is extended by the point reflection of as much of the row as the Gaussian reaches, or as there is.
    """
    from scipy.ndimage import gaussian_filter1d  # imported here: slow to load

    more = min(math.ceil(4.0 * deviation), len(points) - 1)
    before = 2.0 * points[0] - points[more:0:-1]
    after = 2.0 * points[-1] - points[-2 : -2 - more : -1]
    smooth: Array = gaussian_filter1d(np.concatenate([before, points, after]), deviation, axis=0, mode="nearest")
    return smooth[more : more + len(points)]
