"""Air within the body, told from the air of the room.

Nostrils and mouth join both airs, so no threshold parts them. The body is closed by 8 mm on a grid of about 2 mm, and
its holes are filled slice by slice; air in that is air within.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.arrays import BoolArray
from vfix_engine.files.volume import Volume

CLOSING_MM = 8.0
_STEP_MM = 2.0


def inner_air(volume: Volume, air_hu: float = TISSUE_HU) -> BoolArray:
    """Voxels (K, J, I) of air within the body: below `air_hu`, and in the closed body.

    The scan ends through the body at its first and last slices, so nothing is added there.
    """
    inside: BoolArray = (volume.hu < air_hu) & body(volume)
    return inside


def body(volume: Volume) -> BoolArray:
    """Voxels (K, J, I) of the body with the air in it, closed over nostrils and mouth to about 2 mm."""
    from scipy import ndimage  # imported here: slow to load

    step = np.maximum(np.rint(_STEP_MM / volume.spacing).astype(int), 1)  # i, j, k
    coarse = volume.hu[:: step[2], :: step[1], :: step[0]] >= TISSUE_HU
    sampling = (volume.spacing * step)[::-1]
    pad = [(0, 0)] + [(int(np.ceil(CLOSING_MM / size)) + 1,) * 2 for size in sampling[1:]]
    solid = np.pad(coarse, pad)
    grown = ndimage.distance_transform_edt(~solid, sampling=sampling) <= CLOSING_MM
    # Beyond the sides lies air, so what was grown shrinks from there; beyond the ends the body goes on.
    closed = ndimage.distance_transform_edt(grown, sampling=sampling) > CLOSING_MM
    closed |= solid
    for plane in closed:
        ndimage.binary_fill_holes(plane, output=plane)
    inner = closed[:, pad[1][0] : -pad[1][1], pad[2][0] : -pad[2][1]]
    shape = volume.hu.shape
    rows = [np.minimum((np.arange(shape[n]) + step[2 - n] // 2) // step[2 - n], inner.shape[n] - 1) for n in range(3)]
    whole: BoolArray = inner[np.ix_(*rows)]
    return whole
