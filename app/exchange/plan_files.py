"""Export and import of plans as files: the JSON of vfix, Markups of 3D Slicer, and CSV tables.

Every export states that it is not for clinical use (HAZ-35), and replaces an older file atomically (HAZ-25).
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from app.exchange.csv_files import from_csv, to_csv
from app.exchange.markups import PointsAs, from_fcsv, from_markups, markups_points, to_markups
from app.kit.names import check_label, check_name
from app.kit.text_tables import decode, known_frame, parse_json_object, to_json_text
from app.plans.curve import CurveSample
from app.plans.model import (
    FRAME,
    NOTICE,
    SCHEMA,
    UNIT,
    Plan,
    PlanFile,
    PlanPoint,
    check_content,
    content_from_json,
    content_to_json,
)
from vfix_engine.errors import FrameError, PlanError

__all__ = [
    "FORMATS",
    "CurveSample",
    "PlanFormat",
    "PointsAs",
    "export_text",
    "format_of",
    "from_csv",
    "from_fcsv",
    "from_markups",
    "from_native_json",
    "read_plan",
    "read_targets",
    "to_csv",
    "to_markups",
    "to_native_json",
    "write_export",
]

PlanFormat = Literal["json", "mrk.json", "csv"]
FORMATS: tuple[PlanFormat, ...] = get_args(PlanFormat)
MEDIA_TYPES: dict[PlanFormat, str] = {"json": "application/json", "mrk.json": "application/json", "csv": "text/csv"}


def to_native_json(plan: Plan, urdf: bytes | None = None) -> str:
    """Write a complete plan as versioned JSON. urdf: the URDF of its robot, if it is a user's own."""
    carried = {} if urdf is None else {"urdf": urdf.decode("utf-8")}
    return to_json_text(
        {
            "schema": SCHEMA,
            "notice": NOTICE,
            "id": plan.id,
            "name": plan.name,
            "case_id": plan.case_id,
            "case_hash": plan.case_hash,
            "frame": FRAME,
            "unit": UNIT,
            **content_to_json(plan.content),
            "locked": plan.locked,
            "created": plan.created,
            "modified": plan.modified,
            **carried,
        }
    )


def from_native_json(text: str, default_name: str = "Imported plan") -> PlanFile:
    """Read the JSON of `to_native_json`. Raises PlanError, or FrameError for a frame or unit other than LPS and mm."""
    data = parse_json_object(text)
    if data.get("schema") != SCHEMA:
        raise PlanError(f"the file's schema is {str(data.get('schema'))!r:.60}; {SCHEMA!r} can be read.")
    if data.get("frame") != "LPS" or data.get("unit") != "mm":
        raise FrameError("a plan of this schema states frame LPS and unit mm.")
    case_hash = data.get("case_hash")
    if not isinstance(case_hash, (str, type(None))):
        raise PlanError("the case's hash must be text.")
    name = check_name(data.get("name", default_name), "plan's name")
    content = check_content(content_from_json(data))
    for point in (*(point for path in content.paths for point in path.points), *content.targets):
        check_label(point.label, "label")
    return PlanFile(name, content, case_hash or None, _carried_urdf(data.get("urdf"), content.robot.get("urdf")))


def _carried_urdf(text: Any, key: str | None) -> bytes | None:
    """Return the URDF in a file for the robot with this hash. Raises PlanError if it is not the one of the hash."""
    if text is None:
        return None
    if not isinstance(text, str) or key is None:
        raise PlanError("a plan's urdf is the text of its robot's URDF.")
    data = text.encode("utf-8", "replace")
    if hashlib.sha256(data).hexdigest() != key:
        raise PlanError("the plan's URDF is not the one that its robot names; export it again.")
    return data


def export_text(
    plan: Plan, form: PlanFormat, curve: Sequence[CurveSample] = (), remark: str = "", urdf: bytes | None = None
) -> str:
    """Write a plan in one of the formats. curve, remark: for Markups. urdf: the robot's URDF, for JSON."""
    if form == "mrk.json":
        return to_markups(plan, curve, remark)
    return to_csv(plan) if form == "csv" else to_native_json(plan, urdf)


def write_export(path: Path, text: str) -> None:
    """Write an export atomically. Raises StorageError."""
    from app.store import write_atomically  # imported here: reading a plan needs no store

    write_atomically(path, text.encode("utf-8"))


def format_of(file_name: str) -> PlanFormat:
    """Return the format of a file name's suffix. Raises PlanError."""
    lower = file_name.lower()
    for form in ("mrk.json", "json", "csv"):
        if lower.endswith(f".{form}"):
            return form
    raise PlanError(f"a plan's file ends in {', '.join('.' + form for form in FORMATS)}.")


def read_plan(file_name: str, data: bytes, frame: str | None = None, points_as: PointsAs | None = None) -> PlanFile:
    """Read a plan from a file of any supported format; a plan without a name gets that of the file.

    frame: used if the file names none. points_as: meaning of a point list without a curve.
    Raises InputError or a subclass of it, PointsUnclear for such a list without `points_as`.
    """
    text, stem = decode(data), default_name(file_name)
    if file_name.lower().endswith(".fcsv"):
        return from_fcsv(text, stem, frame, points_as)
    if file_name.lower().endswith(".csv"):
        return from_csv(text, stem, frame)
    if not file_name.lower().endswith(".json"):
        raise PlanError("a plan is read from .json, .mrk.json, .csv or .fcsv.")
    if "markups" in parse_json_object(text):
        return from_markups(text, stem, frame, points_as)
    if frame is not None:
        known_frame("LPS", frame)
    return from_native_json(text, stem)


def read_targets(file_name: str, data: bytes, frame: str | None = None) -> tuple[PlanPoint, ...]:
    """Read targets from a file: the point lists of Markups, or the targets of a plan, or its points if it has none."""
    text = decode(data)
    if file_name.lower().endswith(".json") and "markups" in parse_json_object(text):
        return markups_points(text, frame)
    content = read_plan(file_name, data, frame, "targets").content
    return content.targets or content.points


def default_name(file_name: str) -> str:
    """Return a plan's name from a file name, without folders, suffixes and characters not allowed in names."""
    stem = Path(file_name.replace("\\", "/")).name
    for ending in (".mrk.json", ".json", ".fcsv", ".csv"):
        if stem.lower().endswith(ending):
            stem = stem[: -len(ending)]
            break
    kept = "".join(c for c in stem if c.isprintable())[:80].strip()
    return kept or "Imported plan"
