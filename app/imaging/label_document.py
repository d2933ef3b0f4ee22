"""Painted labels as documents: where they begin, and the strokes since."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.documents import DocumentKind
from app.kit.values import number
from vfix_engine.anatomy.labels.painting import Stroke, VoxelPlace
from vfix_engine.errors import ImageError, InputError

SCHEMA = "vfix-label/1"
# A state holds the strokes since its start, so what a stroke stores is bounded by these.
MOST_STROKES = 40
MOST_POINTS = 4000
FIRST_COLOUR = "#e0409a"  # apart from outlines of bone and the tint of a threshold
_COLOUR = re.compile(r"#[0-9a-f]{6}")
_START = re.compile(r"(sha256:[0-9a-f]{64})?")
_STROKE = {"mode", "brush", "radius_mm", "points", "normal"}


@dataclass(frozen=True)
class PaintedLabel:
    """A label on the grid of one of its case's volumes.

    volume: name of that volume. colour: '#rrggbb'. start: 'sha256:' and the hash of the stored mask that the strokes
    are drawn upon, '' where they begin with nothing. strokes: in their order.
    """

    volume: str = ""
    colour: str = FIRST_COLOUR
    start: str = ""
    strokes: tuple[Stroke, ...] = ()

    @property
    def key(self) -> str:
        """What its voxels depend on, as a hash: two contents of one key have the same voxels."""
        data = {**label_to_json(self), "colour": ""}
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def label_to_json(content: PaintedLabel) -> dict[str, Any]:
    """The content as plain JSON values, each number unrounded."""
    strokes = [
        {
            "mode": stroke.mode,
            "brush": stroke.brush,
            "radius_mm": stroke.radius_mm,
            "points": [list(point) for point in stroke.points],
            "normal": list(stroke.normal),
        }
        for stroke in content.strokes
    ]
    return {"volume": content.volume, "colour": content.colour, "start": content.start, "strokes": strokes}


def label_from_json(data: Mapping[str, Any]) -> PaintedLabel:
    """The inverse of `label_to_json`, checked. Raises InputError or one of its kinds."""
    known = {"volume", "colour", "start", "strokes"}
    if set(data) != known or not isinstance(data["strokes"], list):
        raise InputError(f"a painted label has {', '.join(sorted(known))}, and says each of them.")
    strokes = tuple(_stroke(item) for item in data["strokes"])
    return check_label_content(PaintedLabel(data["volume"], data["colour"], data["start"], strokes))


def check_label_content(content: PaintedLabel) -> PaintedLabel:
    """The content, where its words are well formed; strokes check themselves. Raises InputError."""
    if not isinstance(content.volume, str) or len(content.volume) > 64:
        raise InputError("a painted label names one of the case's volumes.")
    if not isinstance(content.colour, str) or not _COLOUR.fullmatch(content.colour):
        raise InputError("a label's colour is written as '#rrggbb', in lower case.")
    if not isinstance(content.start, str) or not _START.fullmatch(content.start):
        raise InputError("a label begins with nothing, or with a stored mask.")
    return content


def _stroke(item: Any) -> Stroke:
    if not isinstance(item, Mapping) or set(item) != _STROKE:
        raise InputError(f"each stroke of a label has {', '.join(sorted(_STROKE))}.")
    if not isinstance(item["points"], list):
        raise InputError("the points of a stroke are a list.")
    points = tuple(_place(point) for point in item["points"])
    radius = number(item["radius_mm"], "the radius of a stroke")
    try:
        return Stroke(item["mode"], item["brush"], radius, points, _place(item["normal"]))
    except ImageError as error:
        raise InputError(str(error)) from error


def _place(value: Any) -> VoxelPlace:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError("a place of a stroke is a list of three numbers, in mm.")
    x, y, z = (number(part, "a place of a stroke") for part in value)
    return x, y, z


LABEL = DocumentKind(
    name="label",
    noun="painted label",
    schema=SCHEMA,
    empty=PaintedLabel,
    read=label_from_json,
    write=label_to_json,
    check=check_label_content,
)
