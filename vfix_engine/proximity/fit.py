"""Nearest point at which a ball fits outside the bone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import PlanError
from .proximity import Proximity

InsideTest = Callable[[Array], NDArray[np.bool_]]

_GRIDS = (1.0, 0.5)  # mm, spacings of the search: coarse first, the finer one finds narrow passages
_LARGEST_MM = 60.0  # largest ``clearance`` and ``max_move``
_REFINEMENTS = 40


def nearest_free_point(
    tree: Proximity, point: ArrayLike, clearance: float, *, inside_bone: InsideTest | None, max_move: float = 30.0
) -> Array:
    """Return the point (3,) nearest to ``point`` (3,) at which a ball of radius ``clearance`` mm touches no bone.

    Grid points are tested in the order of their distance; the first that fits is then moved towards ``point`` by
    bisection. The result always fits and is the nearest up to about the grid spacing, 0.5 or 1 mm.

    Args:
        tree: of the bone surface.
        point, clearance: in mm, patient frame.
        inside_bone: maps points (n, 3) to a mask (n,) of those inside bone, from an image or ``side.py``;
            None: only the distance from the surface is tested.
        max_move: largest distance from ``point`` in mm.

    Raises:
        PlanError: there is no such point within ``max_move``, or ``point`` is not finite.
    """
    target = np.array(point, dtype=np.float64)
    if target.shape != (3,) or not np.isfinite(target).all():
        raise PlanError(f"the point {target} must be three finite coordinates in mm")
    if not 0.0 < clearance <= _LARGEST_MM or not 0.0 <= max_move <= _LARGEST_MM:
        raise PlanError(
            f"a clearance of {clearance:g} mm within {max_move:g} mm is not searched for; both are at most "
            f"{_LARGEST_MM:g} mm"
        )

    def fits(places: Array) -> NDArray[np.bool_]:
        good = tree.point_distance(places)[0] >= clearance
        if inside_bone is not None and good.any():
            good[good] = ~np.asarray(inside_bone(places[good]), dtype=bool)
        return good

    if fits(target[None])[0]:
        return target
    for spacing in _GRIDS:
        offsets = _offsets_by_distance(spacing, max_move)
        found = _first_fit(target, offsets, fits)
        if found is not None:
            return _closest_fit(target, found, fits)
    raise PlanError(
        f"no point within {max_move:g} mm has a clearance of {clearance:g} mm; choose a point nearer to the air"
    )


def _offsets_by_distance(spacing: float, reach: float) -> Array:
    """Offsets (n, 3) of a cubic grid inside the ball of radius ``reach``, nearest first, in a deterministic order."""
    half = int(reach / spacing)
    steps = np.arange(-half, half + 1) * spacing
    grid: Array = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    size = np.einsum("ij,ij->i", grid, grid)
    near = size <= reach * reach
    grid = grid[near]
    return grid[np.argsort(size[near], kind="stable")]


def _first_fit(target: Array, offsets: Array, fits: Callable[[Array], NDArray[np.bool_]]) -> Array | None:
    """Return the first point that fits; tested in growing batches."""
    at, batch = 0, 256
    while at < len(offsets):
        places = target + offsets[at : at + batch]
        good = np.flatnonzero(fits(places))
        if len(good):
            place: Array = places[good[0]]
            return place
        at, batch = at + batch, min(2 * batch, 16384)
    return None


def _closest_fit(target: Array, place: Array, fits: Callable[[Array], NDArray[np.bool_]]) -> Array:
    """Move the point straight towards the target as far as it fits, by bisection."""
    low, high = 0.0, 1.0  # fraction of the displacement back to the given point; ``low`` always fits
    for _ in range(_REFINEMENTS):
        middle = 0.5 * (low + high)
        if fits((place + middle * (target - place))[None])[0]:
            low = middle
        else:
            high = middle
    return place + low * (target - place)
