"""Polyps and labels on the wall of a lumen, as a route stores them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta

from app.operations.fields import Name, Place, StoredId
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:  # slow to load, as in `paths`
    from vfix_engine.geometry.curve import Curve

MOST_MARKS = 200  # of one route
_NEAR_MM = 60.0  # a ray that meets no wall up to there looks along the lumen, or out of it
_TRIES = 50
MarkKind = Literal["polyp", "label"]


class MarkStyle(NamedTuple):
    """How marks of a kind are told apart.

    letter: their ids begin with it; many: of them, in words; colour: in 3D, kept here as the scene is slow to load.
    """

    letter: str
    many: str
    colour: tuple[int, int, int]


MARK_KINDS: dict[MarkKind, MarkStyle] = {
    "polyp": MarkStyle("p", "polyps", (250, 204, 92)),
    "label": MarkStyle("l", "labels", (229, 143, 208)),
}


class RouteMark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A polyp or a label. at: its place on the wall, LPS mm."""

    id: StoredId
    kind: MarkKind
    name: Name
    at: Place


RouteMarks = Annotated[tuple[RouteMark, ...], Meta(max_length=MOST_MARKS)]


def seeded_places(mesh: TriangleMesh, curve: Curve, count: int, seed: int) -> Array:
    """Places (count, 3) mm on the wall, one in each of so many equal parts of the way, around it at random.

    Of every part one arc length and one direction across the curve are drawn, until a ray from the curve meets the
    wall; equal seeds give equal places.

    Raises:
        InputError: no wall is met in one of the parts.
    """
    from vfix_engine.anatomy.lumen.wall import Wall
    from vfix_engine.geometry.transport import transported

    wall, draw = Wall(mesh), np.random.default_rng(seed)
    points = curve.points
    tangent = curve.tangent(np.arange(len(points)) * curve.step_mm)
    first = transported(points, tangent)
    found = []
    for part in range(count):
        for _ in range(_TRIES):
            s, turn = (part + draw.uniform()) * curve.length / count, draw.uniform(0.0, 2.0 * np.pi)
            near = min(round(s / curve.step_mm), len(points) - 1)
            across = np.cos(turn) * first[near] + np.sin(turn) * np.cross(tangent[near], first[near])
            distance = float(wall.seen(points[near], across)[0])
            if distance <= _NEAR_MM:
                found.append(points[near] + distance * across)
                break
        else:
            a, b = (round(number * curve.length / count) for number in (part, part + 1))
            raise InputError(f"no wall is seen between {a} and {b} mm of the way; is the surface closed?")
    return np.array(found)
