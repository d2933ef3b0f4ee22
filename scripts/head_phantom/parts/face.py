"""The face between forehead and upper teeth: brow, orbits, cheek bones, maxilla."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from head_phantom.blending import Field, intersection
from head_phantom.shapes import Box, Ellipsoid, Part, Points, Tube

BROW = (
    Part(
        "supraorbital margin",
        Tube(
            [(0, 18.5, 51), (12, 17.5, 55), (30, 20.5, 58.5), (43, 28.5, 54), (48, 33.5, 46)], [4.4, 4.6, 3.8, 3.6, 3.4]
        ),
        9,
        paired=True,
    ),
    Part("superciliary arch", Tube([(5, 16.5, 57), (15, 16.5, 60), (26, 19.5, 64)], [3.6, 3.4, 2]), 9, paired=True),
)

MAXILLA = (
    Part("body of the maxilla", Ellipsoid((0, 34, 8), (36, 31, 20)), 6),
    Part("between the orbits", Ellipsoid((0, 34, 24), (17, 27, 26)), 6),
    Part("frontal process", Tube([(9.5, 14, 46), (11.5, 10.5, 34), (15, 9.5, 24)], [3.4, 3.2, 3.6]), 6, paired=True),
    Part("root of the nose", Ellipsoid((0, 5, 47), (10, 7.5, 4.5)), 6, taken=True),
    Part("canine fossa", Ellipsoid((25.5, -0.5, 6), (9, 8.5, 8)), 6, paired=True, taken=True),
)

CHEEK = (
    Part(
        "frontal process",
        Tube([(44, 29.5, 53), (48.5, 34, 42), (47.5, 31.5, 28), (42, 25, 17)], [3.8, 3.9, 4.4, 5]),
        7,
        True,
    ),
    Part(
        "lateral wall of the orbit",
        Tube([(46, 31.5, 39), (42.5, 42, 37), (36, 54, 36)], [4.4, 3.8, 3], (1, 1, 3.4)),
        6,
        True,
    ),
    Part("zygomatic body", Ellipsoid((41.5, 26.5, 13), (10, 7.5, 10)), 8, True),
    Part("infraorbital margin", Tube([(43, 24, 17), (28, 17, 20), (14, 12.5, 25)], [4.2, 3.2, 3.2]), 6, True),
    Part(
        "zygomatic arch",
        Tube(
            [(45, 29, 11), (55, 39, 9), (63, 52, 8.2), (65.5, 66, 9), (65.5, 80, 11), (63.5, 93, 14)],
            [4.2, 3.1, 2.3, 2.0, 2.2, 3.2],
            (1, 1, 2.1),
        ),
        5,
        True,
    ),
    Part("zygomaticoalveolar crest", Tube([(40, 29.5, 8), (35, 32, 0), (29, 35, -7)], [4.4, 4.5, 4.2]), 10, True),
)

INFRAORBITAL_CANAL = Tube([(26.5, 4, 9.5), (27, 12, 13.5), (28, 26, 18.5)], [1.9, 1.6, 1.2])
FACIAL_FORAMINA = (
    Part("supraorbital notch", Tube([(22, 10, 52.5), (22, 32, 51.5)], [1.6, 1.6]), 1.2, paired=True, taken=True),
    Part("zygomaticofacial foramen", Tube([(46, 12, 16), (43, 26, 15)], [0.9, 0.7]), 0.5, paired=True, taken=True),
)


@dataclass(frozen=True)
class Orbit:
    """Four-sided cone with round edges, from the orbital margin back and inwards to the optic canal."""

    front_y: float = -6.0  # open in front: it ends where there is no bone
    margin_y: float = 10.0
    depth: float = 48.0
    radius: float = 19.6
    apex_radius: float = 3.8
    exponent: float = 2.7  # 2 is a circle, more is squarer
    height: float = 1.0 / 1.12  # of the width
    droop: float = 0.17  # [rad] by which the outer corner is lower

    @property
    def box(self) -> Box:
        """See Shape."""
        return (2, self.front_y, 12), (62, 61, 63)

    def distance(self, at: Points) -> Field:
        """See Shape."""
        depth = np.clip((at.y - np.float32(self.margin_y)) / np.float32(self.depth), -0.4, 1.1)
        across = at.x - (np.float32(34.3) - np.float32(16.5) * depth)
        up = at.z - (np.float32(38) - np.float32(6) * depth)
        cos, sin = np.float32(np.cos(self.droop)), np.float32(np.sin(self.droop))
        across, up = across * cos - up * sin, (up * cos + across * sin) / np.float32(self.height)
        m = np.float32(self.exponent)
        reach = (np.abs(across) ** m + np.abs(up) ** m) ** (1 / m)
        taper = np.float32(self.radius - self.apex_radius) * np.clip(depth, 0, 1) ** np.float32(1.35)
        side = (reach - np.float32(self.radius) + taper) * np.float32(0.93)
        ends = np.maximum(at.y - np.float32(self.margin_y + self.depth + 2), np.float32(self.front_y) - at.y)
        return intersection(side, ends, 5)


ORBITS = (Part("orbit", Orbit(), paired=True),)
