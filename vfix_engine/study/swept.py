"""What a tool of capsules has swept over a run, as a surface, and how near it has passed to a surface.

Both are pictures: distances to a surface are taken at its vertices, so that a triangle may be nearer than its colour
says. Figures come from the recording (``metrics``), which measures triangles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arrays import Array, IndexArray
from ..errors import InputError
from ..progress import ProgressCallback, no_progress
from .series import RunSeries
from .swept_kernel import lower_field, lower_least

VOXEL_MM = 0.5
REACH_MM = 5.0
MOST_VOXELS = 40_000_000  # of the grid; a larger tool gets larger voxels
_BAND = 2.0  # voxels about the surface whose distance is measured
_POSES = 32  # between two reports of progress


@dataclass(frozen=True, eq=False)
class SweptVolume:
    """The union of a tool in all its poses. vertices: (V, 3) LPS mm; faces: (F, 3), outwards; volume_mm3: within."""

    vertices: Array
    faces: IndexArray
    volume_mm3: float


@dataclass(frozen=True, eq=False)
class NearPasses:
    """The part of a surface that a tool has passed within reach.

    vertices: (V, 3) LPS mm; faces: (F, 3); least_mm: (V,) least distance of each vertex to the tool, negative within
    it, at most reach_mm.
    """

    vertices: Array
    faces: IndexArray
    least_mm: Array
    reach_mm: float


@dataclass(frozen=True, eq=False)
class SweptPoses:
    """Poses of a tool of S capsules: start, end (n, S, 3) LPS mm of their axes, radius (S,) mm."""

    start: Array
    end: Array
    radius: Array

    @classmethod
    def of(cls, series: RunSeries, step_mm: float = VOXEL_MM / 2.0) -> SweptPoses:
        """The poses of a run, thinned so that between two no end of a capsule moves further than ``step_mm`` an axis.

        Raises:
            InputError: the step is not positive.
        """
        if not step_mm > 0.0:
            raise InputError(f"poses are thinned to a positive step in mm, not to {step_mm!r:.40}")
        kept = kept_poses(np.concatenate([series.start, series.end], axis=1), step_mm)
        return cls(series.start[kept], series.end[kept], series.radius)

    def in_pieces(self) -> Iterator[tuple[float, Array, Array, Array]]:
        """The capsules of some poses at a time: the share of all before, and start, end (n, 3) and radius (n,)."""
        for first in range(0, len(self.start), _POSES):
            some = slice(first, first + _POSES)
            start = np.ascontiguousarray(self.start[some].reshape(-1, 3), dtype=np.float64)
            end = np.ascontiguousarray(self.end[some].reshape(-1, 3), dtype=np.float64)
            yield first / len(self.start), start, end, np.tile(self.radius, len(self.start[some]))


def kept_poses(ends: Array, step_mm: float) -> IndexArray:
    """Numbers of the poses (n, E, 3) that stay: the first, the last, and each whose successor is too far from the one
    before that stays. So two that stay are further apart than ``step_mm`` only where one step of the drive is."""
    kept = [0]
    for pose in range(1, len(ends)):
        if np.abs(ends[pose] - ends[kept[-1]]).max() <= step_mm:
            continue
        if kept[-1] != pose - 1:
            kept.append(pose - 1)
        if np.abs(ends[pose] - ends[kept[-1]]).max() > step_mm:
            kept.append(pose)
    if kept[-1] != len(ends) - 1:
        kept.append(len(ends) - 1)
    return np.array(kept, dtype=np.int64)


def swept_volume(
    poses: SweptPoses, voxel_mm: float = VOXEL_MM, progress: ProgressCallback = no_progress
) -> SweptVolume:
    """The surface of what a tool has swept: the zero of its distance on a grid, by marching cubes.

    voxel_mm: between the places of the grid, more where those would be over ``MOST_VOXELS``.

    Raises:
        InputError: the voxels are not positive.
    """
    if not voxel_mm > 0.0:
        raise InputError(f"voxels have a positive size in mm, not {voxel_mm!r:.40}")
    from skimage.measure import marching_cubes  # imported here: slow to load

    ends = np.concatenate([poses.start, poses.end]).reshape(-1, 3)
    around = float(poses.radius.max())
    size = np.ptp(ends, axis=0) + 2.0 * around
    voxel = max(voxel_mm, float(np.cbrt(size.prod() / MOST_VOXELS)))
    low = ends.min(axis=0) - around - (_BAND + 1.0) * voxel
    shape = np.ceil((ends.max(axis=0) + around + (_BAND + 1.0) * voxel - low) / voxel).astype(np.int64) + 1
    field = np.full(tuple(shape), _BAND * voxel, dtype=np.float32)
    for share, start, end, radius in poses.in_pieces():
        progress("Sweeping the tool", share)
        lower_field(field, start, end, radius, low, voxel, _BAND * voxel)
    found, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="descent")
    vertices = np.asarray(found, dtype=np.float64) * voxel + low
    corners = vertices[faces] - low
    volume = float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0)
    return SweptVolume(vertices, np.asarray(faces, dtype=np.int64), volume)


def near_passes(
    vertices: Array,
    faces: npt.NDArray[np.integer],
    poses: SweptPoses,
    reach_mm: float = REACH_MM,
    progress: ProgressCallback = no_progress,
) -> NearPasses:
    """How near a tool has passed to the vertices of a surface: those of its triangles with one within reach.

    vertices: (V, 3) LPS mm; faces: (F, 3).

    Raises:
        InputError: the reach is not positive.
    """
    if not reach_mm > 0.0:
        raise InputError(f"near passes have a positive reach in mm, not {reach_mm!r:.40}")
    places, corners = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    ends = np.concatenate([poses.start, poses.end]).reshape(-1, 3)
    around = float(poses.radius.max()) + reach_mm
    near = ((places > ends.min(axis=0) - around) & (places < ends.max(axis=0) + around)).all(axis=1)
    candidates, least = np.ascontiguousarray(places[near]), np.full(len(places), reach_mm)
    measured = np.full(len(candidates), reach_mm)
    for share, start, end, radius in poses.in_pieces():
        progress("Measuring near passes", share)
        lower_least(measured, candidates, start, end, radius)
    least[near] = measured
    shown = corners[(least[corners] < reach_mm).any(axis=1)]
    used, number = np.unique(shown, return_inverse=True)
    return NearPasses(places[used], number.reshape(-1, 3), least[used], reach_mm)
