"""Regions of a CT with tissue that a threshold alone cannot find: the mucosa, and thin sheets between two air spaces.

A sheet of bone thinner than a voxel loses its density to the air on both sides: below about 0.5 mm no threshold of bone
finds it. The tissue between the two borders of air is still visible.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.airway import body
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.files.volume import Volume

from ..arrays import BoolArray

MUCOSA_MM = 3.0  # largest distance from air: deeper tissue is other soft tissue
FILM_MM = 2.5  # thickness of the room's air on the skin
SHEET_MM = 5.0  # includes mucosa on both sides of a thin bone


def near_air(volume: Volume, within_mm: float = MUCOSA_MM) -> BoolArray:
    """Mask (K, J, I) within that distance in mm of air in the body; its soft tissue is mucosa."""
    from scipy import ndimage  # imported here: slow to load

    air = _airways(volume)[0]
    if not air.any():
        return np.zeros(volume.hu.shape, dtype=bool)
    near: BoolArray = ndimage.distance_transform_edt(~air, sampling=volume.spacing[::-1]) <= within_mm
    return near


def sheets_between_air(volume: Volume, thinner_mm: float = SHEET_MM) -> BoolArray:
    """Mask (K, J, I) of the body in sheets thinner than `thinner_mm` that have air on both sides.

    It is what a morphological closing of the air by half that thickness adds. Sharp ridges of tissue are included as
    well. A sheet that appears as air in the scan, below −300 HU, is not found.
    """
    from scipy import ndimage  # as above

    air, inner = _airways(volume)
    sampling, half = volume.spacing[::-1], 0.5 * thinner_mm
    if not air.any():
        return np.zeros(volume.hu.shape, dtype=bool)
    grown = ndimage.distance_transform_edt(~air, sampling=sampling) <= half
    # Air at the end of the scan continues beyond it.
    closed = ndimage.distance_transform_edt(np.pad(grown, 1, mode="edge"), sampling=sampling)[1:-1, 1:-1, 1:-1] > half
    found: BoolArray = closed & ~air & inner
    return found


def _airways(volume: Volume) -> tuple[BoolArray, BoolArray]:
    """Air (K, J, I) that is too deep in the body to be the room's, and the body's voxels."""
    from scipy import ndimage  # as above

    inner = body(volume)
    # The body's border is accurate to a step of its coarse grid: air nearer to it may be a film on the skin.
    deep = ndimage.distance_transform_edt(np.pad(inner, 1, mode="edge"), sampling=volume.spacing[::-1])
    air: BoolArray = (volume.hu < TISSUE_HU) & (deep[1:-1, 1:-1, 1:-1] > FILM_MM)
    return air, inner
