"""Solids of a CT as signed distance fields: bone, soft tissue, labels; LPS mm."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.sampling import sample_points
from vfix_engine.files.volume import Volume
from vfix_engine.proximity.fields.distance_field import DistanceField, field_of_level, refined_by_level

FINE_MM = 0.5  # spacing of the grid around the plan
COARSE_MM = 1.0  # spacing of the grid over the whole scan
_LABEL = 1000  # value of a label's voxels as an integer, so that its border lies at half of it


def solid_of_volumes(
    volumes: Sequence[Volume], threshold_hu: float, focus: npt.ArrayLike | None = None
) -> DistanceField:
    """Signed distance to tissue denser than `threshold_hu`, on a grid of 1 mm; NaN beyond the widest scan.

    volumes: scans of one head, the widest first. Where several overlap, the one with the finest voxels is used.
    focus: (2, 3) LPS corners [mm] of a box with an additional grid of 0.5 mm; None for none.

    Raises ImageError without a volume, and InputError if nothing or everything is denser, or the focus lies outside.
    """
    if not volumes:
        raise ImageError("a solid needs a CT.")
    coarse = field_of_level(_level(volumes, threshold_hu), volumes[0].bounds, COARSE_MM)
    return coarse if focus is None else refined_solid(coarse, volumes, threshold_hu, focus)


def refined_solid(
    solid: DistanceField, volumes: Sequence[Volume], threshold_hu: float, focus: npt.ArrayLike
) -> DistanceField:
    """Add a grid of 0.5 mm in the box `focus`, (2, 3) LPS corners [mm]; arguments as for the solid itself."""
    return refined_by_level(solid, _level(volumes, threshold_hu), focus, FINE_MM)


def solid_of_label(
    label: npt.NDArray[np.bool_],
    transform_index_to_lps: npt.ArrayLike,
    focus: npt.ArrayLike | None = None,
) -> DistanceField:
    """Signed distance to a label: mask (K, J, I), and the (4, 4) affine from (i, j, k) to LPS mm; spacings as above.

    The border is half-way between the centres of a voxel inside and one outside. NaN beyond the mask's voxels.

    Raises InputError for a label without a border.
    """
    affine = np.asarray(transform_index_to_lps, dtype=np.float64)
    to_index = np.linalg.inv(affine[:3, :3]).astype(np.float64)
    values = np.where(label, _LABEL, 0).astype(np.int16)
    last = np.array(values.shape[::-1], dtype=np.float64) - 1.0
    corners = np.stack(np.meshgrid(*zip(np.zeros(3), last, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    placed = corners @ affine[:3, :3].T + affine[:3, 3]

    def level(points: Array) -> Array:
        return sample_points(values, points, affine[:3, 3], to_index, np.nan) - 0.5 * _LABEL

    coarse = field_of_level(level, np.stack([placed.min(axis=0), placed.max(axis=0)]), COARSE_MM)
    return coarse if focus is None else refined_by_level(coarse, level, focus, FINE_MM)


def _level(volumes: Sequence[Volume], threshold_hu: float) -> Callable[[Array], Array]:
    """HU above the threshold at points (n, 3); NaN beyond the scans."""
    finest = sorted(volumes, key=lambda volume: float(volume.spacing.prod()))

    def level(points: Array) -> Array:
        hu = finest[0].sample(points, outside=np.nan)
        for volume in finest[1:]:
            unknown = np.isnan(hu)
            if not unknown.any():
                break
            hu[unknown] = volume.sample(points[unknown], outside=np.nan)
        return hu - threshold_hu

    return level
