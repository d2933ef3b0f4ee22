"""Where in a CT a tissue is looked for that no threshold alone tells: the mucosa, and thin sheets between two airs.

A sheet of bone that is thinner than a voxel loses its density to the air on both sides: below about 0.5 mm no threshold
of bone shows it. What still shows is the tissue between the two borders of air.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.airway import body
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.files.volume import Volume

from ..arrays import BoolArray

MUCOSA_MM = 3.0  # from the air: what lies deeper is other soft tissue
FILM_MM = 2.5  # of the room's air on the skin
SHEET_MM = 5.0  # mucosa on both sides of a thin bone included


def near_air(volume: Volume, within_mm: float = MUCOSA_MM) -> BoolArray:
    """Voxels (K, J, I) within so many mm of air within the body; mucosa is the soft tissue among them."""
    from scipy import ndimage  # imported here: slow to load

    air = _airways(volume)[0]
    if not air.any():
        return np.zeros(volume.hu.shape, dtype=bool)
    near: BoolArray = ndimage.distance_transform_edt(~air, sampling=volume.spacing[::-1]) <= within_mm
    return near


def sheets_between_air(volume: Volume, thinner_mm: float = SHEET_MM) -> BoolArray:
    """Voxels (K, J, I) of the body in sheets thinner than `thinner_mm` that have air on both sides.

    They are what a closing of the air by half that thickness takes in. Sharp ridges of tissue are taken in as well.
    A sheet that the scan shows as air, below −300 HU, is not found.
    """
    from scipy import ndimage  # as above

    air, inner = _airways(volume)
    sampling, half = volume.spacing[::-1], 0.5 * thinner_mm
    if not air.any():
        return np.zeros(volume.hu.shape, dtype=bool)
    grown = ndimage.distance_transform_edt(~air, sampling=sampling) <= half
    # Air that ends with the scan goes on beyond it.
    closed = ndimage.distance_transform_edt(np.pad(grown, 1, mode="edge"), sampling=sampling)[1:-1, 1:-1, 1:-1] > half
    found: BoolArray = closed & ~air & inner
    return found


def _airways(volume: Volume) -> tuple[BoolArray, BoolArray]:
    """Air (K, J, I) that lies deep enough in the body to be none of the room's, and the body's voxels."""
    from scipy import ndimage  # as above

    inner = body(volume)
    # The body's border is known to a step of its coarse grid: what lies nearer to it is a film of air on the skin.
    deep = ndimage.distance_transform_edt(np.pad(inner, 1, mode="edge"), sampling=volume.spacing[::-1])
    air: BoolArray = (volume.hu < TISSUE_HU) & (deep[1:-1, 1:-1, 1:-1] > FILM_MM)
    return air, inner
