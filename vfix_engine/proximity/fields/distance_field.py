"""Signed distance fields of solids such as bone or soft tissue, on a fine grid within a coarse one.

A field evaluates a point in about 20 ns and ranks many poses; `ProximityTree` measures the few remaining ones exactly.
Lengths in mm, positions in the patient frame (LPS).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from ...errors import InputError
from ...geometry.checks import checked_points
from ..proximity import Proximity
from .distance_kernels import border_feet, distances, interpolate, limit, spread
from .side import SurfaceSide

LevelFunction = Callable[[Array], Array]
GridShape = tuple[int, int, int]

MOST_POINTS = 400_000_000  # of a grid: a larger one results from a wrong step, or from a region larger than a head
_BLOCK = 8  # grid steps of the blocks in which the border of a surface is searched
_BAND = 1.75  # [grid step] grid points this near to a surface are measured exactly; more than a cell's diagonal
# [grid step] radius of the disc of border that a border point represents: half the distance between two of them
_DISC = 0.35
_SLAB_POINTS = 1_000_000  # points at which a level function is evaluated at once


@dataclass(frozen=True, eq=False)
class FieldGrid:
    """One cubic grid of a field.

    values: (K, J, I) float32 signed distances [mm], indexed [k, j, i] along z, y, x; NaN where unknown; read-only.
    origin: (3,) LPS position [mm] of the point (0, 0, 0). step_mm: grid spacing.

    Raises InputError for another shape or a step that is not positive.
    """

    values: NDArray[np.float32]
    origin: Array
    step_mm: float

    def __post_init__(self) -> None:
        values = np.ascontiguousarray(self.values, dtype=np.float32).view()
        origin = np.array(self.origin, dtype=np.float64)
        if values.ndim != 3 or min(values.shape) < 2:
            raise InputError(f"a distance field needs three axes of at least two points, not the shape {values.shape}")
        if origin.shape != (3,) or not np.isfinite(origin).all() or not 0.0 < self.step_mm < np.inf:
            raise InputError("a distance field needs a finite origin (3,) and a positive step in mm")
        for array in (values, origin):
            array.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "origin", origin)

    @property
    def bounds(self) -> Array:
        """(2, 3) smallest and largest LPS coordinates [mm] of the grid's points."""
        last = self.step_mm * (np.array(self.values.shape[::-1]) - 1.0)
        return np.stack([self.origin, self.origin + last])


class DistanceField:
    """Signed distance to the border of a solid: positive outside, negative inside, NaN where unknown.

    Args:
        grids: finest first; a point is evaluated by the first grid that knows it.

    It is the distance to the known part of the solid: beyond the end of a scan there may be a nearer part.

    Raises:
        InputError: there is no grid.
    """

    def __init__(self, grids: Sequence[FieldGrid]) -> None:
        if not grids:
            raise InputError("a distance field needs at least one grid")
        self.grids = tuple(grids)

    @property
    def nbytes(self) -> int:
        """Memory of the grids in bytes."""
        return sum(grid.values.nbytes for grid in self.grids)

    def at(self, points: ArrayLike) -> Array:
        """Signed distance (n,) in mm at points (n, 3): positive outside the solid, NaN where unknown.

        Uses trilinear interpolation.

        Raises:
            InputError: points that are not finite or not of that shape.
        """
        return self._interpolated(points, 1)[:, 0]

    def at_with_gradient(self, points: ArrayLike) -> tuple[Array, Array]:
        """Signed distance (n,) in mm and its gradient (n, 3), of about unit length, pointing out of the solid.

        Raises:
            InputError: see `at`.
        """
        found = self._interpolated(points, 4)
        return found[:, 0].copy(), found[:, 1:].copy()

    def _interpolated(self, points: ArrayLike, columns: int) -> Array:
        places = checked_points(points)
        found = np.full((len(places), columns), np.nan)
        for grid in self.grids:
            interpolate(grid.values, grid.origin, float(grid.step_mm), places, found)
        return found


def field_of_level(level: LevelFunction, bounds: ArrayLike, step_mm: float) -> DistanceField:
    """Compute the field of the solid in which a level function is positive, on one grid.

    Args:
        level: returns the level (n,) at points (n, 3) in LPS mm, NaN where unknown. Between two grid points the
            border is the zero of the linear interpolation, where marching cubes places the surface.
        bounds: (2, 3) LPS corners [mm] of the grid. step_mm: grid spacing.

    Raises:
        InputError: the box is empty or far too large for the step, or contains no border of the solid.
    """
    return DistanceField([_level_grid(level, *_placed(bounds, step_mm, None))])


def refined_by_level(field: DistanceField, level: LevelFunction, focus: ArrayLike, step_mm: float) -> DistanceField:
    """Add a finer grid in the box `focus`, (2, 3) LPS corners [mm], in front of the field's other grids.

    Raises:
        InputError: see `field_of_level`; the box is first clipped to that of the field's last grid.
    """
    fine = _level_grid(level, *_placed(focus, step_mm, field.grids[-1].bounds))
    return DistanceField([_within(fine, field), *field.grids])


def field_of_surface(tree: Proximity, bounds: ArrayLike, step_mm: float) -> DistanceField:
    """Compute the field of the solid enclosed by a surface with outward normals, on one grid.

    Grid points next to the surface are measured exactly. Inside and outside are those of `SurfaceSide`: exact for a
    closed surface, else determined by the nearest face. Arguments as in `field_of_level`.

    Raises:
        InputError: the box is empty or far too large for the step, or contains no surface.
    """
    return DistanceField([_surface_grid(tree, *_placed(bounds, step_mm, None))])


def refined_by_surface(field: DistanceField, tree: Proximity, focus: ArrayLike, step_mm: float) -> DistanceField:
    """As `refined_by_level`, for the solid enclosed by a surface."""
    fine = _surface_grid(tree, *_placed(focus, step_mm, field.grids[-1].bounds))
    return DistanceField([_within(fine, field), *field.grids])


def _placed(box: ArrayLike, step: float, within: Array | None) -> tuple[Array, GridShape, float]:
    """Origin (3,), shape (K, J, I) and step of the grid over a box, clipped to the box `within`, if given.

    The points of a clipped grid lie at multiples of the step, so that the distance at a point does not depend on the
    box.
    """
    corners = np.asarray(box, dtype=np.float64)
    if corners.shape != (2, 3) or not np.isfinite(corners).all():
        raise InputError(f"the box of a distance field needs two finite corners (2, 3), not {corners.shape}")
    if not 0.0 < step < np.inf:
        raise InputError(f"the step of a distance field must be positive, not {step} mm")
    low, high = corners
    if within is not None:
        low, high = np.maximum(np.floor(low / step + 1e-6) * step, within[0]), np.minimum(high, within[1])
        low = np.ceil(low / step - 1e-6) * step
    count = np.floor((high - low) / step + 1e-6).astype(np.int64) + 1
    if (count < 2).any():
        raise InputError("the box of a distance field is empty, or smaller than one step")
    if count.astype(np.float64).prod() > MOST_POINTS:
        size = " x ".join(str(n) for n in count)
        raise InputError(f"a distance field of {size} points is too large; take a larger step")
    return low, (int(count[2]), int(count[1]), int(count[0])), float(step)


def _level_grid(level: LevelFunction, origin: Array, shape: GridShape, step: float) -> FieldGrid:
    values = _sampled(level, origin, shape, step)
    nearest = np.empty(shape, np.int32)
    feet = border_feet(values, nearest)
    if not len(feet):
        raise InputError("the solid of a distance field has no border within its box")
    spread(nearest, feet)
    signed = np.where(values > 0.0, np.float32(-1.0), np.float32(1.0)) * distances(nearest, feet, step, _DISC)
    return FieldGrid(np.where(np.isnan(values), np.float32(np.nan), signed), origin, step)


def _sampled(level: LevelFunction, origin: Array, shape: GridShape, step: float) -> NDArray[np.float32]:
    """Evaluate the level function at the points of a grid (K, J, I), slab by slab."""
    z, y, x = (origin[2 - axis] + step * np.arange(shape[axis]) for axis in range(3))
    values = np.empty(shape, np.float32)
    layers = max(1, _SLAB_POINTS // (shape[1] * shape[2]))
    for first in range(0, shape[0], layers):
        part = z[first : first + layers]
        points = np.empty((len(part), shape[1], shape[2], 3))
        points[..., 0], points[..., 1], points[..., 2] = x, y[:, None], part[:, None, None]
        values[first : first + layers] = level(points.reshape(-1, 3)).reshape(points.shape[:3])
    return values


def _surface_grid(tree: Proximity, origin: Array, shape: GridShape, step: float) -> FieldGrid:
    kji, closest = _beside(tree, origin, shape, step)
    if not len(kji):
        raise InputError("no surface lies in the box of the distance field")
    outside = SurfaceSide(tree).outside(origin + step * kji[:, ::-1])
    sign = np.where(outside, np.float32(1.0), np.float32(-1.0))
    nearest = np.full(shape, -1, np.int32)
    own = (kji[:, 0], kji[:, 1], kji[:, 2])
    nearest[own] = np.arange(len(kji), dtype=np.int32)
    feet = np.zeros((len(kji), 6), np.float32)
    feet[:, :3] = (closest - origin) / step
    spread(nearest, feet)
    # The nearest border point propagates only along its own side of the surface, so its sign holds here.
    signs = sign[nearest]
    signs[own] = sign
    return FieldGrid(signs * distances(nearest, feet, step, 0.0), origin, step)


def _beside(tree: Proximity, origin: Array, shape: GridShape, step: float) -> tuple[NDArray[np.int64], Array]:
    """Grid points (m, 3) as k, j, i next to the surface, and their closest surface points (m, 3) in mm.

    Blocks of points are bisected as long as the surface can be near one of their points.
    """
    blocks = [np.arange(0, count, _BLOCK, dtype=np.int64) for count in shape]
    first = np.stack(np.meshgrid(*blocks, indexing="ij"), axis=-1).reshape(-1, 3)
    size = _BLOCK
    while True:
        middle = origin + step * (first[:, ::-1] + 0.5 * (size - 1))
        distance, closest, _ = tree.point_distance(middle)
        near = distance <= step * (_BAND + 0.5 * np.sqrt(3.0) * (size - 1))
        first, closest = first[near], closest[near]
        if size == 1 or not len(first):
            return first, closest
        size //= 2
        corners = size * np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
        first = (first[:, None] + corners).reshape(-1, 3)
        first = first[(first < np.array(shape)).all(axis=1)]


def _within(fine: FieldGrid, whole: DistanceField) -> FieldGrid:
    """Limit the fine grid's distances to those of the whole where the nearest border can lie outside its box."""
    values, limited = np.array(fine.values), np.zeros(fine.values.shape, np.bool_)
    for grid in whole.grids:
        limit(values, fine.origin, float(fine.step_mm), grid.values, grid.origin, float(grid.step_mm), limited)
    return FieldGrid(values, fine.origin, fine.step_mm)
