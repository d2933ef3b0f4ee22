"""Painted labels as documents: where they begin, and the strokes since."""

from __future__ import annotations

import hashlib
import json
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from app.documents import struct_kind
from app.operations.fields import Colour, Position, whole
from vfix_engine.anatomy.labels.painting import LEAST_RADIUS_MM, MOST_POINTS, MOST_RADIUS_MM, Stroke

# A state holds the strokes since its start, so what a stroke stores is bounded by these.
MOST_STROKES = 40
MOST_STORED_POINTS = 4000
FIRST_COLOUR = "#e0409a"  # apart from outlines of bone and the tint of a threshold

Radius = Annotated[float, Meta(ge=LEAST_RADIUS_MM, le=MOST_RADIUS_MM)]  # [mm]
Points = Annotated[tuple[Position, ...], Meta(min_length=1, max_length=MOST_POINTS)]
StoredMask = Annotated[str, Meta(pattern=whole("(sha256:[0-9a-f]{64})?"))]


class LabelStroke(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stroke as it is stored, with the fields of the engine's `Stroke`."""

    mode: Literal["paint", "erase"]
    brush: Literal["disc", "ball"]
    radius_mm: Radius
    points: Points
    normal: Position

    def __post_init__(self) -> None:
        _ = self.stroke

    @property
    def stroke(self) -> Stroke:
        """What the engine draws. Raises ImageError."""
        return Stroke(self.mode, self.brush, self.radius_mm, self.points, self.normal)


class PaintedLabel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A label on the grid of one of its case's volumes.

    volume: name of that volume. start: 'sha256:' and the hash of the stored mask that the strokes are drawn upon, ''
    where they begin with nothing. strokes: in their order.
    """

    volume: Annotated[str, Meta(max_length=64)]
    colour: Colour
    start: StoredMask
    strokes: tuple[LabelStroke, ...]

    @property
    def key(self) -> str:
        """What its voxels depend on, as a hash: two contents of one key have the same voxels."""
        data = msgspec.to_builtins(msgspec.structs.replace(self, colour=""))
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


LABEL = struct_kind(
    name="label",
    noun="painted label",
    schema="vfix-label/1",
    content=PaintedLabel,
    empty=lambda: PaintedLabel("", FIRST_COLOUR, "", ()),
)
