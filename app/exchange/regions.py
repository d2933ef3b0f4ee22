"""Protected structures and bone to be removed as Markups nodes of 3D Slicer, which are ignored when a plan is read.

A box is a region of interest. Other shapes are lines: a capsule is its axis; for a sphere or patch the line leads from
the centre to the border, for a half-space from its plane 10 mm to the free side. Labels of the case are not exported.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from app.plans.model import NOTICE
from app.plans.zones import PlanZone, RemovedBone

_ALONG_NORMAL_MM = 10.0

AxisEnds = tuple[tuple[float, ...], tuple[float, ...]]


def region_markups(zones: Sequence[PlanZone], removed_bone: Sequence[RemovedBone]) -> list[dict[str, Any]]:
    """Return the nodes of a plan's protected structures and bone to be removed, LPS mm."""
    regions: list[tuple[PlanZone | RemovedBone, str]] = [(zone, _zone_words(zone)) for zone in zones]
    regions += [(region, "Bone to be removed") for region in removed_bone]
    return [markup for region, words in regions for markup in _nodes(region.name, region.shape, words)]


def _zone_words(zone: PlanZone) -> str:
    soft = f"soft, {zone.stiffness_n_per_mm:g} N/mm" if zone.stiffness_n_per_mm is not None else "hard"
    deep = "" if zone.max_depth_mm is None else f", {zone.max_depth_mm:g} mm deep at most"
    return f"Protected structure, {soft}{deep}, margin {zone.margin_mm:g} mm"


def _nodes(name: str, shape: Mapping[str, Any], words: str) -> Iterator[dict[str, Any]]:
    if shape["kind"] == "box":
        yield _box(name, shape, f"{NOTICE}. {words}.")
        return
    for ends in _lines(shape):
        size = f", radius {shape['radius']:g} mm" if "radius" in shape else ""
        text = f"{NOTICE}. {words}. {shape['kind'].replace('_', '-').capitalize()}{size}."
        yield _node("Line", name, text) | {
            "controlPoints": [_control_point(number, name, end, text) for number, end in enumerate(ends, 1)]
        }


def _lines(shape: Mapping[str, Any]) -> Iterator[AxisEnds]:
    match shape["kind"]:
        case "sphere" | "patch":
            x, y, z = shape["centre"]
            yield (x, y, z), (x + shape["radius"], y, z)
        case "capsule":
            yield tuple(shape["start"]), tuple(shape["end"])
        case "capsules":
            points = shape["points"]
            for start, end in zip(points[:-1] or points, points[1:] or points, strict=True):
                yield tuple(start), tuple(end)
        case "half_space":
            length = math.hypot(*shape["normal"])
            beyond = [p + _ALONG_NORMAL_MM * n / length for p, n in zip(shape["point"], shape["normal"], strict=True)]
            yield tuple(shape["point"]), tuple(beyond)


def _box(name: str, shape: Mapping[str, Any], text: str) -> dict[str, Any]:
    rows = shape["transform_box_to_patient"]
    centre = [rows[3], rows[7], rows[11]]
    return _node("ROI", name, text) | {
        "roiType": "Box",
        "center": centre,
        "orientation": [*rows[0:3], *rows[4:7], *rows[8:11]],
        "size": [2.0 * half for half in shape["half_size"]],
        "insideOut": False,
        "controlPoints": [_control_point(1, name, centre, text)],
    }


def _node(kind: str, name: str, text: str) -> dict[str, Any]:
    return {
        "type": kind,
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": True,
        "labelFormat": "%N",
        "description": text,
        "measurements": [],
    }


def _control_point(number: int, label: str, position: Any, description: str) -> dict[str, Any]:
    return {
        "id": str(number),
        "label": label,
        "description": description,
        "associatedNodeID": "",
        "position": list(position),
        "orientation": [-1.0, -0.0, -0.0, -0.0, -1.0, -0.0, 0.0, 0.0, 1.0],
        "selected": True,
        "locked": True,
        "visibility": True,
        "positionStatus": "defined",
    }
