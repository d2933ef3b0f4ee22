"""Radio-opaque beads inserted into a CT, for tests, examples and the tutorial; and sites for them on a head's skin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError, InputError
from vfix_engine.files.volume import Volume
from vfix_engine.validate import real_array, within

BEAD_HU = 2200.0
SKIN_HU = -300.0  # midpoint of air and skin

_ACROSS = 24  # smallest number of samples across a bead's diameter
_MOST_SAMPLES = 32  # along one side of a voxel
_BONE_HU = 250.0
_STEP_MM = 0.1
_DEPTH_MM = 3.0  # of tissue behind a site: a strap or a noisy voxel has less


@dataclass(frozen=True, eq=False)
class SkinSite:
    """A point on the outside of the skin. position_mm: (3,) LPS; outward: (3,) unit normal, away from the head."""

    name: str
    position_mm: Array
    outward: Array

    def bead_centre(self, diameter_mm: float) -> Array:
        """Centre (3,) of a bead glued on there."""
        centre: Array = self.position_mm + 0.5 * diameter_mm * self.outward
        return centre


# Directions from the centre of the skull's bone, LPS: distributed over the front and the sides of a head.
_SITES = {
    "forehead": (-0.22, -0.8, 0.55),
    "left temple": (0.85, -0.3, 0.42),
    "right temple": (-0.85, -0.3, 0.42),
    "left cheek bone": (0.56, -0.72, -0.3),
    "right cheek bone": (-0.56, -0.72, -0.3),
}


def place_beads(volume: Volume, positions: npt.ArrayLike, diameter_mm: float, hu: float = BEAD_HU) -> Volume:
    """Insert beads into a CT, with partial volume as in a scanner.

    A voxel gets the mean of the values in it: HU (1 − f) + bead f, with f the fraction of its volume in the bead, from
    at least 24 samples across a diameter.

    Args:
        volume: CT; it is not changed.
        positions: (n, 3) LPS mm, the beads' centres.
        diameter_mm: of the beads.
        hu: of the beads.

    Raises:
        InputError: the positions are not points (n, 3), or a number is out of range.
        ImageError: a bead is not completely in the volume.
    """
    centres = real_array("the beads' positions", positions)
    if centres.ndim != 2 or centres.shape[1] != 3 or not np.isfinite(centres).all():
        raise InputError(f"the beads' positions must be finite points (n, 3) in mm, not {centres.shape}")
    radius = 0.5 * within("the beads' diameter in mm", diameter_mm, 0.1, 50.0)
    within("the beads' value in HU", hu, -1000.0, 30000.0)
    values = np.array(volume.hu)
    reach = radius / volume.spacing + 0.5  # voxels
    for number, centre in enumerate(centres, start=1):
        at = volume.lps_to_index(centre)
        low, high = np.floor(at - reach + 0.5).astype(int), np.ceil(at + reach - 0.5).astype(int)
        if (low < 0).any() or (high >= values.shape[::-1]).any():
            raise ImageError(f"bead {number} does not lie in the scan; give a centre in LPS mm that does")
        box = tuple(slice(a, b + 1) for a, b in zip(low[::-1], high[::-1], strict=True))
        share = _filled(volume, centre, radius, low, high)
        values[box] = np.rint(values[box] * (1.0 - share) + hu * share).astype(np.int16)
    return replace(volume, hu=values)


def skin_sites(volume: Volume) -> tuple[SkinSite, ...]:
    """Find five sites for beads on the skin of a head: the forehead, both temples and both cheek bones.

    A ray runs from the centre of the bone in the direction of each; the site is where it finally leaves the head, the
    last point with 3 mm of tissue behind it.

    Raises:
        ImageError: there is no bone, or no skin in one of the directions.
    """
    bone = np.argwhere(volume.hu[::2, ::2, ::2] > _BONE_HU)
    if len(bone) == 0:
        raise ImageError("there is no bone in this CT, around which a head's skin could be looked for")
    middle = volume.index_to_lps(2.0 * bone.mean(axis=0)[::-1])
    return tuple(_site(volume, name, middle, np.array(direction)) for name, direction in _SITES.items())


def _site(volume: Volume, name: str, middle: Array, direction: Array) -> SkinSite:
    direction = direction / np.linalg.norm(direction)
    low, high = volume.bounds
    along = np.arange(0.0, float(np.linalg.norm(high - low)), _STEP_MM)
    points = middle + along[:, None] * direction
    tissue = volume.sample(points) > SKIN_HU
    deep = int(_DEPTH_MM / _STEP_MM)
    runs = np.convolve(tissue, np.ones(deep), mode="valid") == deep  # run n is the samples n to n + deep - 1
    if not runs.any():
        raise ImageError(f"there is no skin at the {name}; the scan may be cut there")
    last = int(np.flatnonzero(runs)[-1]) + deep - 1
    inside = ((points >= low) & (points <= high)).all(axis=1)
    if last + 1 >= len(points) or not inside[last + 1]:
        raise ImageError(f"the scan ends before the skin at the {name}")
    position = points[last] + 0.5 * _STEP_MM * direction
    outward = _outward(volume, position, direction)
    for array in (position, outward):
        array.setflags(write=False)
    return SkinSite(name, position, outward)


def _outward(volume: Volume, position: Array, direction: Array) -> Array:
    """Unit normal of the skin: direction of decreasing HU, over a ball of 4 mm."""
    steps = np.arange(-4.0, 4.5, 1.0)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[np.linalg.norm(grid, axis=1) <= 4.0]
    tissue = volume.sample(position + grid) > SKIN_HU
    fall = -(grid * tissue[:, None]).sum(axis=0)
    size = float(np.linalg.norm(fall))
    normal: Array = fall / size if size > 0.0 and fall @ direction > 0.0 else direction.copy()
    return normal


def _filled(
    volume: Volume, centre: Array, radius: float, low: npt.NDArray[np.int_], high: npt.NDArray[np.int_]
) -> Array:
    """Fraction (k, j, i) of each voxel of a box that a ball fills."""
    samples = np.clip(np.ceil(_ACROSS * volume.spacing / (2.0 * radius)), 4, _MOST_SAMPLES).astype(int)
    axes = [(np.arange((b - a + 1) * n) + 0.5) / n - 0.5 + a for a, b, n in zip(low, high, samples, strict=True)]
    # The axes of the voxels are orthogonal, so squared distances are sums over the axes.
    squares = [
        ((axis - at) * side) ** 2
        for axis, at, side in zip(axes, volume.lps_to_index(centre), volume.spacing, strict=True)
    ]
    inside = squares[2][:, None, None] + squares[1][None, :, None] + squares[0][None, None, :] <= radius**2
    sizes = high - low + 1
    blocks = inside.reshape(sizes[2], samples[2], sizes[1], samples[1], sizes[0], samples[0])
    share: Array = blocks.mean(axis=(1, 3, 5))
    return share
