"""The markups of a plan for 3D Slicer, one per file, since a storage node reads only the first one of its file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.cases.model import Case
from app.exchange.markups import MARKUPS_SCHEMA, markup_node, to_markups
from app.exchange.regions import region_markups
from app.exchange.slicer.scene import NodeKind
from app.kit.text_tables import to_json_text
from app.plans.curve import CurveSample
from app.plans.model import NOTICE, Plan, PlanContent, PlanPoint
from app.plans.zones import PlanZone
from vfix_engine.proximity.axes import rotation_z_to

PATH, OTHER_PATH, NOT_REACHED = "#6db3f2", "#8a94a6", "#f0857d"
TARGET, REMOVED, BEAD, SHAFT = "#e58fd0", "#d9a066", "#facc5c", "#ced4dc"
_SHAFT_MM = 50.0
_PLANE_MM = 60.0
_POINT_MM, _LINE_MM = 2.0, 0.8  # diameters of visible points, and of points that disappear in their line


@dataclass(frozen=True)
class Mark:
    """A markup: its attributes in the scene, and its JSON. glyph_mm, named: as in `SceneNode`."""

    kind: NodeKind
    name: str
    colour: str
    markup: dict[str, Any]
    visible: bool = True
    glyph_mm: float | None = None
    named: bool = True

    def text(self) -> str:
        """Return the content of its `.mrk.json`."""
        return to_json_text({"@schema": MARKUPS_SCHEMA, "notice": NOTICE, "markups": [self.markup]})


def marks_of(plan: Plan, case: Case, curve: Sequence[CurveSample], remark: str) -> list[Mark]:
    """Return the planned and the driven path, targets, other paths, shafts, protected and removed regions, and beads.

    Positions are in LPS mm.
    """
    content = plan.content
    own = json.loads(to_markups(replace(plan, content=replace(content, zones=(), removed_bone=())), curve, remark))[
        "markups"
    ]
    marks = [_of_plan(one, first=one is own[0]) for one in own if one["controlPoints"]]
    marks += [
        Mark("Curve", path.name, OTHER_PATH, markup_node("Curve", path.name, path.points), False, _POINT_MM)
        for path in content.paths
        if path.id != content.path_id and path.points
    ]
    marks += _shafts(content.points)
    marks += _regions(content)
    if case.beads:
        beads = [PlanPoint("", bead.name, bead.position) for bead in case.beads]
        marks.append(Mark("Fiducial", "Beads", BEAD, markup_node("Fiducial", "Beads", beads)))
    return marks


def _of_plan(markup: dict[str, Any], first: bool) -> Mark:
    """Return the mark of the planned path (the first), the driven path with a point every 0.5 mm, or the targets."""
    if markup["type"] == "Fiducial":
        return Mark("Fiducial", markup["name"], TARGET, markup)
    if first:
        return Mark("Curve", markup["name"], PATH, markup, glyph_mm=_POINT_MM)
    colour = NOT_REACHED if markup["name"].endswith("not reached") else PATH
    return Mark("Curve", markup["name"], colour, markup, glyph_mm=_LINE_MM, named=False)


def _shafts(points: Sequence[PlanPoint]) -> Iterator[Mark]:
    """Yield the directions of the shaft, from the tip towards the tail."""
    for number, point in enumerate(points, start=1):
        if point.direction is None:
            continue
        name = f"Shaft at {point.label or number}"
        x, y, z = (at + _SHAFT_MM * along for at, along in zip(point.position, point.direction, strict=True))
        ends = [PlanPoint("", "", point.position), PlanPoint("", "", (x, y, z))]
        markup = markup_node("Line", name, ends) | {"locked": True}
        yield Mark("Line", name, SHAFT, markup, glyph_mm=_LINE_MM, named=False)


def _regions(content: PlanContent) -> Iterator[Mark]:
    """Yield planes and boxes, and hidden lines for all other shapes, which are shown by a surface."""
    for zone in content.zones:
        if zone.shape["kind"] == "half_space":
            yield Mark("Plane", zone.name, zone.colour, _plane(zone), zone.visible)
            continue
        for one in region_markups([zone], []):
            yield Mark(one["type"], one["name"], zone.colour, one, zone.visible and one["type"] == "ROI")
    for one in region_markups([], content.removed_bone):
        yield Mark(one["type"], one["name"], REMOVED, one, one["type"] == "ROI")


def _plane(zone: PlanZone) -> dict[str, Any]:
    """Return the border plane of a half-space, with its normal on the side of the tool.

    Slicer reads the axes from `baseToNode`: columns x, y, z (the normal) and the origin, in the frame of the file.
    `objectToBase` is the identity, which a file in LPS has with its first two rows negated, as Slicer writes it.
    """
    origin = np.asarray(zone.shape["point"], dtype=np.float64)
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = rotation_z_to(zone.shape["normal"]), origin
    markup = markup_node("Plane", zone.name, [PlanPoint("", zone.name, tuple(origin.tolist()))])
    words = f"{NOTICE}. Protected half-space, margin {zone.margin_mm:g} mm; the normal points to the side of the tool."
    return markup | {
        "description": words,
        "locked": True,
        "planeType": "pointNormal",
        "sizeMode": "absolute",
        "autoScalingFactor": 1.0,
        "center": origin.tolist(),
        "normal": base[:3, 2].tolist(),
        "objectToBase": np.diag([-1.0, -1.0, 1.0, 1.0]).ravel().tolist(),
        "baseToNode": base.ravel().tolist(),
        "orientation": base[:3, :3].ravel().tolist(),
        "size": [_PLANE_MM, _PLANE_MM, 0.0],
        "planeBounds": [-_PLANE_MM / 2, _PLANE_MM / 2, -_PLANE_MM / 2, _PLANE_MM / 2],
    }
