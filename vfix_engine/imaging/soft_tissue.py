"""Soft tissue around a tool, from the CT: how much of the tool's centreline passes it, and what a place lies in.

The bone surface says nothing about skin and mucosa: a tool that keeps its clearance to bone may run through the nose's
tip. Positions are in the patient frame (LPS, mm).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from vfix_engine.imaging.volume import Volume

Floats = npt.NDArray[np.float64]
Surroundings = Literal["air_inside", "soft_tissue", "outside_body", "outside_scan", "not_known"]

TISSUE_HU = -300.0  # above it skin, mucosa or bone; half way between air and soft tissue, and a little
SAMPLE_MM = 0.1  # between samples of a centreline: a border of tissue is placed to half of it
BODY_GOES_ON_MM = 30.0  # a scan that ends in tissue no farther than this from the tool may have cut off what it passes
_RAYS = 64
_RAY_MM, _RAY_STEP_MM = 80.0, 1.0
_ENCLOSED = 0.85  # share of rays that meet tissue: at most 0.81 outside of the body, down to 0.89 in a nostril


@dataclass(frozen=True)
class TissuePassed:
    """What a tool's centreline passes of tissue denser than -300 HU, in the worst of a series of poses.

    length_mm: the largest length of the centreline in tissue, within the scan; None where no pose is in the scan, or
    there is no scan.
    at_mm: arc length of the path where the tip is in that pose; None as above.
    complete: False where the length is a lower bound: the tool leaves the scan within 30 mm of tissue at its border,
    so more of the body may lie beyond; False as well where nothing is known. Beyond a border that is all air there,
    air is taken to go on.
    """

    length_mm: float | None = None
    at_mm: float | None = None
    complete: bool = False


def tissue_passed(volume: Volume | None, poses: Iterable[tuple[float, Floats, Floats]]) -> TissuePassed:
    """The longest stretch of a tool's centreline in tissue, over a series of poses.

    poses: for each the arc length [mm] of the tip along the path, and starts (S, 3) and ends (S, 3) of the tool's axis
    segments in LPS mm, from the tip on, as `Tool.segments` has them.

    The trilinear HU are sampled every 0.1 mm or closer, so that each border of tissue is off by 0.05 mm at most.
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


def lining_mm(volume: Volume, places: npt.ArrayLike, nearest: npt.ArrayLike) -> float | None:
    """How thick soft tissue lies over bone, in mm: the median over places (n, 3) in air, LPS mm.

    nearest: the point of the bone's surface (n, 3) next to each place. From there towards the place everything denser
    than -300 HU counts, up to the first air. None where no place lies in air within the scan.
    """
    ends, starts = np.asarray(places, dtype=np.float64), np.asarray(nearest, dtype=np.float64)
    found = []
    for start, end in zip(starts, ends, strict=True):
        length = float(np.linalg.norm(end - start))
        steps = np.arange(0.0, length, SAMPLE_MM)
        hu = volume.sample(np.vstack([start + (steps / max(length, SAMPLE_MM))[:, None] * (end - start), end]), np.nan)
        if np.isnan(hu).any() or hu[-1] > TISSUE_HU:
            continue
        found.append(SAMPLE_MM * int(np.argmax(hu <= TISSUE_HU)))
    return float(np.median(found)) if found else None


def surroundings(volume: Volume | None, place: npt.ArrayLike) -> Surroundings:
    """What a place (3,) in LPS mm lies in.

    'air_inside' is air that tissue encloses (airway, sinus, mouth), 'soft_tissue' anything above -300 HU,
    'outside_body' other air, and 'not_known' the answer without a CT. Air counts as enclosed when four of five rays
    from it, of 80 mm, meet tissue within the scan.
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


def _centreline(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Samples (m, 3) of the tool's axis from its tail to its tip, and the length (m,) that each stands for."""
    lengths = np.linalg.norm(end - start, axis=1)
    points, weights = [], []
    for a, b, length in zip(start[::-1], end[::-1], lengths[::-1], strict=True):
        count = max(1, int(np.ceil(length / SAMPLE_MM)))
        middle = (np.arange(count) + 0.5) / count
        points.append(a + middle[:, None] * (b - a))
        weights.append(np.full(count, length / count))
    return np.concatenate(points), np.concatenate(weights)


def _ends_in_tissue(volume: Volume, exits: Floats) -> bool:
    """Whether the scan's outermost voxels hold tissue in the box around the exits (m, 3) that reaches 30 mm further."""
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


def _directions(count: int) -> Floats:
    """Unit vectors (count, 3), spread evenly over the sphere along a golden spiral."""
    number = np.arange(count) + 0.5
    polar, around = np.arccos(1.0 - 2.0 * number / count), np.pi * (1.0 + np.sqrt(5.0)) * number
    return np.column_stack([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)])
