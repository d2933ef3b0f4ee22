"""Nasal cavity, its bony aperture, septum and turbinates, nostrils."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.interpolate import PchipInterpolator, RectBivariateSpline

from head_phantom.blending import Field, intersection
from head_phantom.shapes import Box, Pair, Part, Points, Shape, Tube, polygon, smooth_line, trace

_WIDTH_Y = (-6, 0, 5, 10, 16, 22, 30, 40, 48, 54, 60)
_WIDTH_Z = (-10, 0, 5, 10, 15, 20, 25, 30, 35, 40, 45)
_HALF_WIDTH = (
    (8, 9.5, 10.5, 10.5, 9.6, 8.2, 6.8, 5.0, 3.4, 2.2, 2),
    (9, 11, 12, 12, 11, 9.4, 7.4, 5.5, 4, 2.4, 2),
    (10, 12, 13, 13, 12, 10.2, 8.2, 6.2, 4.6, 2.8, 2),
    (11.5, 13.5, 14, 13.8, 12.8, 11.2, 9, 7, 5.5, 4, 2.5),
    (14, 16, 16.2, 15.4, 13.8, 12, 10, 8, 6.5, 5, 3),
    (16, 17, 17.4, 16.6, 15, 13, 9.6, 7, 5.5, 4.5, 3),
    (17, 18, 18, 17, 15.5, 13.5, 9, 6, 5, 4, 3),
    (17, 18, 18, 17, 15.5, 13.2, 9, 6, 5, 4, 3),
    (16, 17, 17, 16, 14.2, 12, 8.5, 6, 5, 4, 3),
    (14, 14.5, 14.5, 14, 12.2, 10, 8, 6, 5, 4, 3),
    (13, 13.5, 13.5, 13, 11.5, 9.5, 7.5, 5.5, 5, 4, 3),
)
_PROFILE = (
    (-6, 4), (2, -0.5), (10, -1.5), (25, -3), (45, -6.8), (53, -8.6), (57, -8.6), (58, 4), (57, 10), (55, 14),
    (53.5, 22), (50, 33), (44, 38.5), (30, 42), (18, 44), (11, 42.5), (6, 38), (2, 32.5), (-2, 26.5), (-6, 19),
)  # fmt: skip

SEPTUM_BEND_MM = 1.1


@dataclass(frozen=True)
class NasalCavity:
    """Both halves of the nose together: half-width over the sagittal plane, inside the profile of floor and roof."""

    rounding: float = 6.0
    step: float = 0.5  # [mm] of the table of interpolated half-widths

    @property
    def box(self) -> Box:
        """See Shape."""
        return (-20, -8, -10), (20, 60, 46)

    @cached_property
    def _table(self) -> npt.NDArray[np.float64]:
        y = np.arange(_WIDTH_Y[0], _WIDTH_Y[-1] + self.step, self.step)
        z = np.arange(_WIDTH_Z[0], _WIDTH_Z[-1] + self.step, self.step)
        return np.asarray(RectBivariateSpline(_WIDTH_Y, _WIDTH_Z, np.array(_HALF_WIDTH), kx=2, ky=2)(y, z))

    def distance(self, at: Points) -> Field:
        """See Shape."""
        place = [(at.y - _WIDTH_Y[0]) / self.step, (at.z - _WIDTH_Z[0]) / self.step]
        half_width = ndimage.map_coordinates(self._table, place, order=1, mode="nearest").astype(np.float32)
        side: Field = (np.abs(at.x) - half_width) * np.float32(0.92)
        return intersection(side, polygon(at.y, at.z, _PROFILE), self.rounding)


@dataclass(frozen=True)
class PiriformRim:
    """The space in front of the bony rim of the nose, seen from the side: nasal bones above, spine below."""

    half_width: float = 11.0
    bottom: float = -2.0

    @property
    def box(self) -> Box:
        """See Shape."""
        return (-self.half_width - 4, -30, self.bottom), (self.half_width + 4, 12, 60)

    def in_front(self, at: Points) -> Field:
        """Return a distance that is negative in front of the rim."""
        z = np.arange(-30.0, 80.0, 0.5)
        rim = PchipInterpolator(
            [-30, -4, 0, 2, 6, 12, 18, 23, 27, 30, 33, 36, 80],
            [-6, -4, -0.6, 2.6, 7.2, 9.8, 9.0, 6.6, 3.2, -0.6, -5.0, -12, -30],
        )(z)
        at_height = ndimage.map_coordinates(rim, [(at.z + 30.0) / 0.5], order=1, mode="nearest")
        beside = np.maximum(np.abs(at.x) - self.half_width, 0)  # where the rim merges into the face
        in_front: Field = ((at.y - at_height + 1.2 * beside) * 0.8).astype(np.float32)
        return in_front

    def distance(self, at: Points) -> Field:
        """See Shape."""
        return intersection(self.in_front(at), np.float32(self.bottom) - at.z, 4)


@dataclass(frozen=True)
class Septum:
    """A bent sheet in the midline, cut to an outline in the y-z plane; it may swell in one place.

    bend_mm: largest deviation from its plane, to the left where positive.
    """

    outline: Sequence[Pair]
    half_thickness: float
    swelling: float = 0.0
    bend_mm: float = SEPTUM_BEND_MM

    @property
    def box(self) -> Box:
        """See Shape."""
        side = 2.9 + abs(self.bend_mm)
        return (-side, -10, -12), (side, 62, 48)

    def distance(self, at: Points) -> Field:
        """See Shape."""
        bend = self.bend_mm * np.sin((at.y - 8) / 16) * np.exp(-(((at.z - 18) / 14) ** 2)) - 1.15
        swollen = self.swelling * np.exp(-(((at.y - 14) / 8) ** 2) - ((at.z - 24) / 7) ** 2)
        across = np.abs(at.x - bend) * 0.97 - self.half_thickness - swollen
        return intersection(across.astype(np.float32), polygon(at.y, at.z, self.outline), 1.0)


@dataclass(frozen=True)
class Lamella:
    """A thin curled bone along the nose: a line in the x-z plane drawn out from front to back.

    line: (x, z) about `centre`, whose height falls by `slope` mm per mm behind `slope_from`;
    taper: lengths over which the curl grows at its front end and shrinks at its back end [mm], 0 for none;
    outline: where it ends, in the y-z plane; half_thickness of the sheet [mm].
    """

    line: Sequence[Pair]
    centre: Pair
    outline: Sequence[Pair]
    half_thickness: float
    slope: float = 0.0
    slope_from: float = 0.0
    taper: Pair = (0.0, 0.0)

    @property
    def box(self) -> Box:
        """See Shape."""
        across = self._fine_line[:, 0] + self.centre[0]
        corners = np.array(self.outline)
        low, high = corners.min(axis=0) - 1, corners.max(axis=0) + 1
        half = self.half_thickness
        return (
            (float(across.min()) - half, float(low[0]), float(low[1])),
            (float(across.max()) + half, float(high[0]), float(high[1])),
        )

    @cached_property
    def _fine_line(self) -> npt.NDArray[np.float64]:
        return smooth_line(self.line, 1.3)

    def distance(self, at: Points) -> Field:
        """See Shape."""
        height: Field = np.float32(self.centre[1]) - np.float32(self.slope) * (at.y - np.float32(self.slope_from))
        size: Field = np.ones(1, dtype=np.float32)
        if max(self.taper) > 0:
            ends = np.array(self.outline)[:, 0]
            front, back = (at.y - ends.min()) / self.taper[0], (ends.max() - at.y) / self.taper[1]
            size = (0.3 + 0.7 * np.sqrt(np.clip(np.minimum(front, back), 0, 1))).astype(np.float32)
        sheet = trace((at.x - np.float32(self.centre[0])) / size, (at.z - height) / size, self._fine_line) * size
        shape: Field = sheet - np.float32(self.half_thickness)
        return intersection(shape, polygon(at.y, at.z, self.outline), 1.5)


NASAL_CAVITY = (Part("nasal cavity", NasalCavity()),)
PIRIFORM_RIM = PiriformRim()

# Perpendicular plate above, vomer below; the notch between them holds the cartilage.
BONY_SEPTUM = Septum(
    (
        (-2, -3), (4, 0.5), (11, 3.5), (19, 8), (25.5, 14.5), (22.5, 21), (16.5, 28), (12.5, 36), (11, 45),
        (20, 48), (45, 44), (53, 36), (56, 24), (58.5, 13), (55.5, 4), (51, -9), (25, -6), (8, -5),
    ),
    0.6,
)  # fmt: skip
SEPTUM_WITH_MUCOSA = Septum(
    ((-6, -6), (-7, 10), (-7, 36), (8, 48), (45, 46), (54, 36), (57, 24), (59.3, 13), (56.3, 4), (52, -10)), 1.7, 0.7
)

_INFERIOR_OUTLINE = ((11, -10), (52, -10), (53, 2), (52, 22), (11, 22))
_MIDDLE_OUTLINE = (
    (17, 46), (20, 29), (23, 21), (29.5, 15.6), (42, 11.6), (50, 12.6), (53.5, 18), (53, 22), (44, 25.5), (36, 30.5),
    (33, 36), (33, 46),
)  # fmt: skip
_SUPERIOR_OUTLINE = ((33, 46), (33.4, 37), (36.5, 32.8), (45, 28), (53, 24.5), (54, 40), (50, 46))


@dataclass(frozen=True)
class Turbinate:
    """A turbinate: thin bone, and the same with its mucosa."""

    name: str
    bone: Shape
    with_mucosa: Shape


def _turbinate(name: str, bone: Lamella, half_mucosa: float) -> Turbinate:
    return Turbinate(name, bone, replace(bone, half_thickness=half_mucosa))


TURBINATES = (
    _turbinate(
        "inferior",
        Lamella(
            ((6.4, 8.6), (2.2, 6.4), (-0.8, 5.0), (-3.0, 2.6), (-3.6, -0.2), (-2.6, -2.8), (-0.2, -3.8), (2.2, -2.6),
             (2.8, -0.4), (1.4, 1.0)),
            (12.2, 10.4), _INFERIOR_OUTLINE, 0.5, slope=0.18, slope_from=14.0, taper=(10.0, 14.0),
        ),
        2.3,
    ),
    _turbinate(
        "middle",
        Lamella(
            ((5.0, 50), (5.2, 42), (5.2, 33), (5.6, 26), (6.0, 20), (6.4, 16.4), (8.2, 14.6), (10, 15.8), (9.6, 18)),
            (0.0, 0.0), _MIDDLE_OUTLINE, 0.5, slope=0.12, slope_from=32.0,
        ),
        1.65,
    ),
    _turbinate(
        "superior",
        Lamella(
            ((5.0, 48), (4.9, 40), (4.6, 33), (5.0, 29), (6.4, 27.6), (7.4, 28.6)),
            (0.2, 0.0), _SUPERIOR_OUTLINE, 0.45, slope=0.3, slope_from=45.0,
        ),
        1.1,
    ),
    _turbinate(
        "uncinate process",
        Lamella(
            ((14.5, 10), (11.8, 14), (10.6, 18), (10.2, 22)),
            (0.0, 0.0), ((22, 8), (28.5, 8), (27, 23), (23, 24)), 0.45,
        ),
        0.95,
    ),
)  # fmt: skip

NOSTRILS = (
    Part(
        "nostril and vestibule",
        Tube(
            [(7.5, -14.6, -6.5), (7.4, -13.2, -3.5), (6.7, -11, 1), (6.0, -7.5, 5.6), (5.6, -1, 8), (5.4, 6, 8)],
            [4.8, 4.7, 4.5, 4.6, 4.7, 4.5],
            (1, 1.15, 1),
        ),
        paired=True,
    ),
)
