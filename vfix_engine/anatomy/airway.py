"""Segmentation of the air in the body, as opposed to the air of the room.

Nostrils and mouth connect both, so no threshold separates them. On a grid of about 2 mm the body is closed by 8 mm, and
its holes are filled slice by slice. That includes air of the room as well: in grooves of the skin, behind the ears,
beside a head rest. So both airs are flooded from where they are certain, the widest places first, and meet where the
passage between them is narrowest, as in the nostrils; a groove has no air of the body behind it, and is the room's.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.files.volume import Volume

CLOSING_MM = 8.0
DEEP_MM = 6.0  # depth below the closed body's border at which air certainly belongs to the body
FILM_MM = 3.0  # thickness of air on the skin that the coarse grid classifies as skin
_STEP_MM = 2.0
_ROOM, _BODY, _TISSUE = 1, 2, 3


def inner_air(volume: Volume, air_hu: float = TISSUE_HU) -> BoolArray:
    """Mask (K, J, I) of air in the body: below `air_hu`, and in the closed body.

    The scan ends within the body at its first and last slices, so no padding is added there.
    """
    inside: BoolArray = (volume.hu < air_hu) & body(volume)
    return inside


def body(volume: Volume) -> BoolArray:
    """Mask (K, J, I) of the body including its air, bounded at nostrils and mouth, accurate to about 3 mm."""
    from scipy import ndimage  # imported here: slow to load

    step = np.maximum(np.rint(_STEP_MM / volume.spacing).astype(int), 1)  # i, j, k
    coarse = volume.hu[:: step[2], :: step[1], :: step[0]] >= TISSUE_HU
    sampling = (volume.spacing * step)[::-1]
    pad = [int(np.ceil(CLOSING_MM / size)) + 1 for size in sampling]
    # Beyond the sides there is air; beyond the ends the body continues, and so does the air above a head.
    solid = np.pad(np.pad(coarse, [(0, 0), *((n, n) for n in pad[1:])]), [(pad[0], pad[0]), (0, 0), (0, 0)], "edge")
    inner = _without_room(solid, sampling)[tuple(slice(n, -n) for n in pad)]
    shape = volume.hu.shape
    rows = [np.minimum((np.arange(shape[n]) + step[2 - n] // 2) // step[2 - n], inner.shape[n] - 1) for n in range(3)]
    whole: BoolArray = inner[np.ix_(*rows)]
    air = volume.hu < TISSUE_HU
    deep = int(np.ceil(FILM_MM / volume.spacing.min()))
    found: BoolArray = whole & ~ndimage.binary_dilation(air & ~whole, mask=air, iterations=deep)
    return found


def _without_room(solid: BoolArray, sampling: Array) -> BoolArray:
    """Tissue and its air (K, J, I): the part of the closed body that is flooded from its depth, not from the room."""
    from scipy import ndimage  # as above

    to_tissue = ndimage.distance_transform_edt(~solid, sampling=sampling)
    grown = to_tissue <= CLOSING_MM
    closed = ndimage.distance_transform_edt(grown, sampling=sampling) > CLOSING_MM
    closed |= solid
    for plane in closed:
        ndimage.binary_fill_holes(plane, output=plane)
    border = np.zeros_like(solid)
    border[:, [0, -1]] = border[:, :, [0, -1]] = True
    marks = np.zeros(solid.shape, np.int8)
    marks[ndimage.distance_transform_edt(closed, sampling=sampling) > DEEP_MM] = _BODY
    marks[~closed | ndimage.binary_propagation(border & ~solid, mask=~grown)] = _ROOM
    marks[solid] = _TISSUE
    narrow = 254.0 * (1.0 - np.minimum(to_tissue / CLOSING_MM, 1.0))
    flooded = ndimage.watershed_ift(np.where(solid, 255, np.rint(narrow)).astype(np.uint8), marks)
    inner: BoolArray = closed & (flooded != _ROOM)
    return inner
