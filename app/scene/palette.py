"""Colours of the scene, and the colour-blind-safe scale of the clearance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

BONE = (226, 216, 198)
WALL = (214, 134, 120)  # of a lumen
ANATOMY = {"bone": BONE, "lumen": WALL}  # by the role of the structure that a case is driven in
SEEN_WALL = (90, 190, 160)  # that a robot can view
TASK_LABEL = (240, 234, 218)  # of study II: as its paper in the picture
TIP_WAY, TIP_CUT = (150, 156, 164), (214, 40, 40)  # of the tool's tip, and where it is cutting
SOUGHT = ((33, 77, 255), (51, 217, 153), (255, 238, 40))  # a polyp of a task: not in view, half way, at its best
DONE = (84, 205, 130)  # a polyp or a label of a task that is done
SKIN = (222, 164, 138)
ACCENT = (109, 179, 242)
SELECTED = (255, 255, 255)
TARGET = (229, 143, 208)
ERROR_RING = (176, 38, 134)  # darker than targets, since it shows faintly over bone
UNKNOWN = (84, 92, 106)  # distinct from every colour of the scale, including its pale middle
TOOL = (206, 212, 220)
ROBOT = (92, 104, 120)
GRIP = (109, 179, 242)
GRIP_WATCHED = (130, 138, 150)
FORCE = (250, 204, 92)
BLOCKED = (240, 133, 125)
PIERCED = (230, 30, 40)  # the tissue that a planned tool pierces
TRUE_TIP = (250, 204, 92)  # where a tool truly is, beside where it is believed to be
CENTRE = (126, 211, 165)
FIDUCIAL = (126, 211, 165)
FOUND_BEAD = (250, 204, 92)
MEASURED = (255, 122, 89)  # where a point of a registration was measured

# Evenly spaced stops, orange to blue through near-white: distinguishable with every common kind of colour blindness.
SCALE_COLOURS = ("#d9480f", "#f59f45", "#f7e3c0", "#b9d8ee", "#5aa5dd")
CLEARANCE_LOW_MM = 0.0
CLEARANCE_HIGH_MM = 2.0

_SCALE = np.array([[int(code[i : i + 2], 16) for i in (1, 3, 5)] for code in SCALE_COLOURS], dtype=np.float64)


def hex_colour(rgb: tuple[int, int, int]) -> str:
    """Return a colour as '#rrggbb'."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def clearance_colours(clearance_mm: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return colours (n, 3) of clearances (n,) in mm; unknown ones (NaN) are grey."""
    values = np.asarray(clearance_mm, dtype=np.float64)
    fraction = np.clip((values - CLEARANCE_LOW_MM) / (CLEARANCE_HIGH_MM - CLEARANCE_LOW_MM), 0.0, 1.0)
    known = np.isfinite(values)
    stops = np.linspace(0.0, 1.0, len(_SCALE))
    colours = np.stack([np.interp(np.where(known, fraction, 0.0), stops, _SCALE[:, i]) for i in range(3)], axis=-1)
    colours[~known] = UNKNOWN
    return np.rint(colours).astype(np.uint8)
