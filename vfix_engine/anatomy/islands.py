"""Connected components (islands) of a segmentation, at the scan's own or at a coarser resolution."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vfix_engine.anatomy.segmentation import Band, SegmentRequest, crop_of, leave_out, level_of, region_of
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume
from vfix_engine.progress import ProgressCallback, no_progress

from ..arrays import BoolArray


@dataclass(frozen=True, eq=False)
class Islands:
    """The islands of a threshold that are kept.

    mask: (K, J, I) bool on every `step`-th voxel of the scan along each axis, from the first. volume_mm3: of the kept
    islands. islands, left_out: total number, and number of those left out; all at that step.
    """

    mask: BoolArray
    step: int
    volume_mm3: float
    islands: int
    left_out: int


def islands(
    volume: Volume,
    request: SegmentRequest,
    step: int = 1,
    inside: BoolArray | None = None,
    tell: ProgressCallback = no_progress,
) -> Islands:
    """Return the voxels whose surface `segment` extracts, before smoothing.

    step: 1 for every voxel, 2 for half the resolution, which takes an eighth of the time but can join or separate
    islands where bone is thinner than two voxels. inside: the result of `region_at`, if already known.

    Raises ImageError as `segment` does.
    """
    if step < 1 or min(volume.hu.shape) < 2 * step:
        raise ImageError(f"the scan cannot be looked at in steps of {step} voxels.")
    tell("Choosing the voxels", 0.0)
    inside = region_at(volume, request.band, step) if inside is None else inside
    coarse = _thinned(volume, step)
    part = crop_of(coarse, request.crop_mm)
    cut = replace(coarse, hu=coarse.hu[part], origin=coarse.index_to_lps([each.start for each in part[::-1]]))
    within = None if inside is None else inside[part]
    level = level_of(cut, request.band, within)
    tell("Telling the islands apart", 0.3)
    count, left_out = leave_out(level, cut, request)
    mask = np.zeros(coarse.hu.shape, dtype=bool)
    mask[part] = level >= 0
    return Islands(mask, step, float(mask.sum() * np.prod(coarse.spacing)), count, left_out)


def region_at(volume: Volume, band: Band, step: int) -> BoolArray | None:
    """Mask to which a band is restricted, on every `step`-th voxel; None for the whole scan."""
    if band.region != "all":
        return region_of(_thinned(volume, step), band)
    whole = region_of(volume, band)
    return None if whole is None else whole[::step, ::step, ::step]


def _thinned(volume: Volume, step: int) -> Volume:
    """Return the volume of every `step`-th voxel along each axis."""
    return Volume(volume.hu[::step, ::step, ::step], volume.origin, volume.spacing * step, volume.direction)
