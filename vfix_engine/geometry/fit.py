"""Where the tool fits: the nearest place for a ball outside the bone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import PlanError
from .proximity import Proximity

Array = NDArray[np.float64]
Inside = Callable[[Array], NDArray[np.bool_]]

_GRIDS = (1.0, 0.5)  # mm: spacing of the search, coarse first; the finer one finds narrow passages
_MOST = 60.0  # mm: reach of a search at most
_REFINEMENTS = 40


def nearest_place(
    tree: Proximity, point: ArrayLike, clearance: float, *, inside_bone: Inside | None, max_move: float = 30.0
) -> Array:
    """The place (3,) nearest to ``point`` (3,) where a ball of radius ``clearance`` (mm) touches no bone.

    Args:
        inside_bone: for points (n, 3), whether they lie in bone, from an image or by `side`; without it only
            the surface's distance counts.
        max_move: how far from the point the place may be, in mm.

    Places are searched on shells of growing radius and the first that fits is drawn towards the point as far as it
    still fits, so the answer is near the nearest place, to about the spacing of the shells, and always fits.

    Raises:
        PlanError: no such place within ``max_move``, or the point is not finite.
    """
    target = np.array(point, dtype=np.float64)
    if target.shape != (3,) or not np.isfinite(target).all():
        raise PlanError(f"the point {target} must be three finite coordinates in mm")
    if not 0.0 < clearance <= _MOST or not 0.0 <= max_move <= _MOST:
        raise PlanError(f"cannot search room of {clearance:g} mm within {max_move:g} mm; both are at most {_MOST:g} mm")

    def fits(places: Array) -> NDArray[np.bool_]:
        good = tree.point_distance(places)[0] >= clearance
        if inside_bone is not None and good.any():
            good[good] = ~np.asarray(inside_bone(places[good]), dtype=bool)
        return good

    if fits(target[None])[0]:
        return target
    for spacing in _GRIDS:
        offsets = _shells(spacing, max_move)
        found = _first(target, offsets, fits)
        if found is not None:
            return _drawn_in(target, found, fits)
    raise PlanError(
        f"no room of {clearance:g} mm around a point within {max_move:g} mm of it; choose a point nearer to the air"
    )


def _shells(spacing: float, reach: float) -> Array:
    """Offsets (n, 3) of a cubic grid inside the ball of radius ``reach``, nearest first, in a fixed order."""
    half = int(reach / spacing)
    steps = np.arange(-half, half + 1) * spacing
    grid: Array = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    size = np.einsum("ij,ij->i", grid, grid)
    near = size <= reach * reach
    grid = grid[near]
    return grid[np.argsort(size[near], kind="stable")]


def _first(target: Array, offsets: Array, fits: Callable[[Array], NDArray[np.bool_]]) -> Array | None:
    """The first of the places that fits, asked for in growing batches."""
    at, batch = 0, 256
    while at < len(offsets):
        places = target + offsets[at : at + batch]
        good = np.flatnonzero(fits(places))
        if len(good):
            place: Array = places[good[0]]
            return place
        at, batch = at + batch, min(2 * batch, 16384)
    return None


def _drawn_in(target: Array, place: Array, fits: Callable[[Array], NDArray[np.bool_]]) -> Array:
    """The place, moved straight towards the target as long as it fits."""
    low, high = 0.0, 1.0  # share of the displacement back from the place; ``low`` always fits
    for _ in range(_REFINEMENTS):
        middle = 0.5 * (low + high)
        if fits((place + middle * (target - place))[None])[0]:
            low = middle
        else:
            high = middle
    return place + low * (target - place)
