"""Painting of labels: strokes of a round brush on the grid of a volume, LPS mm, and run-length encoding of labels.

A stroke is stored as the motion of the hand. The same arithmetic in the page
(app/web/js/slices/label-paint.js) gives the same voxels, so the result need not be sent back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.labels.painting_kernel import draw_line
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.errors import ImageError

VoxelPlace = tuple[float, float, float]
StrokeMode = Literal["paint", "erase"]
Brush = Literal["disc", "ball"]

LEAST_RADIUS_MM, MOST_RADIUS_MM = 0.1, 20.0
MOST_POINTS = 2000  # of a stroke
STROKE_COORDINATE_MM = 10_000.0
_UNIT = 1e-3  # tolerance of the length of a unit normal


@dataclass(frozen=True)
class Stroke:
    """One stroke of a brush.

    points: centres of the brush, LPS mm, connected by straight lines.
    brush: 'ball', all voxels whose centre is within radius_mm of that line; 'disc', only those in one layer.
    normal: unit normal of the disc's plane; ignored for a ball. The plane passes through each line's first point.

    Raises ImageError for invalid values.
    """

    mode: StrokeMode
    brush: Brush
    radius_mm: float
    points: tuple[VoxelPlace, ...]
    normal: VoxelPlace = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if self.mode not in get_args(StrokeMode) or self.brush not in get_args(Brush):
            raise ImageError("a stroke paints or erases, with a disc or a ball.")
        if not LEAST_RADIUS_MM <= self.radius_mm <= MOST_RADIUS_MM:
            raise ImageError(
                f"the brush has a radius of {LEAST_RADIUS_MM:g} to {MOST_RADIUS_MM:g} mm, not {self.radius_mm:g}."
            )
        if not 1 <= len(self.points) <= MOST_POINTS:
            raise ImageError(f"a stroke has 1 to {MOST_POINTS:,} points, not {len(self.points):,}.")
        places = np.asarray(self.points, dtype=np.float64)
        if places.shape != (len(self.points), 3) or not (np.abs(places) <= STROKE_COORDINATE_MM).all():
            raise ImageError(f"each point of a stroke is three numbers within {STROKE_COORDINATE_MM:,.0f} mm.")
        normal = np.asarray(self.normal, dtype=np.float64)
        if normal.shape != (3,) or not abs(float(normal @ normal) - 1.0) <= _UNIT:
            raise ImageError("the normal of a disc is a unit vector.")


def draw_stroke(
    mask: BoolArray, transform_index_to_lps: npt.ArrayLike, stroke: Stroke, go_on: Callable[[], object] = bool
) -> None:
    """Paint or erase a stroke in a mask (K, J, I), in place; parts beyond the mask are ignored.

    transform_index_to_lps: (4, 4) affine from (i, j, k) to LPS mm, with voxel centres at integer indices.
    go_on: called before each line of the stroke; an exception from it ends the drawing.
    """
    affine = np.array(transform_index_to_lps, dtype=np.float64)
    places = list(stroke.points)
    for start, end in zip(places, places[1:] or places, strict=False):
        go_on()
        _draw_line(mask, affine, stroke, start, end)


def reaches(shape: tuple[int, ...], transform_index_to_lps: npt.ArrayLike, stroke: Stroke) -> bool:
    """Whether a stroke can reach a voxel of a grid (K, J, I); never False for a stroke that sets one."""
    affine = np.array(transform_index_to_lps, dtype=np.float64)
    reach, places = stroke.radius_mm + _half_layer(affine, stroke), stroke.points
    lines = zip(places, places[1:] or places, strict=False)
    return any(_box(shape, affine, reach, start, end) is not None for start, end in lines)


def _draw_line(mask: BoolArray, affine: Array, stroke: Stroke, start: VoxelPlace, end: VoxelPlace) -> None:
    half = _half_layer(affine, stroke)
    box = _box(mask.shape, affine, stroke.radius_mm + half, start, end)
    if box is None:
        return
    low, high = box
    wx, wy, wz = (end[n] - start[n] for n in range(3))
    disc = stroke.brush == "disc"
    if disc:
        nx, ny, nz = stroke.normal
        across = (wx * nx + wy * ny) + wz * nz
        wx, wy, wz = wx - across * nx, wy - across * ny, wz - across * nz
    draw_line(
        mask,
        affine,
        np.array(start),
        np.array([wx, wy, wz]),
        np.array(stroke.normal),
        half,
        disc,
        stroke.radius_mm * stroke.radius_mm,
        low,
        high,
        stroke.mode == "paint",
    )


def _half_layer(affine: Array, stroke: Stroke) -> float:
    """Half the thickness of a disc, mm: that of a layer of voxels perpendicular to it; 0 for a ball."""
    if stroke.brush == "ball":
        return 0.0
    nx, ny, nz = stroke.normal
    across = (abs(float((affine[0, n] * nx + affine[1, n] * ny) + affine[2, n] * nz)) for n in range(3))
    return 0.5 * max(across)


def _box(
    shape: tuple[int, ...], affine: Array, reach: float, start: VoxelPlace, end: VoxelPlace
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]] | None:
    """First indices i, j, k of the voxels within reach of a line, and those after the last; None if there are none."""
    inverse = np.linalg.inv(affine[:3, :3])
    ends = (np.array([start, end]) - affine[:3, 3]) @ inverse.T
    margin = reach * np.linalg.norm(inverse, axis=1) + 1.0
    counts = np.array(shape[::-1])
    low = np.clip(np.floor(ends.min(axis=0) - margin), 0, counts).astype(np.int64)
    high = np.clip(np.ceil(ends.max(axis=0) + margin) + 1, 0, counts).astype(np.int64)
    return (low, high) if (low < high).all() else None


def runs_of(mask: BoolArray) -> npt.NDArray[np.uint32]:
    """Run lengths of a mask (K, J, I), i fastest: alternately of unset and set voxels."""
    flat = np.ascontiguousarray(mask).ravel()
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    ends = np.concatenate([changes, [flat.size]])
    starts = np.concatenate([[0], changes])
    lengths = (ends - starts).astype(np.uint32)
    return np.concatenate([np.zeros(1, dtype=np.uint32), lengths]) if flat[0] else lengths


def mask_of_runs(runs: npt.NDArray[np.unsignedinteger], shape: tuple[int, int, int]) -> BoolArray:
    """Inverse of `runs_of`; shape: (K, J, I). Raises ImageError if the runs do not fill the mask."""
    if int(runs.astype(np.int64).sum()) != int(np.prod(shape)):
        raise ImageError("the run lengths of a label do not fill its grid.")
    values = np.arange(len(runs)) % 2 == 1
    mask: BoolArray = np.repeat(values, runs.astype(np.int64)).reshape(shape)
    return mask
