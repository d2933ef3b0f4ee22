"""Directions and places of the patient frame (LPS, mm) in plain words with their letters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# By axis of LPS, of its positive and its negative direction: letter, way there, and 'on that side of a place'.
_SIDES = (
    (("L", "towards the left", "left of"), ("R", "towards the right", "right of")),
    (("P", "towards the back", "behind"), ("A", "towards the front", "in front of")),
    (("S", "upwards", "above"), ("I", "downwards", "below")),
)
_STAYS = {"L": "to the left", "R": "to the right", "P": "behind", "A": "in front", "S": "above", "I": "below"}
_ALONG = 0.999  # cosine: a direction so near to an axis is along it


def direction_words(direction: Sequence[float]) -> str:
    """Where the shaft leaves to, seen from the tip: 'The shaft leaves towards the front (A), 20° downwards (I).'"""
    order = sorted(range(3), key=lambda axis: -abs(direction[axis]))
    parts = []
    for axis in order:
        angle = round(float(np.degrees(np.arcsin(min(abs(direction[axis]), 1.0)))))
        letter, towards, _ = _SIDES[axis][0 if direction[axis] > 0.0 else 1]
        parts.append((angle, f"{towards} ({letter})"))
    leaning = [f"{angle}° {words}" for angle, words in parts[1:] if angle]
    return f"The shaft leaves {parts[0][1]}" + (f", {' and '.join(leaning)}" if leaning else "") + "."


def half_space_words(point: Sequence[float], normal: Sequence[float]) -> str:
    """Which side of a plane is kept free, and on which the tool stays: 'Kept free above S 12.0, the tool stays below'.

    normal: into the side where the tool stays, of any length.
    """
    unit = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    axis = int(np.abs(unit).argmax())
    stays = _SIDES[axis][0 if unit[axis] > 0.0 else 1]
    free = _SIDES[axis][1 if unit[axis] > 0.0 else 0]
    place = f"{_SIDES[axis][0 if point[axis] >= 0.0 else 1][0]} {abs(point[axis]):.1f}"
    tilted = "" if abs(unit[axis]) >= _ALONG else ", tilted"
    return f"Kept free {free[2]} {place}{tilted}; the tool stays {_STAYS[stays[0]]}"
