"""What lies beside the head in its CT, such as the shell of a headrest or of a table: thin, large, and no part of it.

Tissue here is all that is denser than -300 HU, a shell of plastic or carbon fibre included. It is thin where a ball of
`THIN_MM` does not fit into it. Ears and nose are thin as well, but small; a thin part that reaches farther than
`LARGEST_THIN_PART_MM` is a plate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.airway import body
from vfix_engine.anatomy.room_air import padding
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import AIR_HU, BONE_HU, Volume

THIN_MM = 8.0
LARGEST_THIN_PART_MM = 150.0  # diagonal of its box: 75 mm of an ear, 126 mm of a nose, 231 mm of a headrest
# A plate that touches the skin is a part of the body there, no deeper than it is thin. Two cells of the coarse grid are
# the error of both depths.
DEEPEST_PLATE_MM = THIN_MM + 4.0
FINE_ENOUGH_MM = 1.0  # finer voxels are skipped where those left are no larger
_COARSE_MM = 2.0
_ALL = np.ones((3, 3, 3), np.bool_)


@dataclass(frozen=True, eq=False)
class BoneOfPlates:
    """Voxels (K, J, I) as dense as bone that belong to plates beside the head.

    pieces: number of connected ones. extent_mm: diagonal of the largest one's box.
    """

    voxels: BoolArray
    pieces: int
    extent_mm: float


def bone_of_plates(volume: Volume) -> BoneOfPlates | None:
    """Pieces as dense as bone that belong to plates beside the head; None without any, and where the head is cut.

    A piece is everything of at least 250 HU that is connected, corner to corner too, so that none is divided. It
    belongs to a plate if more than half of it does, and none of it is deeper than `DEEPEST_PLATE_MM` in the body. The
    largest piece never does. Where the head reaches a side of the scan, a part of it could seem to lie beside it, so
    nothing is told apart there; first and last slices may cut it.
    """
    from scipy import ndimage  # imported here: slow to load

    coarse, fine_steps = every_fine_enough(volume)
    steps, tissue = _coarse_steps(coarse), coarse.hu >= TISSUE_HU
    # Most heads have no such piece, which the tissue alone shows: what lies within the body makes fewer parts thin.
    bone, _ = ndimage.label(coarse.hu >= BONE_HU, _ALL)
    if not _mostly_in(_plates(coarse, tissue, steps), bone).any():
        return None
    solid = _filled(coarse, tissue, steps)
    plates = _plates(coarse, solid, steps) & tissue
    if _reaches_a_side(coarse, largest_part(tissue & ~plates)):
        return None
    inside = np.pad((solid & ~plates)[_every(steps)], 1, "edge")
    depth = ndimage.distance_transform_edt(inside, sampling=(coarse.spacing * steps)[::-1])[1:-1, 1:-1, 1:-1]
    deep = _spread(_spread(depth > DEEPEST_PLATE_MM, tissue.shape, steps), volume.hu.shape, fine_steps)

    bone, _ = ndimage.label(volume.hu >= BONE_HU, _ALL)
    told = _mostly_in(_spread(plates, volume.hu.shape, fine_steps), bone)
    told[np.unique(bone[deep])] = False
    if not told.any():
        return None
    boxes = [box for box, one in zip(ndimage.find_objects(bone), told[1:], strict=True) if one]
    return BoneOfPlates(told[bone], int(told.sum()), max(_diagonal(box, volume.spacing[::-1]) for box in boxes))


def without_surroundings(volume: Volume) -> Volume:
    """Replace by air all tissue that is no part of the head: other bodies, and plates that touch it. For display only.

    Raises ImageError without tissue of some thickness.
    """
    one = _kept(volume, largest_part(volume.hu >= TISSUE_HU))
    tissue, steps = one.hu >= TISSUE_HU, _coarse_steps(volume)
    solid = _filled(one, tissue, steps, largest=True)
    thick = _thick(solid, volume.spacing, steps, largest=True)
    if not thick.any():
        raise ImageError("there is no head in this CT.")
    foreign = _larger_than(LARGEST_THIN_PART_MM, solid & ~thick, volume.spacing[::-1])
    return _kept(one, largest_part(tissue & ~foreign)) if foreign.any() else one


def every_fine_enough(volume: Volume) -> tuple[Volume, npt.NDArray[np.intp]]:
    """Every so many voxels of a volume with voxels of 1 mm or more, and how many along i, j and k."""
    steps = np.maximum(np.floor(FINE_ENOUGH_MM / volume.spacing + 1e-9).astype(np.intp), 1)
    return Volume(volume.hu[_every(steps)], volume.origin, volume.spacing * steps, volume.direction), steps


def _plates(volume: Volume, solid: BoolArray, steps: npt.NDArray[np.intp]) -> BoolArray:
    """Thin parts (K, J, I) of a mask that are too large for an ear or a nose."""
    return _larger_than(LARGEST_THIN_PART_MM, solid & ~_thick(solid, volume.spacing, steps), volume.spacing[::-1])


def _mostly_in(mask: BoolArray, labels: npt.NDArray[np.integer]) -> BoolArray:
    """By its number, 0 included, whether more than half of a component is in a mask; the largest never is."""
    sizes = np.bincount(labels.ravel())
    found: BoolArray = 2 * np.bincount(labels[mask], minlength=len(sizes)) > sizes
    found[0] = False
    found[1 + sizes[1:].argmax() if len(sizes) > 1 else 0] = False
    return found


def _coarse_steps(volume: Volume) -> npt.NDArray[np.intp]:
    return np.maximum(np.rint(_COARSE_MM / volume.spacing).astype(np.intp), 1)


def _filled(volume: Volume, tissue: BoolArray, steps: npt.NDArray[np.intp], *, largest: bool = False) -> BoolArray:
    """Tissue and the air within: walls of airways are thin as well, but not what lies between head and headrest."""
    thick = tissue & _thick(tissue, volume.spacing, steps, largest=largest)
    return tissue | body(_kept(volume, thick)) if thick.any() else tissue


def _kept(volume: Volume, tissue: BoolArray) -> Volume:
    """The volume with air in place of all other tissue."""
    hu = np.where((volume.hu >= TISSUE_HU) & ~tissue, np.int16(AIR_HU), volume.hu)
    return Volume(hu, volume.origin, volume.spacing, volume.direction)


def largest_part(mask: BoolArray) -> BoolArray:
    """The largest component (K, J, I) of a mask, none of an empty one."""
    from scipy import ndimage  # as above

    labels, count = ndimage.label(mask, _ALL)
    if not count:
        return mask
    found: BoolArray = labels == np.bincount(labels.ravel())[1:].argmax() + 1
    return found


def _thick(mask: BoolArray, spacing: Array, steps: npt.NDArray[np.intp], *, largest: bool = False) -> BoolArray:
    """Voxels (K, J, I) at the parts of a mask that a ball of `THIN_MM` fits into, from every so many voxels.

    largest: at the largest of these parts only.
    """
    from scipy import ndimage  # as above

    sampling = (spacing * steps)[::-1]
    # At its ends the scan cuts the head, which continues there.
    coarse = np.pad(mask[_every(steps)], 1, "edge")
    core: BoolArray = ndimage.distance_transform_edt(coarse, sampling=sampling)[1:-1, 1:-1, 1:-1] > 0.5 * THIN_MM
    core = largest_part(core) if largest else core
    if not core.any():
        return np.zeros_like(mask)
    near = ndimage.distance_transform_edt(~core, sampling=sampling) <= 0.5 * THIN_MM + sampling.max()
    return _spread(near, mask.shape, steps)


def _larger_than(extent_mm: float, mask: BoolArray, sampling: Array) -> BoolArray:
    """The components (K, J, I) of a mask whose boxes have a larger diagonal."""
    from scipy import ndimage  # as above

    labels, _ = ndimage.label(mask, _ALL)
    boxes = enumerate(ndimage.find_objects(labels), 1)
    found: BoolArray = np.isin(labels, [number for number, box in boxes if _diagonal(box, sampling) > extent_mm])
    return found


def _diagonal(box: tuple[slice, ...], sampling: Array) -> float:
    return float(np.linalg.norm([part.stop - part.start for part in box] * sampling))


def _reaches_a_side(volume: Volume, head: BoolArray) -> bool:
    """Whether a head touches the first or last voxels along i or j, or voxels where nothing was measured."""
    from scipy import ndimage  # as above

    if head[:, [0, -1]].any() or head[:, :, [0, -1]].any():
        return True
    unmeasured = padding(volume)
    return bool(unmeasured.any() and (head & ndimage.binary_dilation(unmeasured, _ALL)).any())


def _every(steps: npt.NDArray[np.intp]) -> tuple[slice, ...]:
    """Slices [k, j, i] of every so many voxels along i, j and k."""
    return tuple(slice(None, None, int(step)) for step in steps[::-1])


def _spread(mask: BoolArray, shape: tuple[int, ...], steps: npt.NDArray[np.intp]) -> BoolArray:
    """A mask of every so many voxels on all voxels (K, J, I), each the value of the nearest."""
    rows = [
        np.minimum((np.arange(size) + step // 2) // step, count - 1)
        for size, step, count in zip(shape, steps[::-1], mask.shape, strict=True)
    ]
    whole: BoolArray = mask[np.ix_(*rows)]
    return whole
