"""Soft tissue from the CT: length of a tool's centreline in tissue, and surroundings of a point.

The bone surface does not contain skin and mucosa: a tool that is clear of bone can pass through the tip of the nose.
Positions are in the patient frame (LPS, mm).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.files.volume import Volume

TissueKind = Literal["air_inside", "soft_tissue", "outside_body", "outside_scan", "not_known"]

TISSUE_HU = -300.0  # above it skin, mucosa or bone; somewhat above the mean of air and soft tissue
SAMPLE_MM = 0.1  # sample spacing of a centreline: the border of tissue is located to half of it
BODY_GOES_ON_MM = 30.0  # tissue at the border of the scan within this distance of the tool can continue outside
_RAYS = 64
_RAY_MM, _RAY_STEP_MM = 80.0, 1.0
_ENCLOSED = 0.85  # fraction of rays that hit tissue: at most 0.81 outside the body, at least 0.89 in a nostril


@dataclass(frozen=True)
class TissuePassed:
    """Largest length of a tool's centreline in tissue denser than -300 HU over a series of poses.

    length_mm: within the scan; None if no pose is in the scan, or without a scan.
    at_mm: arc length of the path at which the tip is in that pose; None as above.
    complete: False if the length is only a lower bound, because the tool leaves the scan within 30 mm of tissue at its
        border, or if it is unknown. Beyond a border of air, air is assumed.
    """

    length_mm: float | None = None
    at_mm: float | None = None
    complete: bool = False


def tissue_passed(volume: Volume | None, poses: Iterable[tuple[float, Array, Array]]) -> TissuePassed:
    """The largest length of a tool's centreline in tissue over a series of poses.

    poses: the arc length [mm] of the tip along the path, and starts (S, 3) and ends (S, 3) of the tool's axis segments
        in LPS mm, from the tip on, as `Tool.segments` returns them.

    The CT is sampled every 0.1 mm or closer, so that the error of each border of tissue is at most 0.05 mm.
    """
    if volume is None:
        return TissuePassed()
    length, at, exits = None, None, [np.zeros((0, 3))]
    for s, start, end in poses:
        points, weights = _centreline(start, end)
        hu = volume.sample(points, outside=np.nan)
        inside = ~np.isnan(hu)
        if not inside.any():
            continue
        passed = float(weights[inside & (hu > TISSUE_HU)].sum())
        if length is None or passed > length:
            length, at = passed, float(s)
        leaves = inside[1:] != inside[:-1]
        exits.append(np.where(inside[:-1, None], points[:-1], points[1:])[leaves])
    if length is None:
        return TissuePassed()
    return TissuePassed(length, at, not _ends_in_tissue(volume, np.concatenate(exits)))


def surroundings(volume: Volume | None, place: npt.ArrayLike) -> TissueKind:
    """Classify the surroundings of a point (3,) in LPS mm.

    'air_inside' is air enclosed by tissue (airway, sinus, mouth), 'soft_tissue' anything above -300 HU, 'outside_body'
    other air, 'outside_scan' a point outside the CT, 'not_known' the result without a CT. Air counts as enclosed if
    at least 85 % of 64 rays of 80 mm hit tissue within the scan.
    """
    if volume is None:
        return "not_known"
    at = np.asarray(place, dtype=np.float64)
    hu = float(volume.sample(at, outside=np.nan)[0])
    if np.isnan(hu):
        return "outside_scan"
    if hu > TISSUE_HU:
        return "soft_tissue"
    steps = np.arange(_RAY_STEP_MM, _RAY_MM, _RAY_STEP_MM)
    along = at + _directions(_RAYS)[:, None] * steps[:, None]
    meets = (volume.sample(along.reshape(-1, 3)) > TISSUE_HU).reshape(_RAYS, -1).any(axis=1)
    return "air_inside" if meets.mean() >= _ENCLOSED else "outside_body"


def _centreline(start: Array, end: Array) -> tuple[Array, Array]:
    """Sample the tool's axis from its tail to its tip: points (m, 3), and the length (m,) that each represents."""
    lengths = np.linalg.norm(end - start, axis=1)
    points, weights = [], []
    for a, b, length in zip(start[::-1], end[::-1], lengths[::-1], strict=True):
        count = max(1, int(np.ceil(length / SAMPLE_MM)))
        middle = (np.arange(count) + 0.5) / count
        points.append(a + middle[:, None] * (b - a))
        weights.append(np.full(count, length / count))
    return np.concatenate(points), np.concatenate(weights)


def _ends_in_tissue(volume: Volume, exits: Array) -> bool:
    """Whether the scan's outermost voxels contain tissue in the box around the exits (m, 3) extended by 30 mm."""
    if not len(exits):
        return False
    indices, reach = volume.lps_to_index(exits), BODY_GOES_ON_MM / volume.spacing
    last = np.array(volume.hu.shape[::-1]) - 1
    low = np.clip(np.floor(indices.min(axis=0) - reach), 0, last).astype(int)
    high = np.clip(np.ceil(indices.max(axis=0) + reach), 0, last).astype(int)
    box = volume.hu[low[2] : high[2] + 1, low[1] : high[1] + 1, low[0] : high[0] + 1]
    first = [box.take(0, axis=2 - axis) for axis in range(3) if low[axis] == 0]
    final = [box.take(-1, axis=2 - axis) for axis in range(3) if high[axis] == last[axis]]
    return any(bool((face > TISSUE_HU).any()) for face in (*first, *final))


def _directions(count: int) -> Array:
    """Unit vectors (count, 3), distributed evenly over the sphere along a golden spiral."""
    number = np.arange(count) + 0.5
    polar, around = np.arccos(1.0 - 2.0 * number / count), np.pi * (1.0 + np.sqrt(5.0)) * number
    return np.column_stack([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)])
