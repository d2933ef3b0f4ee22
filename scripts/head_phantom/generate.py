"""The head phantom on a grid of any spacing, whole or a part of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from head_phantom.anatomy import Head, head
from head_phantom.blending import Field
from head_phantom.hounsfield import hounsfield_units
from head_phantom.parts.nose import SEPTUM_BEND_MM
from head_phantom.shapes import Box
from head_phantom.space import HIGH, LOW, Space, Unevenness
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume

SEED = 3
NOSE_BOX: Box = ((-45.0, -36.0, -34.0), (45.0, 92.0, 66.0))
_SLAB = 14.0  # [mm] generated at a time, to bound the memory
_ROUND_OFF = 1e-6  # [voxel]


def generate(spacing_mm: float, box: Box | None = None, septum_bend_mm: float = SEPTUM_BEND_MM) -> Volume:
    """Return a CT of the head without noise, int16 HU.

    box: (low, high) LPS corners [mm]; None for the whole head. Voxel centres are at multiples of the spacing from the
    corner of the whole head, so that a part has the same voxels as the whole.
    septum_bend_mm: of ``parts.nose.Septum``.

    Raises ImageError for a spacing that is not in 0.2-5 mm or a box outside the head.
    """
    grid = grid_axes(spacing_mm, box)
    slabs = [
        np.clip(np.rint(hu), -1024, 3071).astype(np.int16)
        for hu in _by_slab(grid, spacing_mm, hounsfield_units, septum_bend_mm)
    ]
    origin = np.array([axis[0] for axis in grid])
    return Volume(np.concatenate(slabs), origin, np.full(3, spacing_mm), np.eye(3))


def generate_fields(
    spacing_mm: float, pick: Callable[[Head, Space], Field], box: Box | None = None
) -> tuple[Field, npt.NDArray[np.float64]]:
    """Return a signed distance (K, J, I) [mm] chosen from the tissues, and the LPS position (3,) of voxel (0, 0, 0)."""
    grid = grid_axes(spacing_mm, box)
    slabs = list(_by_slab(grid, spacing_mm, lambda tissues, space, _: pick(tissues, space)))
    return np.concatenate(slabs), np.array([axis[0] for axis in grid])


def grid_axes(spacing_mm: float, box: Box | None) -> tuple[npt.NDArray[np.float64], ...]:
    """Return the voxel centres along x, y, z [mm]."""
    if not 0.2 <= spacing_mm <= 5.0:
        raise ImageError(f"the phantom is made at a spacing of 0.2 to 5 mm, not {spacing_mm:g} mm.")
    low, high = (np.maximum(box[0], LOW), np.minimum(box[1], HIGH)) if box is not None else (LOW, HIGH)
    first = np.ceil((low - LOW) / spacing_mm - _ROUND_OFF).astype(int)
    last = np.floor((high - LOW) / spacing_mm + _ROUND_OFF).astype(int)
    if (last - first < 1).any():
        raise ImageError(f"the box {box} has no voxels of {spacing_mm:g} mm inside the head, {LOW} to {HIGH} mm.")
    return tuple(LOW[n] + spacing_mm * np.arange(first[n], last[n] + 1) for n in range(3))


def _by_slab(
    grid: tuple[npt.NDArray[np.float64], ...],
    spacing: float,
    make: Callable[[Head, Space, float], Field],
    septum_bend_mm: float = SEPTUM_BEND_MM,
) -> Iterator[Field]:
    x, y, z = grid
    unevenness = Unevenness.seeded(SEED)
    thickness = max(int(_SLAB / spacing), 2)
    for start in range(0, len(z), thickness):
        space = Space(x, y, z[start : start + thickness], unevenness)
        yield make(head(space, septum_bend_mm), space, spacing)
