"""A body cavity as a pathway, analytic: similar to Kwok 2013, fig. 8, whose contours are not published."""

from __future__ import annotations

import numpy as np

from .pathway import Pathway

CONTOURS, ANGLES = 13, 28  # Kwok 2013, fig. 8


def body_cavity() -> Pathway:
    """13 contours of 28 polar radii each, 120 to 180 mm across and 250 mm long, along z from the origin.

    Flattened from front to back, wide in the middle, narrower at both ends, with a spine-like ridge along −y. The polar
    angle 0 is +x.
    """
    share = np.linspace(0.0, 1.0, CONTOURS)
    psi = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    centre = np.column_stack([6.0 * np.sin(np.pi * share), 10.0 * np.sin(2.0 * np.pi * share), 250.0 * share])
    size = 60.0 + 25.0 * np.sin(np.pi * share)  # mm
    oval = 1.0 / np.sqrt(np.cos(psi) ** 2 + (np.sin(psi) / 0.75) ** 2)
    ridge = 1.0 - 0.22 * np.exp(-(((psi - 1.5 * np.pi) / 0.35) ** 2))
    lobes = 1.0 + 0.04 * np.cos(3.0 * psi[None, :] + 4.0 * share[:, None])
    radius = size[:, None] * (oval * ridge)[None, :] * lobes
    return Pathway(centre, radius, count=CONTOURS, first=np.array([1.0, 0.0, 0.0]))
