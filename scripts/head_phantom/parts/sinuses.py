"""Paranasal sinuses and their ostia."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from head_phantom.blending import Field, intersection
from head_phantom.shapes import Box, Ellipsoid, Halfspaces, Joined, Part, Points, Shape, Shared, Tube

MAXILLARY = Halfspaces(
    [
        ((0.33, 0.0, 0.94), 30.0),  # below the orbit
        ((0.93, 0.0, -0.36), 32.0),  # towards the zygoma
        ((0.10, -0.05, -1.0), 10.2),  # above the roots of the teeth
        ((0.35, -0.93, 0.0), -2.5),  # behind the canine fossa
        ((0.45, 0.89, 0.0), 60.5),  # in front of the pterygopalatine fossa
        ((-1.0, 0.0, 0.0), -12.0),  # the nasal wall itself results from the nasal cavity
    ],
    ((10, 10, -12), (42, 58, 29)),
    8.0,
)
MIDLINE_HALF = Halfspaces([((-1.0, 0.0, 0.0), -0.5)], ((0, 10, 10), (24, 82, 76)), 0.0)
FRONTAL = Shared(
    [Joined([Ellipsoid((9, 21.5, 59), (9.5, 5, 11.5)), Ellipsoid((17, 24, 56), (7, 5, 6))], 4), MIDLINE_HALF], 1.5
)
SPHENOID = Shared(
    [Joined([Ellipsoid((7.3, 64, 24), (9.8, 14, 10)), Ellipsoid((14, 67, 20), (8, 8, 6))], 4), MIDLINE_HALF], 1.5
)


@dataclass(frozen=True)
class EthmoidCells:
    """Cells of a jittered Voronoi pattern, larger towards the back, with thin walls between them."""

    seed: int
    wall: float = 1.0  # [mm]

    @property
    def box(self) -> Box:
        """See Shape."""
        return (2, 18, 20), (19, 57, 43)

    @cached_property
    def _cells(self) -> cKDTree:
        random = np.random.default_rng(self.seed)
        centres: list[npt.NDArray[np.float64]] = []
        for y in (15.0, 20.0, 26.0, 32.5, 39.5, 47.5, 56.0, 65.0):
            size = 6.0 + 0.09 * (y - 20.0)
            grid = itertools.product(np.arange(5.0, 26.0, size), [y], np.arange(15.0, 54.0, size))
            centres.extend(np.array(centre) + random.uniform(-2.7, 2.7, 3) for centre in grid)
        return cKDTree(np.array(centres))

    def distance(self, at: Points) -> Field:
        """See Shape."""
        height = at.z - np.float32(31.5) + np.float32(0.12) * (at.y - np.float32(37))
        labyrinth = intersection(
            np.abs(at.x - np.float32(10.5)) - np.float32(7.5), np.abs(at.y - np.float32(37.5)) - 17.5, 4
        )
        labyrinth = intersection(labyrinth, np.abs(height) - np.float32(9.5), 4)
        shape = np.broadcast_shapes(at.x.shape, at.y.shape, at.z.shape)
        query = np.stack([np.broadcast_to(axis, shape) for axis in at], axis=-1).reshape(-1, 3)
        distance, cell = self._cells.query(query, k=2)
        apart = np.linalg.norm(self._cells.data[cell[:, 1]] - self._cells.data[cell[:, 0]], axis=1)
        to_wall = ((distance[:, 1] ** 2 - distance[:, 0] ** 2) / (2 * apart)).astype(np.float32).reshape(shape)
        return intersection(labyrinth, np.float32(self.wall / 2) - to_wall, 1.2)


@dataclass(frozen=True)
class Sinus:
    """A paired sinus: it keeps `wall` mm of bone to every earlier cavity, and `cover` mm to the outside."""

    name: str
    left: Shape
    wall: float
    cover: float | None = None
    rounding: float = 1.5


SINUSES = (
    Sinus("maxillary", MAXILLARY, 1.0, cover=0.3),
    Sinus("frontal", FRONTAL, 1.2, cover=2.2),
    Sinus("sphenoid", SPHENOID, 1.2),
    Sinus("ethmoid", EthmoidCells(5), 0.9, rounding=1.2),
)

MAXILLARY_OSTIUM = Tube([(19, 31, 18.5), (8.2, 30.5, 19.5)], [1.42, 1.42])
SPHENOID_OSTIUM = Tube([(3.2, 50.5, 27.5), (4.2, 58, 26.8)], [1.1, 1.1])
OSTIA = (
    Part("maxillary ostium", MAXILLARY_OSTIUM, paired=True),
    Part("frontal recess", Tube([(7.4, 26, 33), (7.4, 24, 42), (7.2, 21.5, 52)], [1.5, 1.5, 1.5]), paired=True),
    Part("sphenoid ostium", SPHENOID_OSTIUM, paired=True),
    Part("posterior ethmoid ostium", Tube([(7.0, 46, 28.5), (10, 46.5, 30)], [1.1, 1.1]), paired=True),
    Part("bulla ostium", Tube([(8.0, 36, 24.5), (11, 36.5, 27)], [1.1, 1.1]), paired=True),
    Part("anterior ethmoid ostium", Tube([(8.0, 27, 26.5), (11, 28, 30)], [1.1, 1.1]), paired=True),
)
