"""A block of the patient grid, and how parts are put into it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from head_phantom.blending import Field, union, without
from head_phantom.noise import SmoothNoise
from head_phantom.shapes import Box, Part, Points, Shape

LOW = np.array([-84.0, -40.0, -92.0])  # [mm] LPS corner of the whole head
HIGH = np.array([84.0, 208.0, 130.0])
FAR = np.float32(30.0)  # [mm] value of a field where nothing is near
REACH = 18.0  # [mm] a shape is evaluated this far around its box
_BEYOND_SEAM = 12.0  # [mm] and this far beyond the width of its seam, which would otherwise end in a step
RIGHT_SIZE = np.float32(0.985)  # faces are not symmetrical: the right half is slightly smaller
RIGHT_DROP = np.float32(0.4)  # [mm] and slightly lower
ROLL = np.float32(0.006)  # [rad] and the head is slightly tilted


@dataclass(frozen=True)
class Unevenness:
    """The noise that makes the surfaces of the head irregular."""

    warp: tuple[SmoothNoise, SmoothNoise, SmoothNoise]
    coarse: SmoothNoise
    fine: SmoothNoise

    @staticmethod
    def seeded(seed: int) -> Unevenness:
        """Return noise of 22 mm wavelength for coordinates, 9 mm for thicknesses, 5 mm for bone surfaces."""
        x, y, z = (SmoothNoise(seed + n, 22.0, LOW, HIGH) for n in range(3))
        return Unevenness((x, y, z), SmoothNoise(seed + 3, 9.0, LOW, HIGH), SmoothNoise(seed + 4, 5.0, LOW, HIGH))


class Space:
    """Voxel centres of a block (axes x, y, z in mm), warped; fields are (K, J, I) float32."""

    def __init__(
        self,
        x: npt.NDArray[np.float64],
        y: npt.NDArray[np.float64],
        z: npt.NDArray[np.float64],
        unevenness: Unevenness,
    ) -> None:
        self.axes = (x, y, z)
        warp = [np.float32(0.7) * noise.at(x, y, z) for noise in unevenness.warp]
        self.x = x.astype(np.float32)[None, None, :] + warp[0]
        self.y = y.astype(np.float32)[None, :, None] + warp[1]
        self.z = z.astype(np.float32)[:, None, None] + warp[2]
        self.x += ROLL * (self.z - np.float32(10.0))
        self.coarse = unevenness.coarse.at(x, y, z)
        self.fine = unevenness.fine.at(x, y, z)

    @property
    def points(self) -> Points:
        """Return the coordinates of all voxels."""
        return Points(self.x, self.y, self.z)

    def empty(self) -> Field:
        """Return an empty field."""
        return np.full(self.x.shape, FAR, dtype=np.float32)

    def build(self, parts: Iterable[Part], onto: Field | None = None, reach: float = REACH) -> Field:
        """Return a copy of a field, or an empty one, with the parts added one after another."""
        built = self.empty() if onto is None else onto.copy()
        for part in parts:
            for mirrored in (False, True) if part.paired else (False,):
                block = self.block(part.shape.box, max(reach, part.blend + _BEYOND_SEAM), mirrored)
                if block is not None:
                    distance = self.distance(part.shape, block, mirrored, part.paired)
                    combine = without if part.taken else union
                    built[block] = combine(built[block], distance, part.blend)
        return built

    def block(self, box: Box, reach: float, mirrored: bool) -> tuple[slice, slice, slice] | None:
        """Return index ranges of the voxels within reach of a box, or of its mirror image; None if there are none."""
        (x0, y0, z0), (x1, y1, z1) = box
        if mirrored:
            x0, x1 = -x1, -x0
        ranges = [
            slice(*np.searchsorted(axis, [low - reach, high + reach]))
            for axis, low, high in zip(self.axes, (x0, y0, z0), (x1, y1, z1), strict=True)
        ]
        if any(found.start == found.stop for found in ranges):
            return None
        return ranges[2], ranges[1], ranges[0]

    def distance(self, shape: Shape, block: tuple[slice, slice, slice], mirrored: bool, paired: bool) -> Field:
        """Return the distance to a shape in a block; the right side of a paired one is its uneven mirror image."""
        at = Points(self.x[block], self.y[block], self.z[block])
        if paired and mirrored:
            at = Points(-at.x / RIGHT_SIZE, at.y, at.z + RIGHT_DROP)
        return shape.distance(at)
