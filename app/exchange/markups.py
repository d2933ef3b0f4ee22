"""Markups of 3D Slicer: `.mrk.json` of schema v1.0.3 is written and read, `.fcsv` of versions 4.6 and later is read."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from app.exchange.regions import region_markups
from app.kit.errors import PointsUnclear
from app.kit.names import MAX_NAME, check_name
from app.kit.text_tables import (
    UNIT_ASSUMED,
    cell_number,
    check_cells,
    check_last_line,
    fault_at,
    known_frame,
    mm_per_unit,
    parse_json_object,
    table_header,
    to_json_text,
    to_lps,
)
from app.kit.values import Position, number
from app.plans.curve import CurveSample
from app.plans.model import NOTICE, Plan, PlanContent, PlanFile, PlanPoint, check_content
from app.plans.paths import PlanPath
from app.plans.points import new_point
from vfix_engine.errors import PlanError

MARKUPS_SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#"
)
_FCSV_VERSION = "Markups fiducial file version"
_TURN_OFF = 0.01  # tolerance of the length of a quaternion, whose components have three decimals
PointsAs = Literal["path", "targets"]  # meaning of a point list without a curve
_TARGETS, _DENSE, _UNREACHED = " targets", " resampled", " not reached"
# Descriptions that mark each control point of an added curve; names may be changed by the user.
_DENSE_MARK, _UNREACHED_MARK = f"{NOTICE}. Path as driven.", f"{NOTICE}. Path not reached."
# Axes of a control point as columns: to the patient's right, anterior and superior, as Slicer writes them.
_ORIENTATION = [-1.0, -0.0, -0.0, -0.0, -1.0, -0.0, 0.0, 0.0, 1.0]


def to_markups(plan: Plan, curve: Sequence[CurveSample] = (), remark: str = "") -> str:
    """Write control points as a curve, the driven path as a resampled curve with clearances, targets as a point list.

    Protected structures and bone to be removed follow as lines and regions of interest.
    curve: samples of the path; those with a clearance carry it as a measurement per control point.
    remark: why clearances are missing, if they are.
    """
    markups = [markup_node("Curve", plan.name, plan.content.points)]
    reached = [sample for sample in curve if sample.clearance_mm is not None]
    beyond = [sample for sample in curve if sample.clearance_mm is None]
    if reached:
        markups.append(_dense(plan.name + _DENSE, reached, _DENSE_MARK))
        markups[-1]["measurements"] = [
            _measurement(
                "clearance", "Distance of the whole tool's surface from bone", [s.clearance_mm for s in reached]
            ),
            _measurement("arc length", "Length of the path up to the control point", [s.s_mm for s in reached]),
        ]
    if beyond:
        # The last reached place belongs to both, so that the curves meet.
        markups.append(_dense(plan.name + _UNREACHED, reached[-1:] + beyond, _UNREACHED_MARK))
    markups.append(markup_node("Fiducial", plan.name + _TARGETS, plan.content.targets))
    for markup in markups:
        markup["description"] = f"{NOTICE}. {remark}".strip()
    markups.extend(region_markups(plan.content.zones, plan.content.removed_bone))
    return to_json_text({"@schema": MARKUPS_SCHEMA, "notice": NOTICE, "markups": markups})


def from_markups(
    text: str, default_name: str = "Imported plan", frame: str | None = None, points_as: PointsAs | None = None
) -> PlanFile:
    """Read path and targets from a Markups file, in LPS mm.

    The path is the one curve that was not added by an export; in a file with a curve a point list holds targets.
    frame: used if the file names none. points_as: meaning of a point list without a curve.

    Raises PlanError, FrameError if neither the file nor `frame` names the frame, and PointsUnclear if `points_as` is
    needed and missing.
    """
    markups = parse_json_object(text).get("markups")
    if not isinstance(markups, list) or not markups or not all(isinstance(m, dict) for m in markups):
        raise PlanError("the file holds no list of markups.")
    curves = [m for m in markups if m.get("type") == "Curve" and not _is_added(m)]
    lists = [m for m in markups if m.get("type") == "Fiducial"]
    # In a file with a curve of any kind, a list holds targets and must never be driven.
    if len(lists) == 1 and not any(m.get("type") in ("Curve", "ClosedCurve") for m in markups):
        listed = _listed(_points(lists[0], frame), lists[0].get("name") or default_name, points_as)
        return replace(listed, notes=_unit_notes(lists))
    if len(curves) == 1:
        path, target_lists = curves[0], lists
    else:
        raise PlanError(
            f"a plan needs one curve, or a point list alone; the file has {len(curves)} curves and {len(lists)} lists."
        )
    targets = tuple(point for markup in target_lists for point in _points(markup, frame))
    name = check_name(path.get("name") or default_name, "plan's name")
    content = check_content(PlanContent(paths=(PlanPath(points=_points(path, frame)),), targets=targets))
    return PlanFile(name, content, notes=_unit_notes([path, *target_lists]))


def markups_points(text: str, frame: str | None = None) -> tuple[PlanPoint, ...]:
    """Read every point of every point list of a file as targets, in LPS mm. Raises PlanError, FrameError."""
    markups = parse_json_object(text).get("markups")
    lists = (
        [m for m in markups if isinstance(m, dict) and m.get("type") == "Fiducial"] if isinstance(markups, list) else []
    )
    points = tuple(point for markup in lists for point in _points(markup, frame))
    if not points:
        raise PlanError("the file holds no list of points.")
    return points


def _listed(points: tuple[PlanPoint, ...], name: Any, points_as: PointsAs | None) -> PlanFile:
    """Return a plan with a list of points alone.

    Raises PointsUnclear without `points_as`: targets taken for a path would drive the tool from one to the next.
    """
    if points_as is None:
        raise PointsUnclear(
            f"the file holds one list of {len(points)} points and no curve; say whether they are a path or targets."
        )
    content = PlanContent(paths=(PlanPath(points=points),)) if points_as == "path" else PlanContent(targets=points)
    return PlanFile(check_name(name, "plan's name"), check_content(content))


def from_fcsv(
    text: str, default_name: str = "Imported plan", frame: str | None = None, points_as: PointsAs | None = None
) -> PlanFile:
    """Read the point list of an `.fcsv` file as a path or as targets, in LPS mm.

    Raises PlanError, FrameError and PointsUnclear as `from_markups`.
    """
    check_last_line(text)
    lines = text.splitlines()
    header = table_header(lines, (_FCSV_VERSION, "CoordinateSystem", "columns"), above=0)
    rows = [(at, line) for at, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if _FCSV_VERSION not in header:
        raise PlanError("the file does not name the version of its point list.")
    columns = [column.strip() for column in header.get("columns", "").split(",")]
    if not {"x", "y", "z", "label"} <= set(columns):
        raise PlanError("the point list does not name columns x, y, z and label.")
    system = known_frame(header.get("CoordinateSystem"), frame)
    points = tuple(_fcsv_points(columns, rows, system))
    return _listed(points, default_name, points_as)


def _fcsv_points(columns: list[str], lines: Sequence[tuple[int, str]], frame: str) -> Iterator[PlanPoint]:
    rows: list[tuple[int, list[str]]] = []
    for at, line in lines:
        try:
            rows.extend((at, row) for row in csv.reader([line], strict=True))
        except csv.Error as error:
            raise PlanError(f"line {at} of the point list: it is damaged: {error}.") from None
    # All rows may omit an empty last column.
    if columns[-1] not in ("x", "y", "z", "label") and all(len(row) == len(columns) - 1 for _, row in rows):
        columns = columns[:-1]
    for at, row in rows:
        with fault_at(f"line {at} of the point list"):
            check_cells(row, columns)
            values = dict(zip(columns, row, strict=True))
            _check_in_place(values)
            yield new_point(values["label"], to_lps([number_text(values[axis]) for axis in "xyz"], frame))


def _check_in_place(values: Mapping[str, str]) -> None:
    """Raise PlanError for cells shifted by a decimal comma, which an omitted last column would hide."""
    turn = [values[name] for name in ("ow", "ox", "oy", "oz") if name in values]
    flags = [name for name in ("vis", "sel", "lock") if values.get(name, "").strip()]
    wrong = [name for name in flags if values[name].strip() not in ("0", "1", "0.0", "1.0")]
    if not wrong and len(turn) == 4:
        length = math.hypot(*(number_text(cell) for cell in turn))
        wrong = [] if length == 0.0 or abs(length - 1.0) < _TURN_OFF else ["ow"]
    if wrong:
        raise PlanError(
            f"the column {wrong[0]!r} holds {values[wrong[0]]!r:.20}, which cannot be: the cells are moved, as by "
            "decimal commas; write numbers with points, and labels with commas in quotes."
        )


def number_text(text: str) -> float:
    """Parse a number of a table's cell. Raises PlanError."""
    try:
        return number(cell_number(text), "a coordinate")
    except ValueError:
        hint = "; write numbers with a point and not a comma" if "," in text else ""
        raise PlanError(f"{text!r:.40} is not a coordinate{hint}.") from None


def markup_node(kind: str, name: str, points: Sequence[PlanPoint], mark: str = NOTICE) -> dict[str, Any]:
    """Return a Markups node ('Curve', 'Fiducial', 'Line' or 'Plane') with its control points, LPS mm.

    mark: description of each control point.
    """
    return {
        "type": kind,
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": False,
        "fixedNumberOfControlPoints": False,
        "labelFormat": "%N-%d",
        "lastUsedControlPointNumber": len(points),
        "controlPoints": [
            _control_point(str(n), point.label, point.position, mark) for n, point in enumerate(points, start=1)
        ],
        "measurements": [],
    }


def _dense(name: str, samples: Sequence[CurveSample], mark: str) -> dict[str, Any]:
    points = [PlanPoint("", f"{sample.s_mm:.2f} mm", sample.position) for sample in samples]
    return markup_node("Curve", name, points, mark) | {"locked": True}


def _control_point(point_id: str, label: str, position: Position, description: str) -> dict[str, Any]:
    return {
        "id": point_id,
        "label": label,
        "description": description,
        "associatedNodeID": "",
        "position": list(position),
        "orientation": _ORIENTATION,
        "selected": True,
        "locked": False,
        "visibility": True,
        "positionStatus": "defined",
    }


def _measurement(name: str, description: str, values: Sequence[float | None]) -> dict[str, Any]:
    known = [value for value in values if value is not None]
    return {
        "name": name,
        "enabled": True,
        "value": min(known) if name == "clearance" else max(known),
        "units": "mm",
        "description": f"{description}. {NOTICE}.",
        "printFormat": "%-#4.4g%s",
        "controlPointValues": known,
    }


def _is_added(markup: dict[str, Any]) -> bool:
    """Return whether a curve was added by an export: each of its control points is marked so."""
    items = markup.get("controlPoints")
    if not isinstance(items, list) or not items:
        return False
    return all(isinstance(item, dict) and item.get("description") in (_DENSE_MARK, _UNREACHED_MARK) for item in items)


def _points(markup: dict[str, Any], default_frame: str | None) -> tuple[PlanPoint, ...]:
    frame = known_frame(markup.get("coordinateSystem"), default_frame)
    scale = mm_per_unit(markup.get("coordinateUnits", "mm"))  # the schema's default is mm
    items = markup.get("controlPoints", [])
    if not isinstance(items, list):
        raise PlanError("the control points must be a list.")
    points = []
    for at, item in enumerate(items, start=1):
        with fault_at(f"control point {at}"):
            points.append(_point(item, frame, scale))
    return tuple(points)


def _unit_notes(markups: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return a note for markups that do not name the unit of their points, which is optional in the schema."""
    silent = any(markup.get("controlPoints") and "coordinateUnits" not in markup for markup in markups)
    return (UNIT_ASSUMED,) if silent else ()


def _point(item: Any, frame: str, scale: float) -> PlanPoint:
    if not isinstance(item, dict) or not isinstance(item.get("position"), list):
        raise PlanError("a control point has no position.")
    if item.get("positionStatus", "defined") != "defined":
        raise PlanError(f"the control point {str(item.get('label', ''))[:MAX_NAME]!r} has not been placed.")
    return new_point(item.get("label"), to_lps(item["position"], frame, scale))
