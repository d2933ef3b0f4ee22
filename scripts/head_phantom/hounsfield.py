"""Conversion of tissues to Hounsfield units, with the partial volume of a scanner's point spread."""

from __future__ import annotations

import numpy as np

from head_phantom.anatomy import Head
from head_phantom.blending import Field
from head_phantom.landmarks import BEADS
from head_phantom.space import Space

AIR, FAT, ORBITAL_FAT, SOFT_TISSUE, MUSCLE, BRAIN, VITREOUS = -1000, -90, -75, 38, 58, 36, 25  # [HU]
THIN_BONE, ROOT, CROWN, BEAD = 820, 1500, 2100, 2200  # [HU]


class Painter:
    """Paints tissues over each other."""

    def __init__(self, space: Space, spacing: float, ramp_mm: float | None = None) -> None:
        blurred = max(1.0, 1.8 * spacing) if ramp_mm is None else ramp_mm
        self._ramp = np.float32(blurred)  # [mm] over which an edge is blurred
        self.hu: Field = np.full(space.x.shape, AIR, dtype=np.float32)

    def share(self, distance: Field) -> Field:
        """Return the fraction of the tissue in each voxel, a smooth step, so that no level set shows the grid."""
        t = np.clip(np.float32(0.5) - distance / self._ramp, 0, 1)
        smooth: Field = t * t * (3 - 2 * t)
        return smooth

    def lay(self, distance: Field, hu: Field | float) -> None:
        """Paint a tissue with a value [HU]."""
        self.hu = self.hu + (np.asarray(hu, dtype=np.float32) - self.hu) * self.share(distance)


def hounsfield_units(tissues: Head, space: Space, spacing: float, ramp_mm: float | None = None) -> Field:
    """Return the HU (K, J, I) of a block without noise.

    spacing: voxel size [mm], which sets the blur of the edges unless ramp_mm is given. This blur leaves thin sheets of
    bone their full density; `scanned` models that of a scanner.
    """
    painter, uneven = Painter(space, spacing, ramp_mm), space.coarse
    bone = np.minimum(tissues.skull, tissues.mandible)
    painter.lay(tissues.skin, SOFT_TISSUE + 6 * uneven)
    deep = np.maximum(tissues.skin + 3.5, -(tissues.lining - 7))  # fat between skin and muscle, not around the nose
    fading = (34 + 5 * uneven - space.y) / 12  # towards the cheeks
    painter.lay(np.maximum(deep, np.maximum(3.0 - bone, fading)), FAT + 12 * uneven)
    under_skin = np.maximum(tissues.skin + 2.0, -(tissues.skin + 5.5 + 1.2 * uneven))
    painter.lay(np.maximum(under_skin, 6 - tissues.lining), FAT + 8 * uneven)
    painter.lay(np.maximum(tissues.muscles + 0.8 * uneven, tissues.skin + 3.5), MUSCLE + 8 * space.fine)
    painter.lay(tissues.brain + 1.0, BRAIN + 3 * space.fine)
    inside_orbit = np.maximum(tissues.orbits + 0.6, tissues.skin + 2.0)
    painter.lay(inside_orbit, ORBITAL_FAT)
    painter.lay(np.maximum(tissues.eye_muscles, inside_orbit), MUSCLE)
    painter.lay(np.maximum(tissues.eyes, inside_orbit), SOFT_TISSUE + 10)
    painter.lay(np.maximum(tissues.eyes + 1.4, inside_orbit), VITREOUS)
    painter.lay(np.maximum(tissues.lining, tissues.skin), SOFT_TISSUE + 7)
    painter.lay(tissues.skull, _bone(tissues.skull, uneven, 1250, 520, 1.4))
    painter.lay(tissues.mandible, _bone(tissues.mandible, uneven, 1350, 480, 2.0))
    painter.lay(tissues.vertebrae, _bone(tissues.vertebrae, uneven, 900, 350, 1.0))
    painter.lay(tissues.air, AIR)
    painter.lay(tissues.thin_bone, THIN_BONE)
    painter.lay(tissues.teeth, np.where((space.z > -15.5) | (space.z < -34.0), ROOT, CROWN))
    for bead in BEADS:
        painter.lay(_ball(space, bead.centre, bead.radius), BEAD)
    return painter.hu


def _bone(distance: Field, uneven: Field, cortex: float, marrow: float, cortical_thickness: float) -> Field:
    """Return the HU of bone by depth: compact outside, spongy inside."""
    depth = np.clip((-distance - cortical_thickness) / 1.4, 0, 1)
    value: Field = cortex + (marrow - cortex) * depth + 60 * uneven * depth
    return value


def _ball(space: Space, centre: tuple[float, float, float], radius: float) -> Field:
    """Return the distance to a ball in the true grid, not the warped one, so that its centroid is known exactly."""
    x, y, z = (axis - c for axis, c in zip(space.axes, centre, strict=True))
    squared = x[None, None, :] ** 2 + y[None, :, None] ** 2 + z[:, None, None] ** 2
    return (np.sqrt(squared) - radius).astype(np.float32)
