"""Detection of radio-opaque beads in a CT, and measurement of their centres with subvoxel accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError
from ..files.volume import Volume
from ..progress import ProgressCallback, no_progress
from ..validate import within

Slices = tuple[slice, slice, slice]

THRESHOLD_HU = 800.0
DIAMETERS_MM = (1.0, 6.0)  # of beads with an unspecified diameter
RELIABLE = 1.5  # diameter over the voxel's longest side from which on beads are not lost between slices
PRECISE = 2.0  # the same, from which on centres are accurate to about a tenth of a millimetre

_COARSE_MM = 1.0  # slice spacing from which on partially filled voxels count for the centre
_FLOOR_HU, _COARSE_FLOOR_HU = 500.0, 100.0  # subtracted from a voxel's value to get its weight
_DILATION = 2  # voxels around the component whose values count
_SHELL = 2  # voxels around those, whose values show what surrounds the bead
_BONE_HU, _BONE_SHARE = 300.0, 0.15  # a bead on skin has a smaller fraction of its shell above this value
_HELD_BY = 0.3  # fraction of a bead's largest value: no values above it extend away from the bead
_LONGEST = 1.7  # largest ratio of a bead's longest to its shortest axis
_FEW_VOXELS = 4  # above the threshold: so few always look like a ball
_SIZE, _COARSE_SIZE = 1.3, 1.7  # largest ratio of measured and given diameter, or of its inverse
_MOST = 20_000  # largest number of examined components


@dataclass(frozen=True, eq=False)
class DetectedBead:
    """A bead in a CT.

    position_mm: (3,) its centre, LPS. diameter_mm: of the ball with the measured content; too large if the bead fills
    no voxel. peak_hu: its largest value. voxels: number above the threshold.
    """

    position_mm: Array
    diameter_mm: float
    peak_hu: float
    voxels: int


@dataclass(frozen=True, eq=False)
class NoBead:
    """A dense object of a bead's size that is not one. position_mm: (3,) LPS; reason: in words."""

    position_mm: Array
    reason: str


@dataclass(frozen=True, eq=False)
class BeadSearch:
    """Result of a search in a CT.

    beads: from superior to inferior. cautions: sentences that a user must read, such as a bead size that this scan
    cannot resolve. left_out: dense objects of a bead's size that were rejected.
    """

    beads: tuple[DetectedBead, ...]
    cautions: tuple[str, ...]
    left_out: tuple[NoBead, ...]

    @property
    def positions_mm(self) -> Array:
        """Centres (n, 3) of the beads, LPS."""
        return np.array([bead.position_mm for bead in self.beads]).reshape(-1, 3)


def find_beads(
    volume: Volume,
    *,
    diameter_mm: float | None = None,
    threshold_hu: float = THRESHOLD_HU,
    progress: ProgressCallback = no_progress,
) -> BeadSearch:
    """Detect beads in a CT: dense balls in soft tissue or air, such as those glued to the skin.

    Voxels above the threshold are divided into connected components. One of a bead's size is a bead if its extents in
    all directions are similar and little bone surrounds it; others are rejected, as are those at the border of the
    scan. The centre is the mean of voxel positions over the component and two voxels around it, weighted by HU − 500;
    with slices of 1 mm or more by HU − 100, since most voxels of a bead are then partially filled.

    A bead of 3 mm is located to 0.02 mm on average in voxels of 0.4 × 0.6 mm and 0.2 mm in those of 1 × 2 mm. Smaller
    ones vanish between slices of 2 mm: a caution states which size is reliable.

    Li, Ishii & Taylor 2007, V.B: components above a threshold; the weights are vfix's.

    Args:
        volume: CT.
        diameter_mm: of the beads; None accepts 1 to 6 mm.
        threshold_hu: a bead's largest value is above it, its surroundings are below.
        progress: called with the name of the stage and the completed fraction; an exception from it ends the search.

    Raises:
        InputError: the diameter is not from 0.5 to 20 mm, or the threshold is below 300 HU.
    """
    check_search(diameter_mm, threshold_hu)
    sizes = DIAMETERS_MM
    if diameter_mm is not None:
        factor = _SIZE if diameter_mm >= PRECISE * volume.resolution_mm else _COARSE_SIZE
        sizes = (diameter_mm / factor, diameter_mm * factor)
    beads: list[DetectedBead] = []
    left_out: list[NoBead] = []
    places = _components(volume, threshold_hu, sizes[1], progress)
    for count, dense in enumerate(places):
        progress("Judging dense places", 0.4 + 0.5 * count / len(places))
        found = _judged(volume, dense, sizes)
        if isinstance(found, DetectedBead):
            beads.append(found)
        else:
            left_out.append(found)
    beads.sort(key=lambda bead: -float(bead.position_mm[2]))
    return BeadSearch(tuple(beads), tuple(_cautions(volume, diameter_mm, beads, left_out)), tuple(left_out))


def check_search(diameter_mm: float | None, threshold_hu: float) -> None:
    """Raise the InputError of `find_beads` for invalid arguments, before a volume is read."""
    within("the threshold of beads in HU", threshold_hu, _BONE_HU, 3000.0)
    if diameter_mm is not None:
        within("the beads' diameter in mm", diameter_mm, 0.5, 20.0)


def smallest_bead_mm(volume: Volume) -> float:
    """Smallest diameter in mm that does not vanish between the voxels of a scan."""
    return RELIABLE * volume.resolution_mm


@dataclass(frozen=True, eq=False)
class _Dense:
    """A component in a padded box: its voxels, those of other components, and values."""

    box: Slices
    own: NDArray[np.bool_]
    other: NDArray[np.bool_]
    hu: Array


def _components(volume: Volume, threshold_hu: float, largest_mm: float, progress: ProgressCallback) -> list[_Dense]:
    """Components above the threshold of at most the size of beads, in the order of their first voxels."""
    from scipy import ndimage  # imported here: slow to load

    progress("Looking for dense places", 0.1)
    dense = volume.hu > np.int16(threshold_hu)
    part = _bounds(dense)
    if part is None:
        return []
    progress("Parting dense places", 0.2)
    labels, count = ndimage.label(dense[part])
    progress("Parting dense places", 0.3)
    longest = np.ceil(1.5 * largest_mm / volume.spacing[::-1]) + 1
    small = [
        (label, box)
        for label, box in enumerate(ndimage.find_objects(labels, count), start=1)
        if box is not None and all(side.stop - side.start <= most for side, most in zip(box, longest, strict=True))
    ]
    if len(small) > _MOST:
        raise InputError(
            f"{len(small):,} places of a bead's size are above {threshold_hu:g} HU: the scan is too noisy for this "
            "threshold; raise it"
        )
    return [_cut_out(volume, labels, part, label, box) for label, box in small]


def _cut_out(volume: Volume, labels: NDArray[np.int32], part: Slices, label: int, box: Slices) -> _Dense:
    """Crop a component with its surroundings. ``labels`` are of the part of the scan that contains everything dense."""
    reach = _DILATION + _SHELL + 1
    full = _padded(_shifted(box, part), reach, volume.hu.shape)
    own, other = (np.zeros([side.stop - side.start for side in full], dtype=bool) for _ in range(2))
    near = _padded(box, reach, labels.shape)  # can end before ``full`` does
    inner = tuple(
        slice(a.start + b.start - c.start, a.start + b.stop - c.start) for a, b, c in zip(part, near, full, strict=True)
    )
    own[inner], other[inner] = labels[near] == label, ~np.isin(labels[near], (0, label))
    return _Dense(full, own, other, volume.hu[full].astype(np.float64))


def _judged(volume: Volume, dense: _Dense, sizes: tuple[float, float]) -> DetectedBead | NoBead:
    from scipy import ndimage  # imported here: slow to load

    near = ndimage.binary_dilation(dense.own, iterations=_DILATION) & ~dense.other
    floor = _COARSE_FLOOR_HU if volume.resolution_mm >= _COARSE_MM else _FLOOR_HU
    weights = np.where(near, np.clip(dense.hu - floor, 0.0, None), 0.0)
    ijk = np.stack(np.nonzero(weights)[::-1], axis=1) + [side.start for side in dense.box[::-1]]
    share = weights[np.nonzero(weights)] / weights.sum()
    centre = share @ ijk
    position = volume.index_to_lps(centre)
    position.setflags(write=False)
    if _touches(dense, volume.hu.shape):
        return NoBead(position, "it is at the border of the scan")
    shell = ndimage.binary_dilation(near, iterations=_SHELL) & ~near
    if _attached(dense) or (dense.hu[shell] > _BONE_HU).mean() > _BONE_SHARE:
        return NoBead(position, "it is attached to bone or to other dense material")
    diameter = _diameter(volume, dense.hu, near, shell)
    if not sizes[0] <= diameter <= sizes[1]:
        return NoBead(position, f"it is as large as a ball of {diameter:.1f} mm")
    if _elongation(volume, (ijk - centre) * volume.spacing, share) > _LONGEST:
        return NoBead(position, "it is elongated")
    return DetectedBead(position, diameter, float(dense.hu[dense.own].max()), int(dense.own.sum()))


def _attached(dense: _Dense) -> bool:
    """Whether the component continues, above the values of bone or a third of its own, to the end of its box."""
    from scipy import ndimage  # imported here: slow to load

    level = max(_BONE_HU, _HELD_BY * float(dense.hu[dense.own].max()))
    labels, _ = ndimage.label(dense.hu > level)
    held = labels[dense.own]
    whole = np.isin(labels, held[held > 0])  # 0 is background: a bright bead's own rim is below a third of its peak
    ends = [whole[0], whole[-1], whole[:, 0], whole[:, -1], whole[:, :, 0], whole[:, :, -1]]
    return any(bool(end.any()) for end in ends)


def _diameter(volume: Volume, hu: Array, near: NDArray[np.bool_], shell: NDArray[np.bool_]) -> float:
    """Diameter in mm of the ball that fills the voxels partially as measured, relative to the background of each."""
    from scipy import ndimage  # imported here: slow to load

    behind = ndimage.distance_transform_edt(~shell, sampling=volume.spacing[::-1], return_indices=True)[1]
    background = hu[tuple(behind)]
    peak = hu[near].max()
    filled = np.clip((hu - background)[near] / np.maximum(peak - background[near], 1.0), 0.0, 1.0)
    return float(np.cbrt(6.0 / np.pi * filled.sum() * np.prod(volume.spacing)))


def _elongation(volume: Volume, offsets: Array, share: Array) -> float:
    """Ratio of longest to shortest axis, corrected for the blur of a ball by the voxel size."""
    spread = (share[:, None] * offsets).T @ offsets
    blurred = np.sqrt(np.linalg.eigvalsh(spread))
    voxel = volume.spacing.max() / np.sqrt(12.0)
    return float(blurred[2] / (blurred[0] + voxel))


def _cautions(
    volume: Volume, diameter_mm: float | None, beads: list[DetectedBead], left_out: list[NoBead]
) -> list[str]:
    cautions = []
    smallest, voxel = smallest_bead_mm(volume), volume.resolution_mm
    if diameter_mm is None:
        if smallest > 2.0:
            cautions.append(
                f"With slices of {voxel:.2g} mm beads below {smallest:.2g} mm may not be seen: count them, and scan "
                "again with thinner slices if one is missing."
            )
    elif diameter_mm < smallest:
        cautions.append(
            f"With slices of {voxel:.2g} mm beads of {diameter_mm:g} mm may not be seen, only those of {smallest:.2g} "
            f"mm or more can be relied on: scan again with slices of {diameter_mm / PRECISE:.2g} mm or less."
        )
    elif diameter_mm < PRECISE * voxel:
        cautions.append(
            f"With slices of {voxel:.2g} mm the centre of a bead of {diameter_mm:g} mm may be off by a fifth of a "
            f"slice or more; slices of {diameter_mm / PRECISE:.2g} mm or less are better."
        )
    if 0 < len(beads) < 3:
        cautions.append(f"Only {len(beads)} of the beads were found; a registration needs three.")
    if faint := sum(bead.voxels <= _FEW_VOXELS for bead in beads):
        cautions.append(
            f"{faint} of the beads {'has' if faint == 1 else 'have'} at most {_FEW_VOXELS} voxels above the threshold "
            "and may be bits of bone: look at each in the slices."
        )
    border = sum("border" in place.reason for place in left_out)
    if border:
        cautions.append(f"{border} dense places lie at the border of the scan and are left out.")
    return cautions


def _touches(dense: _Dense, shape: tuple[int, ...]) -> bool:
    where = [np.flatnonzero(dense.own.any(axis=tuple(a for a in range(3) if a != axis))) for axis in range(3)]
    return any(
        at[0] + side.start == 0 or at[-1] + side.start == count - 1
        for at, side, count in zip(where, dense.box, shape, strict=True)
    )


def _bounds(mask: NDArray[np.bool_]) -> Slices | None:
    """Bounding box of the true voxels, along each axis; None if there are none."""
    sides = []
    for axis in range(3):
        seen = np.flatnonzero(mask.any(axis=tuple(a for a in range(3) if a != axis)))
        if len(seen) == 0:
            return None
        sides.append(slice(int(seen[0]), int(seen[-1]) + 1))
    return sides[0], sides[1], sides[2]


def _padded(box: Any, by: int, shape: tuple[int, ...]) -> Slices:
    a, b, c = (slice(max(side.start - by, 0), min(side.stop + by, size)) for side, size in zip(box, shape, strict=True))
    return a, b, c


def _shifted(box: Any, part: Slices) -> Slices:
    a, b, c = (slice(side.start + start.start, side.stop + start.start) for side, start in zip(box, part, strict=True))
    return a, b, c
