"""Islands of a segmentation as voxels: what is kept of a threshold, at the scan's own or at a coarser step."""

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
    """What of a threshold is kept.

    mask: (K, J, I) bool on every `step`-th voxel of the scan along each axis, from the first. volume_mm3: of what is
    kept. islands, left_out: how many there are, and how many were left out; all at that step.
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
    """The voxels that `segment` makes a surface of, before it smooths.

    step: 1 for every voxel, 2 for half the resolution, which takes an eighth of the time and may join or part islands
    where bone is thinner than two voxels. inside: what `region_at` gives, where it is known already.

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
    """Voxels that a band is looked for in, on every `step`-th voxel; None where that is the whole scan."""
    if band.region != "all":
        return region_of(_thinned(volume, step), band)
    whole = region_of(volume, band)
    return None if whole is None else whole[::step, ::step, ::step]


def _thinned(volume: Volume, step: int) -> Volume:
    """The volume of every `step`-th voxel along each axis."""
    return Volume(volume.hu[::step, ::step, ::step], volume.origin, volume.spacing * step, volume.direction)
