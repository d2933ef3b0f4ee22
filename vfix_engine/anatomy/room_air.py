"""Segmentation of the air of the room, as opposed to the air in the body, and of what a scan does not show.

Nostrils connect both, so no threshold separates them. The room's air is what a ball of 6 mm can reach from the border
of the scan; the nostrils are narrower, so the ball does not reach wide cavities behind them, such as a sinus.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.way_round_kernel import AIR, ROOM, UNKNOWN
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.files.volume import Volume
from vfix_engine.proximity.fields.distance_field import DistanceField

BALL_MM = 6.0
LEAST_ROOM_MM3 = 20_000.0  # reachable volume of the ball's centre: a windpipe or sinus cut by the scan has less
PADDING_HU = -1100.0  # a constant below this is not air, but the value that marks voxels without a measurement
_STEP_MM = 2.0
_CORNER_SHARE = 0.995  # fraction of equal voxels beyond a scanner's circle above which nothing was measured there


@dataclass(frozen=True, eq=False)
class RoomAir:
    """Classification of air on a grid of about 2 mm.

    kinds: (K, J, I) uint8 of AIR, ROOM and UNKNOWN, where tissue has either of the first two; indexed [k, j, i] along
        z,
    y, x. origin: (3,) LPS position [mm] of the cell (0, 0, 0). step_mm: grid spacing.
    middle_mm: x of the middle of the tissue: a head can be off-centre in its scan.
    """

    kinds: npt.NDArray[np.uint8]
    origin: Array
    step_mm: float
    middle_mm: float

    @property
    def has_room(self) -> bool:
        """Whether the scan shows air of the room."""
        return bool((self.kinds == ROOM).any())


def room_air(tissue: DistanceField, volumes: Sequence[Volume]) -> RoomAir:
    """Classify the air of the room in the scans of one head, the widest first.

    tissue: signed distance to skin, mucosa and bone over the whole scan; its last grid is used.
    """
    from scipy import ndimage  # imported here: slow to load

    grid = tissue.grids[-1]
    every = max(1, round(_STEP_MM / grid.step_mm))
    distance, step = grid.values[::every, ::every, ::every], grid.step_mm * every
    unknown = np.isnan(distance) | _not_scanned(volumes, grid.origin, step, distance.shape)
    core = ~unknown & (distance >= BALL_MM)
    labels, count = ndimage.label(core, np.ones((3, 3, 3)))
    sizes = np.bincount(labels.ravel(), minlength=count + 1) * step**3
    beyond = ndimage.binary_dilation(unknown, np.ones((3, 3, 3)), border_value=1)
    at_border = np.unique(labels[beyond])
    room = np.isin(labels, [n for n in at_border if n and sizes[n] >= LEAST_ROOM_MM3])
    kinds = np.full(distance.shape, AIR, np.uint8)
    if room.any():
        kinds[ndimage.distance_transform_edt(~room, sampling=step) <= BALL_MM] = ROOM
    kinds[unknown] = UNKNOWN
    in_tissue = (~unknown & (distance < 0.0)).sum(axis=(0, 1))
    middle = float(grid.origin[0] + step * np.average(np.arange(len(in_tissue)), weights=in_tissue + 1e-9))
    return RoomAir(kinds, grid.origin, step, middle)


def padding(volume: Volume) -> BoolArray:
    """Mask (K, J, I) of unmeasured voxels: a constant below that of air, and corners beyond a scanner's circle."""
    hu = volume.hu
    found: BoolArray = np.zeros(hu.shape, np.bool_)
    lowest = hu.min()
    if lowest < PADDING_HU:
        from scipy import ndimage  # imported here: slow to load

        found = ndimage.binary_opening(hu == lowest, np.ones((3, 3, 3)))
        found |= ndimage.binary_dilation(found, np.ones((3, 3, 3))) & (hu < PADDING_HU)
    for axis in range(3):
        found |= _corners(hu, axis)
    return found


def _corners(hu: npt.NDArray[np.int16], axis: int) -> BoolArray:
    """Voxels beyond the circle in square slices perpendicular to an axis, if all are equal and the scan ends at it."""
    slices = np.moveaxis(hu, axis, 0)
    none: BoolArray = np.zeros(hu.shape, np.bool_)
    rows, columns = slices.shape[1:]
    if rows != columns or rows < 16:
        return none
    middle = 0.5 * (rows - 1)
    y, x = np.ogrid[:rows, :columns]
    away = np.hypot(y - middle, x - middle)
    outside, rim = away > 0.5 * rows + 1.0, (away < 0.5 * rows - 1.0) & (away > 0.5 * rows - 4.0)
    values, counts = np.unique(slices[:, outside], return_counts=True)
    value = values[counts.argmax()]
    if counts.max() < _CORNER_SHARE * counts.sum() or (slices[:, rim] == value).mean() > _CORNER_SHARE:
        return none
    found = none.copy()
    np.moveaxis(found, axis, 0)[:, outside] = True
    return found


def _not_scanned(volumes: Sequence[Volume], origin: Array, step: float, shape: tuple[int, ...]) -> BoolArray:
    """Cells (K, J, I) of a grid in which none of the scans has measured anything."""
    masks = [(volume, padding(volume)) for volume in volumes]
    found: BoolArray = np.ones(shape, np.bool_)
    y, x = np.meshgrid(*(origin[2 - axis] + step * np.arange(shape[axis]) for axis in (1, 2)), indexing="ij")
    for layer in range(shape[0]):
        places = np.stack([x, y, np.full_like(x, origin[2] + step * layer)], axis=-1).reshape(-1, 3)
        for volume, padded in masks:
            i, j, k = np.rint(volume.lps_to_index(places)).astype(np.intp).T
            top_k, top_j, top_i = padded.shape
            inside = (i >= 0) & (j >= 0) & (k >= 0) & (i < top_i) & (j < top_j) & (k < top_k)
            shown = np.zeros(len(places), np.bool_)
            shown[inside] = ~padded[k[inside], j[inside], i[inside]]
            found[layer] &= ~shown.reshape(shape[1:])
    return found
