"""Six labels on the wall of a cavity, drawn by a seed among places whose whole line can be traced.

The rule: label k lies in the k-th sixth of the turn about the cavity's axis, one after the other in its lower half,
where the robot has to look back, and in its upper half. A place is drawn there, uniform in height and angle, and a
direction of the arrow, uniform in the label's plane; the label stands clear of the organ beneath it.
Places are drawn again until ``Tracer`` finds bends that trace the line; the number of those that it does not is told.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...errors import InputError
from ...worlds.snake.cavity import ORGANS, CavityCase
from .bend_map import BendMap, Steering
from .labels import DIAMETER_MM, Label
from .tracing import Tracer

LABELS = 6  # Kwok 2013, section IV.C.2
CLEAR_MM, HIGHEST_MM = 0.5, 7.0  # of a label over the wall beneath it; where it stands higher the wall is too uneven
HALVES = ((0.05, 0.5), (0.5, 1.0))  # of the cavity's length from the pelvis up: where labels are drawn, in turns
_LEAN_DEG = 55.0  # between a label's normal and the direction to the axis
_DRAWS = 600  # for one label


class PlacedLabels(NamedTuple):
    """Labels and how they were drawn, from a seed.

    tracings: bends that trace each line, for an oracle. drawn: places on the wall that a label fits on; untraceable: of
    these, whose line cannot be traced. unselected: of the first place drawn for each label, how many could be traced.
    """

    labels: tuple[Label, ...]
    tracings: tuple[tuple[Steering, ...], ...]
    drawn: int
    untraceable: int
    unselected: int
    seed: int

    def to_dict(self) -> dict[str, Any]:
        """How they were drawn, as JSON's types."""
        return {"drawn": self.drawn, "untraceable": self.untraceable, "traceable_without_selection": self.unselected}


def placed_labels(case: CavityCase, bends: BendMap, seed: int, count: int = LABELS) -> PlacedLabels:
    """Draw the first ``count`` of the six labels for a robot in a cavity.

    Raises:
        InputError: no place for a label was found in 600 draws.
    """
    random, wall = np.random.default_rng(seed), Wall(case.mesh)
    tracer = Tracer(bends, wall)
    labels: list[Label] = []
    tracings: list[tuple[Steering, ...]] = []
    drawn = unselected = 0
    for number in range(count):
        first = True
        for _ in range(_DRAWS):
            label = drawn_label(case, wall, random, number)
            if label is None or any(_overlap(label, other) for other in labels):
                continue
            drawn += 1
            found = tracer.trace(label)
            if found is not None:
                unselected += first
                labels.append(label)
                tracings.append(tuple(found))
                break
            first = False
        else:
            raise InputError(f"no place for label {number + 1} was found in {_DRAWS} draws: give another seed")
    return PlacedLabels(tuple(labels), tuple(tracings), drawn, drawn - count, unselected, seed)


def drawn_label(case: CavityCase, wall: Wall, random: np.random.Generator, number: int) -> Label | None:
    """Label ``number`` of six, from 0, at a place that is drawn; None where the wall is too uneven for one."""
    share, angle = random.uniform(*HALVES[number % 2]), 2.0 * math.pi * (number + random.random()) / LABELS
    turn = 2.0 * math.pi * random.random()
    of = case.pathway.contours()
    height = float(share * case.pathway.length)
    centre = np.array([np.interp(height, of.s, of.centre[:, axis]) for axis in range(3)])
    across = np.cross(of.tangent[0], of.first[0])
    out = math.cos(angle) * of.first[0] + math.sin(angle) * across
    distance = float(wall.seen(centre, out)[0])
    if not math.isfinite(distance):
        return None
    point = centre + distance * out
    near = case.mesh.vertices[np.linalg.norm(case.mesh.vertices - point, axis=1) < 0.5 * DIAMETER_MM]
    normal = np.linalg.svd(near - near.mean(axis=0))[2][2]
    normal = normal if normal @ out < 0.0 else -normal
    stands = float(((near - point) @ normal).max()) + CLEAR_MM
    if -float(normal @ out) < math.cos(math.radians(_LEAN_DEG)) or stands > HIGHEST_MM:
        return None
    one = np.cross(normal, of.first[0] if abs(normal @ of.first[0]) < 0.9 else across)
    one /= np.linalg.norm(one)
    along = math.cos(turn) * one + math.sin(turn) * np.cross(normal, one)
    return Label(point + stands * normal, normal, along, _place(case, point))


def _overlap(one: Label, two: Label) -> bool:
    return float(np.linalg.norm(one.centre - two.centre)) < DIAMETER_MM


def _place(case: CavityCase, point: Array) -> str:
    """The organ beneath a point of the wall, in words."""
    nearest = int(np.linalg.norm(case.mesh.triangles.mean(axis=1) - point, axis=1).argmin())
    organ = int(case.organ[nearest])
    return ORGANS[organ].name if organ >= 0 else "wall"
