"""Measurement of the anatomy's sizes in a CT."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from vfix_engine.files.volume import Volume

AIR_BELOW_HU = -450.0  # halfway between air and mucosa
BONE_ABOVE_HU = 250.0
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Plug:
    """A ball of tissue put into an opening [mm]."""

    centre: Floats
    radius: float


def air_region(ct: Volume, seed: npt.ArrayLike, plug: Plug | None = None) -> npt.NDArray[np.bool_]:
    """Return the air (K, J, I) connected to the voxel nearest to an LPS point, optionally with an opening plugged."""
    air = ct.hu < AIR_BELOW_HU
    if plug is not None:
        air &= ~_ball(ct, plug)
    labels, _ = ndimage.label(air)
    at = _voxel(ct, seed)
    region: npt.NDArray[np.bool_] = (labels == labels[at]) & bool(labels[at])
    return region


def volume_cm3(ct: Volume, region: npt.NDArray[np.bool_]) -> float:
    """Return the volume of a region [cm³]."""
    return float(region.sum() * np.prod(ct.spacing) / 1000.0)


def is_in(ct: Volume, region: npt.NDArray[np.bool_], point: npt.ArrayLike) -> bool:
    """Return whether the voxel nearest to an LPS point is in a region."""
    return bool(region[_voxel(ct, point)])


def thickness_mm(ct: Volume, start: npt.ArrayLike, direction: npt.ArrayLike, reach: float = 40.0) -> float:
    """Return the thickness [mm] of the first bone along a ray from an LPS point, from threshold to threshold."""
    step = 0.02  # [mm]
    along = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
    hu = ct.sample(np.asarray(start) + np.arange(0.0, reach, step)[:, None] * along)
    bone = np.flatnonzero(hu > BONE_ABOVE_HU)
    if len(bone) == 0:
        return 0.0
    ends = np.flatnonzero(np.diff(bone) > 1)
    last = bone[ends[0]] if len(ends) else bone[-1]
    return float((last - bone[0] + 1) * step)


def bottleneck_mm(ct: Volume, a: npt.ArrayLike, b: npt.ArrayLike, around: float = 4.0, step: float = 0.125) -> float:
    """Return the diameter [mm] of the largest ball that passes through air between two near LPS points; 0 if none does.

    around: how far [mm] the path may leave the box of both points. step: grid [mm] that the CT is interpolated to.
    """
    ends = np.array([a, b], dtype=np.float64)
    low = ends.min(axis=0) - around
    counts = np.ceil((ends.max(axis=0) + around - low) / step).astype(int)
    ijk = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1)
    air = (ct.sample((low + step * ijk).reshape(-1, 3)) < AIR_BELOW_HU).reshape(counts)
    clearance = ndimage.distance_transform_edt(air, sampling=step)
    start, end = (tuple(at) for at in np.rint((ends - low) / step).astype(int))
    smallest, largest = 0.0, float(min(clearance[start], clearance[end]))
    while largest - smallest > 0.02:
        radius = (smallest + largest) / 2.0
        labels, _ = ndimage.label(clearance > radius)
        smallest, largest = (radius, largest) if labels[start] == labels[end] != 0 else (smallest, radius)
    return 2.0 * smallest


def bead_centroid(ct: Volume, near: npt.ArrayLike, reach: float = 4.0) -> Floats:
    """Return the LPS centroid [mm] of metal within reach of a point, each voxel weighted by its fraction of metal."""
    weight = np.where(
        _ball(ct, Plug(np.asarray(near, dtype=np.float64), reach)), np.clip(ct.hu - 500.0, 0.0, None), 0.0
    )
    return ct.index_to_lps(np.array(ndimage.center_of_mass(weight))[::-1])


def _voxel(ct: Volume, point: npt.ArrayLike) -> tuple[int, int, int]:
    i, j, k = np.rint(ct.lps_to_index(np.asarray(point, dtype=np.float64))).astype(int)
    return int(k), int(j), int(i)


def _ball(ct: Volume, plug: Plug) -> npt.NDArray[np.bool_]:
    kji = np.indices(ct.hu.shape, sparse=True)
    ijk = ct.lps_to_index(plug.centre)
    squared = sum(((kji[2 - n] - ijk[n]) * ct.spacing[n]) ** 2 for n in range(3))
    inside: npt.NDArray[np.bool_] = squared < plug.radius**2
    return inside
