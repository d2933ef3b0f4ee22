"""Brute-force check of the voxels whether a tool pierces tissue, for `vfix bench piercing`.

It uses only the voxels and their positions from the engine: scipy interpolates them, air is thresholded and measured on
a separate grid around each run of tissue, and connected by labels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vfix_engine.arrays import Array
from vfix_engine.files.volume import Volume

AIR_HU = -300.0
STEP_MM, SAMPLE_MM = 0.5, 0.2
BALL_MM = 1.0  # half the width of air that counts as a passage
GIVES_MM, GIVES_AT_ENTRY_MM, ENTRY_MM = 5.0, 8.0, 20.0
_BESIDE_MM = 15.0  # of the axis on both sides of the tissue


def pierced_runs(volume: Volume, start: Array, end: Array, entry: Array, slack_mm: float = 0.0) -> list[Array]:
    """Return the centres (3,) of the runs of tissue that the axis segments (S, 3) of a pose pierce, LPS mm.

    entry (3,): start of the path. slack_mm: added to how far tissue yields, since two codes with grids of 0.5 mm
    differ.
    """
    axis = _axis(start, end)
    tissue = _hu(volume, axis) > AIR_HU
    borders = np.flatnonzero(np.diff(tissue)) + 1
    pieces = [piece for piece in np.split(np.arange(len(axis)), borders) if tissue[piece[0]]]
    merged = list[NDArray[np.intp]]()
    for piece in pieces:
        if merged and (piece[0] - merged[-1][-1]) * SAMPLE_MM < 2.0 * BALL_MM:
            merged[-1] = np.arange(merged[-1][0], piece[-1] + 1)
        else:
            merged.append(piece)
    inner = [piece for piece in merged if piece[0] > 0 and piece[-1] + 1 < len(axis)]
    found = list[Array]()
    for piece in inner:
        if not _round(volume, axis, int(piece[0]), int(piece[-1]), entry, slack_mm):
            found.append(axis[piece].mean(axis=0))
    return found


def _hu(volume: Volume, places: Array) -> Array:
    """Return Hounsfield units (n,) at places (n, 3) by trilinear interpolation; those of air beyond the scan."""
    from scipy import ndimage  # as above

    index = (places - volume.origin) @ volume.direction / volume.spacing
    found: Array = ndimage.map_coordinates(volume.hu, index.T[::-1], np.float64, order=1, cval=-1000.0)
    return found


def _axis(start: Array, end: Array) -> Array:
    parts = [
        a + np.linspace(0.0, 1.0, max(2, int(np.linalg.norm(b - a) / SAMPLE_MM)))[:, None] * (b - a)
        for a, b in zip(end, start, strict=True)  # from the tip; a segment ends at its front
    ]
    return np.concatenate(parts)


def _round(volume: Volume, axis: Array, first: int, last: int, entry: Array, slack_mm: float) -> bool:
    """Return whether air connects both sides of a run of tissue within the distance that adjacent tissue yields."""
    from scipy import ndimage  # imported where it is used: slow to load
    from scipy.spatial import cKDTree

    beside = int(_BESIDE_MM / SAMPLE_MM)
    window = axis[max(first - beside, 0) : last + beside + 1]
    reach = GIVES_AT_ENTRY_MM + slack_mm + BALL_MM
    low, high = window.min(axis=0) - reach - 2.0, window.max(axis=0) + reach + 2.0
    ticks = [np.arange(a, b, STEP_MM) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1)
    shape = places.shape[:3]
    air = (_hu(volume, places.reshape(-1, 3)) <= AIR_HU).reshape(shape)
    wide = ndimage.distance_transform_edt(air, sampling=STEP_MM) > BALL_MM - 0.5 * STEP_MM
    away = cKDTree(window).query(places.reshape(-1, 3), distance_upper_bound=reach + 1e-6)[0].reshape(shape)
    within, tissue = np.isfinite(away), axis[first : last + 1]
    beside_which = tissue[cKDTree(tissue).query(places[within])[1]]
    near = np.linalg.norm(beside_which - entry, axis=1) <= ENTRY_MM
    gives = np.full(shape, -np.inf)
    gives[within] = np.where(near, GIVES_AT_ENTRY_MM, GIVES_MM) + slack_mm
    labels, _ = ndimage.label(wide & (away <= gives + BALL_MM))
    sides = []
    for side in (axis[max(first - beside, 0) : first], axis[last + 1 : last + beside + 1]):
        near = cKDTree(side).query(places.reshape(-1, 3), distance_upper_bound=BALL_MM + STEP_MM)[0].reshape(shape)
        sides.append(np.unique(labels[np.isfinite(near) & (labels > 0)]))
    return bool(np.intersect1d(sides[0], sides[1]).size)
