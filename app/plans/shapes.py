"""Shapes of a plan's regions: plain JSON values, checked by the engine's own shapes; LPS and mm."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from app.kit.names import check_stored_name
from app.kit.values import Position, check_position, number
from vfix_engine.errors import InputError, PlanError
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere

ShapeDict = Mapping[str, Any]

MAX_CHAIN = 32  # points of a chain of capsules
LEAST_MM, LARGEST_MM = 0.01, 200.0  # radius or half size: less is no thing that a tool can meet, more no part of a head
_FIELDS: dict[str, tuple[str, ...]] = {
    "sphere": ("centre", "radius"),
    "capsule": ("start", "end", "radius"),
    "capsules": ("points", "radius"),
    "box": ("transform_box_to_patient", "half_size"),
    "half_space": ("point", "normal"),
    "patch": ("centre", "radius"),
    "structure": ("structure",),
}
SHAPE_KINDS = tuple(_FIELDS)
_SOLID = ("sphere", "capsule", "box")


def check_shape(shape: Any, kinds: tuple[str, ...] = SHAPE_KINDS) -> dict[str, Any]:
    """The shape of one of the kinds, with its numbers as floats. Raises InputError or one of its kinds.

    Kinds and fields are those of a file of zones; beside them 'capsules', a chain of capsules of one radius along
    points, and 'structure', a structure of the case by its id.
    """
    kind = shape.get("kind") if isinstance(shape, Mapping) else None
    if kind is None:
        raise PlanError(f"a shape has a 'kind', places and sizes in mm; known are {', '.join(kinds)}.")
    if kind not in kinds:
        raise PlanError(f"the kind of a shape is {str(kind)!r:.40}; known are {', '.join(kinds)}.")
    optional = {"structure"} if kind == "patch" else set()
    missing = [name for name in _FIELDS[kind] if name not in shape]
    unknown = sorted(map(str, set(shape) - {"kind", *_FIELDS[kind]} - optional))
    if missing or unknown:
        what = f"needs '{missing[0]}'" if missing else f"has no '{unknown[0]:.40}'"
        raise PlanError(f"a shape of the kind {kind} {what}.")
    values = {name: _READERS[name](shape[name]) for name in _FIELDS[kind]}
    if "structure" in optional and shape.get("structure") is not None:
        values["structure"] = _structure(shape["structure"])
    checked = {"kind": kind, **values}
    solids(checked)
    return checked


def check_least(shape: ShapeDict, named: str) -> None:
    """Raises PlanError for a shape smaller than a new one may be; what is stored is read whatever its size."""
    if (least := min(size_of(shape), default=LEAST_MM)) < LEAST_MM:
        raise PlanError(f"{named} is too small: {least:g} mm; a radius or half size is {LEAST_MM:g} mm at least.")


def check_solid(shape: Any) -> dict[str, Any]:
    """A sphere, a capsule or a box. Raises InputError or one of its kinds."""
    return check_shape(shape, _SOLID)


def solids(shape: ShapeDict) -> tuple[Shape, ...]:
    """The engine's solids of a shape: several of a chain, none of a patch or a structure. Raises InputError."""
    match shape["kind"]:
        case "sphere":
            return (Sphere(shape["centre"], shape["radius"]),)
        case "capsule":
            return (CapsuleShape(shape["start"], shape["end"], shape["radius"]),)
        case "capsules":
            points = shape["points"]
            ends = zip(points[:-1] or points, points[1:] or points, strict=True)
            return tuple(CapsuleShape(start, end, shape["radius"]) for start, end in ends)
        case "box":
            return (Box(np.reshape(shape["transform_box_to_patient"], (4, 4)), shape["half_size"]),)
        case "half_space":
            return (HalfSpace(shape["point"], shape["normal"]),)
    return ()


def _place(value: Any) -> list[float]:
    return list(check_position(value if isinstance(value, (list, tuple)) else ()))


def _chain(value: Any) -> list[list[float]]:
    if not isinstance(value, (list, tuple)) or not 1 <= len(value) <= MAX_CHAIN:
        raise PlanError(f"a chain of capsules needs 1 to {MAX_CHAIN} points.")
    return [_place(point) for point in value]


def _length(value: Any, what: str = "a radius") -> float:
    length = number(value, what)
    if not 0.0 < length <= LARGEST_MM:
        raise PlanError(f"{what} is {length:g} mm; it must be more than 0 and at most {LARGEST_MM:g} mm.")
    return length


def _half_size(value: Any) -> list[float]:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise PlanError("a box's half_size needs three numbers, in mm.")
    return [_length(one, "half of a box's size") for one in value]


def _transform(value: Any) -> list[float]:
    if not isinstance(value, (list, tuple)) or len(value) != 16:
        raise PlanError("transform_box_to_patient must be 16 numbers, row by row.")
    return [number(one, "a box's transform") for one in value]


def _normal(value: Any) -> list[float]:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise PlanError("a normal needs three numbers, LPS.")
    return [number(one, "a normal's component") for one in value]


def _structure(value: Any) -> str:
    try:
        return check_stored_name(value, "structure's id")
    except InputError as error:
        raise PlanError(str(error)) from None


_READERS: dict[str, Callable[[Any], Any]] = {
    "centre": _place, "start": _place, "end": _place, "point": _place, "points": _chain, "radius": _length,
    "half_size": _half_size, "transform_box_to_patient": _transform, "normal": _normal, "structure": _structure,
}  # fmt: skip


def anchor(shape: ShapeDict) -> Position | None:
    """The place that a shape is taken by when it is moved; None of a structure, which stays where it is."""
    match shape["kind"]:
        case "sphere" | "patch":
            return _position(shape["centre"])
        case "capsule":
            return _position(np.add(shape["start"], shape["end"]) / 2.0)
        case "capsules":
            return _position(np.mean(shape["points"], axis=0))
        case "box":
            return _position(shape["transform_box_to_patient"][3::4][:3])
        case "half_space":
            return _position(shape["point"])
    return None


def moved(shape: ShapeDict, to: Position) -> dict[str, Any]:
    """The shape with its anchor at another place. Raises PlanError for a structure."""
    at = anchor(shape)
    if at is None:
        raise PlanError("a structure of the case stays where it is.")
    by = np.subtract(to, at)

    def there(place: Any) -> list[float]:
        return [float(value) for value in np.add(place, by)]

    match shape["kind"]:
        case "capsule":
            return {**shape, "start": there(shape["start"]), "end": there(shape["end"])}
        case "capsules":
            return {**shape, "points": [there(point) for point in shape["points"]]}
        case "box":
            rows = list(shape["transform_box_to_patient"])
            rows[3::4] = [*there(rows[3::4][:3]), rows[15]]
            return {**shape, "transform_box_to_patient": rows}
        case "half_space":
            return {**shape, "point": there(shape["point"])}
    return {**shape, "centre": there(shape["centre"])}


def turned(shape: ShapeDict) -> dict[str, Any]:
    """The half-space on the other side of its plane. Raises PlanError for another shape."""
    if shape["kind"] != "half_space":
        raise PlanError("only a half-space has another side.")
    return {**shape, "normal": [0.0 - value for value in shape["normal"]]}


def size_of(shape: ShapeDict) -> list[float]:
    """A shape's radius, or a box's half sizes, in mm; empty where it has neither."""
    if "half_size" in shape:
        return list(shape["half_size"])
    return [shape["radius"]] if "radius" in shape else []


def resized(shape: ShapeDict, size: Sequence[float]) -> dict[str, Any]:
    """The shape with another `size_of`. Raises PlanError for another number of sizes."""
    if len(size) != len(size_of(shape)):
        raise PlanError(f"a {shape['kind']} has {len(size_of(shape))} sizes, not {len(size)}.")
    return {**shape, "half_size": list(size)} if "half_size" in shape else {**shape, "radius": size[0]}


def box_at(centre: Position, half_size: Sequence[float]) -> dict[str, Any]:
    """A box along the patient's axes."""
    rows = np.eye(4)
    rows[:3, 3] = centre
    return {"kind": "box", "transform_box_to_patient": rows.ravel().tolist(), "half_size": list(half_size)}


def _position(place: Any) -> Position:
    x, y, z = (float(value) for value in place)
    return (x, y, z)
