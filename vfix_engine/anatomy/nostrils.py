"""The nostrils of a head in its CT: where the air of the room meets that of the nose.

`airway.body` ends the air of the body where its passage to the room is narrowest. Of all such borders, a nostril is a
small one at the front of the head, with air behind it that leads up. A mouth is below the palate, and ears are far from
the front; the gap between a head and its rest is large, and a groove of the skin has hardly any air behind it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.airway import CLOSING_MM, body
from vfix_engine.anatomy.room_air import padding
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.files.volume import Volume
from vfix_engine.progress import ProgressCallback, no_progress

Side = Literal["left", "right", ""]

LEAST_AIR_MM3 = 3000.0  # of one connected air behind a nostril: a nose with its sinuses has 30 to 100 cm³
AREA_MM2 = (10.0, 300.0)
RADIUS_MM = (1.0, 9.0)
FROM_FRONT_MM = 28.0  # of the foremost tissue around a nostril, which is the tip of the nose
# Height above it that air reaches within `_AROUND_MM`: 28 to 34 mm of nostrils, to 26 mm of a mouth, below the palate.
# Two that are beside each other are less in doubt.
LEADS_UP_MM, ALONE_LEADS_UP_MM = 20.0, 27.0
APART_MM = (6.0, 40.0)  # of both nostrils along x
LEVEL_MM = 12.0  # largest difference of their heights, and of their distances from the front
BESIDE_TIP_MM = 2.0  # a single nostril is on a side of the nose's tip if it is farther from its middle
_FINE_ENOUGH_MM = 1.0  # finer voxels are skipped where those left are no larger
_INWARD_MM, _AROUND_MM, _TIP_MM = 10.0, 40.0, 12.0
_END_MM = CLOSING_MM + 2.0  # nearer to an end of the scan it can be the end that opens the airway
_STAGE = "Finding the nostrils"
_AIR_KNOWN, _BODY_KNOWN = 0.9, 0.8  # fractions of the time, of all and of that before, on the synthetic head
_ALL = np.ones((3, 3, 3), np.bool_)


@dataclass(frozen=True, eq=False)
class Nostril:
    """A nostril: the largest ball of air in it.

    side: of the patient, '' where it cannot be told. position: (3,) its centre, LPS [mm]. inward: (3,) unit vector to
    the air behind it. radius_mm: of the ball.
    """

    side: Side
    position: Array
    inward: Array
    radius_mm: float


@dataclass(frozen=True, eq=False)
class _Airs:
    """Masks (K, J, I): tissue of the head, all air, air of the room, that of the body, and what was not measured.

    connected: (K, J, I) number of each connected air of the body; sizes_mm3 by that number.
    """

    volume: Volume
    tissue: BoolArray
    air: BoolArray
    room: BoolArray
    unmeasured: BoolArray
    connected: npt.NDArray[np.int32]
    sizes_mm3: Array


def nostrils_of_volume(volume: Volume, *, progress: ProgressCallback = no_progress) -> tuple[Nostril, ...]:
    """Find the nostrils, the right one first: two, one, or none where the scan does not show them."""
    from scipy import ndimage  # imported here: slow to load

    progress(_STAGE, 0.0)
    airs = _airs(volume, lambda share: progress(_STAGE, _AIR_KNOWN * share))
    progress(_STAGE, _AIR_KNOWN)
    at_room = ndimage.binary_dilation(airs.room) & (airs.connected > 0)
    borders, _ = ndimage.label(at_room, _ALL)
    boxes, found = _boxes(borders), list[tuple[Nostril, float]]()
    for n, box in boxes:
        progress(_STAGE, _AIR_KNOWN + (1.0 - _AIR_KNOWN) * n / (len(boxes) + 1))
        indices = np.argwhere(borders[box] == n) + [part.start for part in box]
        if (one := _nostril(airs, indices)) is not None:
            found.append(one)
    alone = [nostril for nostril, leads_up in found if leads_up >= ALONE_LEADS_UP_MM]
    return _pair([nostril for nostril, _ in found]) or _single(airs, alone)


def _airs(volume: Volume, tell: Callable[[float], None]) -> _Airs:
    from scipy import ndimage  # as above

    steps = np.maximum(np.floor(_FINE_ENOUGH_MM / volume.spacing + 1e-9).astype(int), 1)
    hu = volume.hu[tuple(slice(None, None, int(step)) for step in steps[::-1])]
    coarse = Volume(hu, volume.origin, volume.spacing * steps, volume.direction)
    air = hu < TISSUE_HU
    inner = air & body(coarse)
    tell(_BODY_KNOWN)
    connected, _ = ndimage.label(inner)
    parts, count = ndimage.label(~air, _ALL)
    tissue = parts == np.bincount(parts.ravel())[1:].argmax() + 1 if count else ~air
    sizes: Array = np.bincount(connected.ravel()) * np.prod(coarse.spacing)
    return _Airs(coarse, tissue, air, air & ~inner, padding(coarse), connected, sizes)


def _boxes(labels: npt.NDArray[np.int32]) -> list[tuple[int, tuple[slice, ...]]]:
    from scipy import ndimage  # as above

    return list(enumerate(ndimage.find_objects(labels), 1))


def _nostril(airs: _Airs, border: npt.NDArray[np.intp]) -> tuple[Nostril, float] | None:
    """The nostril whose border to the room has these voxels (n, 3), as k, j, i; None where it is none.

    Also returns the height [mm] above it that air reaches around it.
    """
    from scipy import ndimage  # as above

    numbers = np.unique(airs.connected[tuple(border.T)])
    behind = numbers[airs.sizes_mm3[numbers].argmax()]
    border = border[airs.connected[tuple(border.T)] == behind]  # others may touch it corner to corner
    if airs.sizes_mm3[behind] < LEAST_AIR_MM3 or not AREA_MM2[0] <= _area(airs, border) <= AREA_MM2[1]:
        return None
    spacing = airs.volume.spacing[::-1]
    box = _box_around(border, _AROUND_MM / spacing, airs.air.shape)
    start = np.array([part.start for part in box])
    clear = ndimage.distance_transform_edt(airs.air[box], sampling=spacing)[tuple((border - start).T)]
    centre = border[clear.argmax()]
    radius = float(clear.max() - 0.5 * spacing.min())  # tissue begins half a voxel before the centre of its voxel
    if not RADIUS_MM[0] <= radius <= RADIUS_MM[1] or _at_end(airs, centre):
        return None
    position = airs.volume.index_to_lps(centre[::-1])
    tissue = _places(airs.volume, airs.tissue[box], start) - position
    air = airs.connected[box] == behind
    around, behind_it = (
        _places(airs.volume, _near(air, centre - start, spacing, reach), start) - position
        for reach in (_AROUND_MM, _INWARD_MM)
    )
    leads_up = float(around[:, 2].max())
    if leads_up < LEADS_UP_MM or tissue[:, 1].min(initial=0.0) < -FROM_FRONT_MM:
        return None
    inward = behind_it.mean(axis=0)
    return Nostril("", position, inward / np.linalg.norm(inward), radius), leads_up


def _at_end(airs: _Airs, centre: npt.NDArray[np.intp]) -> bool:
    """Whether the scan ends near a voxel, or has measured nothing there."""
    spacing = airs.volume.spacing[::-1]
    from_end = np.minimum(centre, np.array(airs.air.shape) - 1 - centre) * spacing
    near = _box_around(centre[None], _END_MM / spacing, airs.air.shape)
    return bool(from_end.min() < _END_MM or airs.unmeasured[near].any())


def _near(air: BoolArray, centre: npt.NDArray[np.intp], spacing: Array, reach_mm: float) -> BoolArray:
    """Air so near to a voxel that is connected to it there, and not round the palate or the septum."""
    from scipy import ndimage  # as above

    away = np.ogrid[tuple(slice(0, size) for size in air.shape)]
    squares = sum(((axis - at) * size) ** 2 for axis, at, size in zip(away, centre, spacing, strict=True))
    labels, _ = ndimage.label(air & (squares <= reach_mm**2))
    found: BoolArray = labels == labels[tuple(centre)]
    return found


def _area(airs: _Airs, border: npt.NDArray[np.intp]) -> float:
    """Area [mm²] that the rim of a border encloses: the sum of its faces as vectors, so that steps do not add to it."""
    spacing = airs.volume.spacing[::-1]
    total = np.zeros(3)
    for axis in range(3):
        for sign in (-1, 1):
            beside = border.copy()
            beside[:, axis] += sign
            beside = beside[(beside[:, axis] >= 0) & (beside[:, axis] < airs.room.shape[axis])]
            total[axis] += sign * np.count_nonzero(airs.room[tuple(beside.T)]) * spacing.prod() / spacing[axis]
    return float(np.linalg.norm(total))


def _pair(found: Sequence[Nostril]) -> tuple[Nostril, ...]:
    """Two that are beside each other, the highest and of those the widest; none where there are none."""
    pairs = []
    for one, other in combinations(found, 2):
        x, y, z = np.abs(one.position - other.position)
        if APART_MM[0] <= x <= APART_MM[1] and max(y, z) <= LEVEL_MM:
            pairs.append(sorted((one, other), key=lambda nostril: nostril.position[0]))
    if not pairs:
        return ()
    heights = [0.5 * float(one.position[2] + other.position[2]) for one, other in pairs]
    highest = [pair for pair, height in zip(pairs, heights, strict=True) if height >= max(heights) - LEVEL_MM]
    right, left = max(highest, key=lambda pair: min(one.radius_mm for one in pair))
    return replace(right, side="right"), replace(left, side="left")


def _single(airs: _Airs, found: Sequence[Nostril]) -> tuple[Nostril, ...]:
    """The highest one, on the side of the nose's tip; none where there is none."""
    if not found:
        return ()
    one = max(found, key=lambda nostril: nostril.position[2])
    at = np.rint(airs.volume.lps_to_index(one.position))[::-1].astype(np.intp)
    box = _box_around(at[None], _AROUND_MM / airs.volume.spacing[::-1], airs.air.shape)
    around = _places(airs.volume, airs.tissue[box], np.array([part.start for part in box])) - one.position
    tip = around[around[:, 1] <= around[:, 1].min() + _TIP_MM]
    beside = -float(tip[:, 0].mean())
    return (replace(one, side="" if abs(beside) <= BESIDE_TIP_MM else "left" if beside > 0.0 else "right"),)


def _box_around(indices: npt.NDArray[np.intp], margins: Array, shape: tuple[int, ...]) -> tuple[slice, ...]:
    """Slices [k, j, i] of a volume around voxels (n, 3), and so many more on each side."""
    low = np.maximum(indices.min(axis=0) - np.ceil(margins).astype(np.intp), 0)
    high = np.minimum(indices.max(axis=0) + np.ceil(margins).astype(np.intp) + 1, shape)
    return tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))


def _places(volume: Volume, mask: BoolArray, start: npt.NDArray[np.intp]) -> Array:
    """LPS places (n, 3) [mm] of the voxels of a mask that begins at `start`, as k, j, i."""
    return volume.index_to_lps((np.argwhere(mask) + start)[:, ::-1])
