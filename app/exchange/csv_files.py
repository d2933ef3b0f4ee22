"""Plans as CSV tables: comment lines with the plan's name, frame and unit, then one row per point.

Labels that a spreadsheet would run as a formula are prefixed with an apostrophe, which is removed when read.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from typing import Any

from app.exchange.markups import number_text
from app.kit.names import check_name
from app.kit.text_tables import (
    UNIT_ASSUMED,
    check_last_line,
    fault_at,
    known_frame,
    mm_per_unit,
    table_header,
    table_rows,
    to_lps,
)
from app.plans.model import FRAME, NOTICE, UNIT, Plan, PlanContent, PlanFile, PlanPoint, check_content
from app.plans.paths import PlanPath
from app.plans.points import new_point
from vfix_engine.errors import FrameError, PlanError
from vfix_engine.json_text import parse_json

_SCHEMA = "vfix-plan-table/1"
_COLUMNS = ("kind", "label", "x", "y", "z")
_KEYS = ("schema", "name", "case_hash", "frame", "unit")
_KINDS = ("point", "target")
_FORMULA = tuple("=+-@'\t")


def to_csv(plan: Plan) -> str:
    """Write path points and targets in LPS mm without rounding."""
    out = io.StringIO()
    out.write(f"# {NOTICE}\n# schema={_SCHEMA}\n# name={json.dumps(plan.name)}\n")
    out.write(f"# case_hash={plan.case_hash}\n# frame={FRAME}\n# unit={UNIT}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for kind, points in zip(_KINDS, (plan.content.points, plan.content.targets), strict=True):
        writer.writerows([kind, shielded(point.label), *map(repr, point.position)] for point in points)
    return out.getvalue()


def from_csv(text: str, default_name: str = "Imported plan", frame: str | None = None) -> PlanFile:
    """Read path and targets from a table with the columns label, x, y, z and, if it has targets, kind.

    Raises PlanError, and FrameError if neither the file nor `frame` names the frame, or if the unit is not named.
    """
    check_last_line(text)
    lines = text.splitlines()
    header = table_header(lines, _KEYS, above=1)
    system = known_frame(header.get("frame"), frame)
    if "unit" not in header and "frame" in header:
        raise FrameError("the table does not name its unit; add a line '# unit=mm'.", ("unit",))
    scale = mm_per_unit(header.get("unit", "mm"))  # without a header the unit is assumed to be mm, and noted
    content: dict[str, list[PlanPoint]] = {kind: [] for kind in _KINDS}
    rows = list(table_rows(lines, ("x", "y", "z")))
    for number, row in rows:
        with fault_at(f"line {number} of the table"):
            kind = row.get("kind", "point")
            if kind not in content:
                raise PlanError(f"this is a {kind!r:.40}; it must be a point or a target.")
            content[kind].append(_point(row, system, scale))
    if not rows and "schema" not in header:
        raise PlanError("the table holds no points.")
    name = check_name(_name(header.get("name")) or default_name, "plan's name")
    points = check_content(
        PlanContent(paths=(PlanPath(points=tuple(content["point"])),), targets=tuple(content["target"]))
    )
    notes = () if "unit" in header else (UNIT_ASSUMED,)
    return PlanFile(name, points, header.get("case_hash") or None, notes=notes)


def _name(text: str | None) -> Any:
    """Read the plan's name: JSON as `to_csv` writes it, or plain text of a table written by hand."""
    if text is None:
        return None
    try:
        return parse_json(text)
    except ValueError:
        return text


def _point(row: Mapping[str, str], frame: str, scale: float) -> PlanPoint:
    position = to_lps([number_text(row[axis]) for axis in "xyz"], frame, scale)
    return new_point(_unshield(row.get("label") or ""), position)


def shielded(label: str) -> str:
    """Return a label escaped so that no spreadsheet runs it as a formula."""
    return f"'{label}" if label.startswith(_FORMULA) else label


def _unshield(label: str) -> str:
    return label[1:] if label.startswith("'") and label[1:].startswith(_FORMULA) else label
