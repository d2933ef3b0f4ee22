"""A part of the head as scanned: with the partial volume of a scanner's point spread and slices.

The shipped CT blurs each edge separately, so that sheets thinner than a voxel keep their full density. Here the tissues
are painted with sharp edges on a fine grid, blurred by the point spread, and averaged over every voxel, so that the
density of a sheet decreases with its thickness as in a patient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage

from head_phantom.anatomy import Head
from head_phantom.blending import Field
from head_phantom.generate import generate_fields
from head_phantom.hounsfield import hounsfield_units
from head_phantom.shapes import Box
from head_phantom.space import Space
from vfix_engine.files.volume import Volume

FINE_MM = 0.25  # of the grid that the tissues are painted on
_SHARP_MM = 0.3  # width of an edge there
_FWHM_TO_SIGMA = 1.0 / (2.0 * np.sqrt(2.0 * np.log(2.0)))


def scanned(box: Box, spacing_mm: Sequence[float], point_spread_mm: float, thinner_mm: float = 0.0) -> Volume:
    """Return a CT of a part of the head without noise, with the partial volume of a scanner.

    Args:
        box: (low, high) LPS corners in mm.
        spacing_mm: (3,) voxel size along x, y, z, each a whole multiple of 0.25 mm; a slice is as thick as the last.
        point_spread_mm: full width at half maximum of the point spread in every direction.
        thinner_mm: how much thinner the sheets of septum and turbinates are than the phantom's, which are 1 mm.

    Raises:
        ValueError: a voxel size is no such multiple.
    """
    step = np.rint(np.asarray(spacing_mm, dtype=np.float64) / FINE_MM).astype(int)
    if (step < 1).any() or not np.allclose(step * FINE_MM, spacing_mm):
        raise ValueError(f"voxel sizes must be whole multiples of {FINE_MM:g} mm, not {tuple(spacing_mm)}")

    def sharp(tissues: Head, space: Space) -> Field:
        sheets = tissues.thin_bone + np.float32(thinner_mm / 2.0)
        return hounsfield_units(replace(tissues, thin_bone=sheets), space, FINE_MM, _SHARP_MM)

    fine, origin = generate_fields(FINE_MM, sharp, box)
    fine = ndimage.gaussian_filter(fine, point_spread_mm * _FWHM_TO_SIGMA / FINE_MM, mode="nearest")
    counts = np.array(fine.shape[::-1]) // step
    kept = fine[: counts[2] * step[2], : counts[1] * step[1], : counts[0] * step[0]]
    voxels = kept.reshape(counts[2], step[2], counts[1], step[1], counts[0], step[0]).mean(axis=(1, 3, 5))
    hu = np.clip(np.rint(voxels), -1024, 3071).astype(np.int16)
    spacing = step * FINE_MM
    return Volume(hu, origin + (spacing - FINE_MM) / 2.0, spacing, np.eye(3), float(spacing[2]))
