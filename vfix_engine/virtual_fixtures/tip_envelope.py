"""Envelope of the tip: a convex shape that the tip stays in (Li 2004, III, step 1; Li 2007, III.C, step 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from dataclasses import field as made

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..geometry.shape_distance import signed_distance
from ..geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from .fixture import Rows, Situation
from .polyhedra import BALL_DIRECTIONS
from .tip_limit import TipLimit, TipPlace, inside_rows, tightened_mm
from .zones import SHAPES, check_name


@dataclass(frozen=True, eq=False)
class TipEnvelope(TipLimit):
    """The tip stays in a sphere, capsule or box, or behind the plane of a half-space, at every instant of every motion.

    Several envelopes act together: the tip stays in all of them. The rest of the tool may leave them.

    Rows: the planes of a box or a half-space, which are exact; of a round shape the tangent plane that faces the tip,
    and those of 32 even directions. ``tip_limit.tightened_mm`` bounds what a step within them may exceed.
    Certificate: the signed distance to a convex shape is convex, so on a chord it is at most that of one of its ends.

    A start outside is refused. From a state outside that was measured elsewhere, the tip may only come nearer.

    Args:
        name: for messages. shape: solid, in the patient frame, mm; the normal of a half-space points out of it.

    Raises:
        InputError: the name is not printable text, the shape is not one of these, or it is smaller than 0.05 mm.

    Example:
        >>> from vfix_engine.geometry.shapes import Sphere
        >>> TipEnvelope("sinus", Sphere((0, 0, 0), radius=8.0)).words
        "the envelope 'sinus'"
    """

    name: str
    shape: Shape
    _normals: Array = made(init=False, repr=False)
    _offsets: Array = made(init=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.name, "envelope")
        if not isinstance(self.shape, SHAPES):
            raise InputError(
                f"{self.words} is a {type(self.shape).__name__}; it is a sphere, a capsule, a box or a half-space"
            )
        if self._size < 0.05:
            raise InputError(f"{self.words} is {self._size:g} mm small; the tip needs 0.05 mm at least")
        normals, offsets = _planes(self.shape)
        object.__setattr__(self, "_normals", normals)
        object.__setattr__(self, "_offsets", offsets)

    @property
    def words(self) -> str:
        """\"the envelope 'sinus'\"."""
        return f"the envelope '{self.name}'"

    def start_words(self, room: float) -> str:
        """Why a tip that far outside cannot start, and what to do."""
        return (
            f"the tip would start {max(-room, 0.0):.2f} mm outside {self.words}; move the entry, or make the "
            "envelope larger"
        )

    def rows(self, now: Situation) -> Rows:
        """One constraint row for a half-space, 6 for a box, 33 for a sphere or capsule, in mm."""
        tip, shape = now.state.tip.position, self.shape
        normals, reach = self._normals, self._offsets - self._normals @ tip
        if isinstance(shape, Sphere | CapsuleShape):
            away = tip - _core(shape, tip)
            distance = float(np.linalg.norm(away))
            if distance > 0.0:
                normals = np.vstack([normals, away / distance])
                reach = np.append(reach, shape.radius - distance)
            tightened = tightened_mm(now, shape.radius)
        else:
            tightened = min(tightened_mm(now, math.inf), 0.25 * self._size)
        return inside_rows("envelope", self.words, now, normals, reach - tightened)

    def _narrowed(self, by_mm: float) -> TipEnvelope:
        shape = self.shape
        if isinstance(shape, Box):
            return TipEnvelope(self.name, Box(shape.transform_box_to_patient, shape.half_size - by_mm))
        if isinstance(shape, Sphere):
            return TipEnvelope(self.name, Sphere(shape.centre, shape.radius - by_mm))
        if isinstance(shape, CapsuleShape):
            return TipEnvelope(self.name, CapsuleShape(shape.start, shape.end, shape.radius - by_mm))
        assert isinstance(shape, HalfSpace)  # the constructor has refused others
        return TipEnvelope(self.name, HalfSpace(shape.point - by_mm * shape.normal, shape.normal))

    @property
    def _size(self) -> float:
        """Radius, or smallest half size, in mm."""
        if isinstance(self.shape, Box):
            return float(self.shape.half_size.min())
        return math.inf if isinstance(self.shape, HalfSpace) else self.shape.radius

    def look(self, place: Array) -> TipPlace:
        """The signed distance of a position (3,)."""
        return TipPlace(place, float(signed_distance(self.shape, place[None])[0]))

    def between(self, one: TipPlace, two: TipPlace) -> float:
        """The larger one: the signed distance to a convex shape is convex."""
        return max(one.excess, two.excess)


def _core(shape: Sphere | CapsuleShape, place: Array) -> Array:
    """The point of the centre or axis that is nearest to a place (3,)."""
    if isinstance(shape, Sphere):
        return shape.centre
    along = shape.end - shape.start
    square = float(along @ along)
    share = min(max(float((place - shape.start) @ along) / square, 0.0), 1.0) if square > 0.0 else 0.0
    nearest: Array = shape.start + share * along
    return nearest


def _planes(shape: Shape) -> tuple[Array, Array]:
    """Planes n·x ≤ offset that contain the shape and touch it: (m, 3) and (m,)."""
    if isinstance(shape, HalfSpace):
        return shape.normal[None], np.array([shape.normal @ shape.point])
    if isinstance(shape, Box):
        turn, centre = shape.transform_box_to_patient[:3, :3], shape.transform_box_to_patient[:3, 3]
        normals = np.vstack([turn.T, -turn.T])
        return normals, normals @ centre + np.tile(shape.half_size, 2)
    ends = shape.centre[None] if isinstance(shape, Sphere) else np.stack([shape.start, shape.end])
    return BALL_DIRECTIONS, (BALL_DIRECTIONS @ ends.T).max(axis=1) + shape.radius
