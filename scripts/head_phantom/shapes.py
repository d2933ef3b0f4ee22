"""The solids that the head is made of, each with its box and signed distance [mm], positive outside.

Distances of stretched solids are bounds that are exact near the surface, as blending requires.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline, PchipInterpolator

from head_phantom.blending import Field, intersection, union

Vector = tuple[float, float, float]
Pair = tuple[float, float]
Box = tuple[Vector, Vector]


class Points(NamedTuple):
    """Coordinates of a block of voxels: three arrays that broadcast together, x left, y posterior, z superior [mm]."""

    x: Field
    y: Field
    z: Field


class Shape(Protocol):
    """A solid."""

    @property
    def box(self) -> Box:
        """Return the smallest and largest corner [mm]."""

    def distance(self, at: Points) -> Field:
        """Return the signed distance [mm] at the points."""


@dataclass(frozen=True)
class Ellipsoid:
    """Ellipsoid along the axes of the head."""

    centre: Vector
    semi_axes: Vector

    @property
    def box(self) -> Box:
        return _around([self.centre], self.semi_axes)

    def distance(self, at: Points) -> Field:
        scaled = [(p - np.float32(c)) / np.float32(r) for p, c, r in zip(at, self.centre, self.semi_axes, strict=True)]
        value = np.sqrt(_squares(scaled))
        slope = np.sqrt(_squares([s / np.float32(r) for s, r in zip(scaled, self.semi_axes, strict=True)]))
        bounded: Field = value * (value - 1) / np.maximum(slope, np.float32(1e-4))
        return bounded


@dataclass(frozen=True)
class Tube:
    """Round rod along a smooth curve; a stretch > 1 makes its section taller along that axis.

    points: knots of the curve; radii: one per knot (or one for all); spacing: longest straight piece [mm].
    """

    points: Sequence[Vector]
    radii: Sequence[float]
    stretch: Vector = (1.0, 1.0, 1.0)
    spacing: float = 6.0

    @cached_property
    def _pieces(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        knots = np.array(self.points, dtype=np.float64)
        radii = np.broadcast_to(np.array(self.radii, dtype=np.float64), len(knots))
        if len(knots) == 2:
            return knots, radii
        chord = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))]
        along = np.linspace(0.0, chord[-1], max(int(chord[-1] / self.spacing) + 1, len(knots)))
        return CubicSpline(chord, knots, bc_type=self._ends(knots, chord))(along), PchipInterpolator(chord, radii)(
            along
        )

    @staticmethod
    def _ends(knots: npt.NDArray[np.float64], chord: npt.NDArray[np.float64]) -> object:
        """Return the end conditions: a curve leaves the midline at a right angle, to join both sides smoothly."""
        if knots[0, 0] != 0.0 or knots[1, 0] == 0.0:
            return "natural"
        return ((1, np.array([knots[1, 0] / chord[1], 0.0, 0.0])), (2, np.zeros(3)))

    @property
    def box(self) -> Box:
        reach = max(self.radii) * np.array(self.stretch)
        return _around(self._pieces[0], tuple(reach))

    def distance(self, at: Points) -> Field:
        centres, radii = self._pieces
        scale = np.array(self.stretch)
        scaled = Points(*(p / np.float32(s) for p, s in zip(at, scale, strict=True)))
        distance: Field | None = None
        for a, b, ra, rb in zip(centres[:-1] / scale, centres[1:] / scale, radii[:-1], radii[1:], strict=True):
            piece = _cone(scaled, a, b, float(ra), float(rb))
            distance = piece if distance is None else np.minimum(distance, piece)
        assert distance is not None  # a curve has at least two points
        return distance * np.float32(scale.min())


@dataclass(frozen=True)
class Halfspaces:
    """Convex solid: the points with normal . p < offset for every face, edges rounded."""

    faces: Sequence[tuple[Vector, float]]
    box: Box
    rounding: float

    def distance(self, at: Points) -> Field:
        distance: Field | None = None
        for (a, b, c), offset in self.faces:
            size = np.float32(1 / np.sqrt(a * a + b * b + c * c))
            face = (np.float32(a) * at.x + np.float32(b) * at.y + np.float32(c) * at.z - np.float32(offset)) * size
            distance = face if distance is None else intersection(distance, face, self.rounding)
        assert distance is not None
        return distance


@dataclass(frozen=True)
class Plate:
    """Flat bone: an outline in the y-z plane, of a given thickness about x = at + lean . (y - y0, z - z0)."""

    outline: Sequence[Pair]
    at: float
    half_thickness: float
    lean: tuple[Pair, Pair] = ((0.0, 0.0), (0.0, 0.0))  # (slope, zero) along y and along z
    rounding: float = 1.0
    edge: float = 0.0  # [mm] the outline is grown by this much

    @property
    def box(self) -> Box:
        corners = np.array(self.outline)
        low, high = corners.min(axis=0) - self.edge, corners.max(axis=0) + self.edge
        y, z = np.meshgrid([low[0], high[0]], [low[1], high[1]])
        plane = self._plane(y, z)
        reach = self.half_thickness
        return (
            (float(plane.min()) - reach, float(low[0]), float(low[1])),
            (float(plane.max()) + reach, float(high[0]), float(high[1])),
        )

    def distance(self, at: Points) -> Field:
        across: Field = np.abs(at.x - self._plane(at.y, at.z)) - np.float32(self.half_thickness)
        return intersection(polygon(at.y, at.z, self.outline) - np.float32(self.edge), across, self.rounding)

    def _plane(self, y: npt.NDArray[np.floating], z: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
        (slope_y, y0), (slope_z, z0) = self.lean
        plane: npt.NDArray[np.floating] = (
            np.float32(self.at)
            + np.float32(slope_y) * (y - np.float32(y0))
            + np.float32(slope_z) * (z - np.float32(z0))
        )
        return plane


@dataclass(frozen=True)
class Shared:
    """The intersection of several solids, edges rounded."""

    shapes: Sequence[Shape]
    rounding: float

    @property
    def box(self) -> Box:
        low = np.max([shape.box[0] for shape in self.shapes], axis=0)
        high = np.min([shape.box[1] for shape in self.shapes], axis=0)
        return _pair(low, high)

    def distance(self, at: Points) -> Field:
        distance = self.shapes[0].distance(at)
        for shape in self.shapes[1:]:
            distance = intersection(distance, shape.distance(at), self.rounding)
        return distance


@dataclass(frozen=True)
class Joined:
    """The union of several solids, seams filled."""

    shapes: Sequence[Shape]
    seam: float

    @property
    def box(self) -> Box:
        low = np.min([shape.box[0] for shape in self.shapes], axis=0)
        high = np.max([shape.box[1] for shape in self.shapes], axis=0)
        return _pair(low, high)

    def distance(self, at: Points) -> Field:
        distance = self.shapes[0].distance(at)
        for shape in self.shapes[1:]:
            distance = union(distance, shape.distance(at), self.seam)
        return distance


@dataclass(frozen=True)
class Part:
    """A named piece of anatomy.

    blend: width of the seam with earlier parts [mm]. taken: it is removed instead of added. paired: it is on both sides
    (the shape is that of the left side).
    """

    name: str
    shape: Shape
    blend: float = 0.0
    paired: bool = False
    taken: bool = field(default=False, kw_only=True)


def polygon(u: Field, v: Field, corners: Sequence[Pair]) -> Field:
    """Return the signed distance to a closed outline in a plane; u, v broadcast together."""
    nearest: Field = np.full(1, np.inf, dtype=np.float32)
    inside: npt.NDArray[np.bool_] = np.zeros(np.broadcast_shapes(u.shape, v.shape), dtype=bool)
    for (au, av), (bu, bv) in zip(corners, [*corners[1:], corners[0]], strict=True):
        nearest = np.minimum(nearest, _segment_squared(u, v, (au, av), (bu, bv)))
        if av != bv:
            crossing = (v >= np.float32(min(av, bv))) & (v < np.float32(max(av, bv)))
            at = np.float32(au) + (v - np.float32(av)) * np.float32((bu - au) / (bv - av))
            inside = inside ^ (crossing & (u < at))
    signed: Field = np.sqrt(nearest) * np.where(inside, np.float32(-1), np.float32(1))
    return signed


def trace(u: Field, v: Field, points: npt.ArrayLike) -> Field:
    """Return the distance to an open polyline in a plane; points (n, 2)."""
    line = np.asarray(points, dtype=np.float64)
    nearest: Field = np.full(1, np.inf, dtype=np.float32)
    for a, b in itertools.pairwise(line):
        nearest = np.minimum(nearest, _segment_squared(u, v, (a[0], a[1]), (b[0], b[1])))
    distance: Field = np.sqrt(nearest)
    return distance


def smooth_line(points: Sequence[Pair], spacing: float) -> npt.NDArray[np.float64]:
    """Return points (m, 2) at most `spacing` mm apart on a cubic curve through `points`."""
    knots = np.array(points)
    chord = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))]
    along = np.linspace(0.0, chord[-1], int(chord[-1] / spacing) + 2)
    return np.asarray(CubicSpline(chord, knots, bc_type="natural")(along))


def _segment_squared(u: Field, v: Field, a: Pair, b: Pair) -> Field:
    eu, ev = np.float32(b[0] - a[0]), np.float32(b[1] - a[1])
    wu, wv = u - np.float32(a[0]), v - np.float32(a[1])
    t: Field = np.clip((wu * eu + wv * ev) / np.float32(eu * eu + ev * ev), 0, 1)
    squared: Field = (wu - eu * t) ** 2 + (wv - ev * t) ** 2
    return squared


def _cone(at: Points, a: npt.NDArray[np.float64], b: npt.NDArray[np.float64], ra: float, rb: float) -> Field:
    """Return the distance to a rod from a to b with round ends, whose radius changes from ra to rb."""
    axis = (b - a).astype(np.float32)
    off = [p - np.float32(c) for p, c in zip(at, a, strict=True)]
    t = np.clip((off[0] * axis[0] + off[1] * axis[1] + off[2] * axis[2]) / max(float(axis @ axis), 1e-6), 0, 1)
    t = t.astype(np.float32)
    away = np.sqrt(_squares([o - t * e for o, e in zip(off, axis, strict=True)]))
    distance: Field = away - (np.float32(ra) + np.float32(rb - ra) * t)
    return distance


def _squares(values: Sequence[Field]) -> Field:
    total: Field = values[0] ** 2 + values[1] ** 2 + values[2] ** 2
    return total


def _around(points: npt.ArrayLike, reach: npt.ArrayLike) -> Box:
    at = np.asarray(points, dtype=np.float64)
    return _pair(at.min(axis=0) - np.asarray(reach), at.max(axis=0) + np.asarray(reach))


def _pair(low: npt.NDArray[np.float64], high: npt.NDArray[np.float64]) -> Box:
    return (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2]))
