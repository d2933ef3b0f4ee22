"""Files of a registration: measured points as a table, transforms in and out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any, Literal

from app.kit.names import as_seen, check_label
from app.kit.text_tables import (
    cell_number,
    check_last_line,
    decode,
    fault_at,
    mm_per_unit,
    table_header,
    table_rows,
)
from app.kit.values import Position, check_position
from app.plans.model import NOTICE
from app.registration.calibration import real_tracker_to_base
from app.registration.document import MAX_PAIRS, RegistrationContent, StoredRegistration
from app.registration.edits import MeasuredPoint
from app.registration.file_metadata import FULL, FileMetadata, direction, said_of
from app.registration.fit_report import FitReport, report_of
from app.registration.touched_surface import MAX_TOUCHED
from vfix_engine.arrays import Array
from vfix_engine.errors import FrameError, InputError
from vfix_engine.frames import RegisteredTo
from vfix_engine.json_text import parse_json
from vfix_engine.registration.transform_files import (
    json_text,
    tfm_comments,
    tfm_text,
    transform_from_json,
    transform_from_tfm,
)

TransformFormat = Literal["tfm", "json"]
MEDIA_TYPES: dict[TransformFormat, str] = {"tfm": "text/plain", "json": "application/json"}

MAX_TRACED = 20_000  # samples of a path

_FRAMES: dict[str, RegisteredTo] = {"patient": "patient", "tracker": "patient", "base": "base", "robot": "base"}
_KEYS = ("frame", "unit")


def read_measured(data: bytes, content: RegistrationContent) -> tuple[MeasuredPoint, ...]:
    """Measured points of a table with the columns label, x, y, z, of which label may be missing.

    Cells are separated by commas, semicolons or tabs; numbers have a point. No two points have labels
    that look the same.

    Comment lines above it say `# unit=mm` (or um, m) and `# frame=patient` (or tracker, base, robot).
    content: the registration that they are for; the file has to be of the frame that it is to. A table of the tracker's
    frame is taken to the robot's base by the robot's calibration where there is one.
    Raises FrameError where the unit is not said or the frame is another one, and InputError for anything else.
    """
    points = _points_of(data, content, MAX_PAIRS, "a registration has {most} pairs at most.")
    for label, count in Counter(as_seen(point.label) for point in points).items():
        if label and count > 1:
            raise InputError(f"two rows of the table are called {label!r:.80}; give each point its own name.")
    return points


def read_touched(data: bytes, content: RegistrationContent) -> tuple[Position, ...]:
    """Points that were touched on a surface, of a table as that of `read_measured`; labels are passed over."""
    points = _points_of(data, content, MAX_TOUCHED, "a surface is touched at {most} points at most.")
    return tuple(point.position for point in points)


def read_traced(data: bytes, content: RegistrationContent) -> tuple[Position, ...]:
    """Samples of a pointer's tip in their order, of a table as that of `read_measured`; labels are passed over."""
    points = _points_of(data, content, MAX_TRACED, "a path is traced by {most} samples at most.")
    return tuple(point.position for point in points)


def _points_of(data: bytes, content: RegistrationContent, most: int, too_many: str) -> tuple[MeasuredPoint, ...]:
    text = decode(data, "the table")
    check_last_line(text)
    lines = text.splitlines()
    header = table_header(lines, _KEYS, above=1)
    if "unit" not in header:
        raise FrameError("the table does not name its unit; add a line '# unit=mm'.", ("unit",))
    named = header.get("frame")
    matrix = None
    if content.robot is not None and content.to == "base" and named is not None and named.lower() == "tracker":
        matrix = real_tracker_to_base(content.robot)
    else:
        _check_frame(named, content.to)
    scale = mm_per_unit(header["unit"])
    points: list[MeasuredPoint] = []
    for number, row in table_rows(lines, ("x", "y", "z")):
        if len(points) == most:  # the rest is not even read
            raise InputError(f"the table holds more than {most:,} points; {too_many.format(most=f'{most:,}')}")
        with fault_at(f"line {number} of the table"):
            points.append(_point(row, scale, matrix))
    if not points:
        raise InputError("the table holds no points.")
    return tuple(points)


def _check_frame(named: str | None, to: RegisteredTo) -> None:
    if named is None:
        raise FrameError("the table does not name its frame; add a line '# frame=patient'.", ("frame",))
    if named.upper() in ("LPS", "RAS"):
        raise FrameError(f"the points are in {named.upper()}, the image's frame; measured points are the patient's.")
    frame = _FRAMES.get(named.lower())
    if frame is None:
        raise FrameError(f"the frame {named!r:.20} is not known; say {', '.join(_FRAMES)}.")
    if frame != to:
        raise FrameError(f"the points are in {named!r:.20}; this registration is to the {to}.")


def _point(row: Mapping[str, str], scale: float, matrix: Array | None) -> MeasuredPoint:
    try:
        values = [cell_number(row[axis]) * scale for axis in "xyz"]
    except ValueError:
        raise InputError("x, y and z must be numbers with a decimal point.") from None
    if matrix is not None:
        values = (matrix[:3, :3] @ values + matrix[:3, 3]).tolist()
    return MeasuredPoint(check_label((row.get("label") or "").strip(), "label"), check_position(values))


def export_text(document: StoredRegistration, form: TransformFormat) -> str:
    """The transform from the image (moving) to the patient (fixed), as ITK's text format or JSON.

    Both say whose registration it is, which way it goes, FRE, where its error is from, and whether it is simulated; the
    comments of the first one also that its parameters go the other way.
    Raises InputError where there is no transform yet, or its points do not fit.
    """
    report = report_of(document.content)
    if not report.usable:
        told = report.state in ("misfit", "inconsistent")
        why = report.words if told else "It has no transform yet; measure its points first."
        raise InputError(f"the registration {document.name!r:.80} is not exported. {why}")
    content = document.content
    transform = content.registration.transform
    origin = _origin(document, report)
    if form == "json":
        origin |= {"direction": direction(content.to)}
        return json_text(transform, moving="image", fixed=content.to, origin=origin)
    there = FULL[content.to]
    parameters = f"from {there} to the image, as in every ITK file; 3D Slicer moves the image to {there}"
    said = {"registration": direction(content.to), "parameters": parameters}
    return tfm_text(transform, [f"{key}: {value}" for key, value in (origin | said).items() if value is not None])


def _origin(document: StoredRegistration, report: FitReport) -> dict[str, Any]:
    """What a file says of where its transform comes from; lengths in mm."""
    content = document.content
    return {
        "notice": f"{NOTICE}. A registration of vfix.",
        "name": document.name,
        "made_from": content.made_from,
        "fre_mm": None if report.fre_mm is None else round(report.fre_mm, 4),
        "points": report.used,
        "error_of_a_point_mm": None if report.fle_mm is None else round(report.fle_mm, 4),
        "error_source": report.fle_source,
        "simulated": "yes, nothing here is of a real patient" if report.simulated else "no",
    }


def read_transform(file_name: str, data: bytes, to: RegisteredTo | None = None) -> RegistrationContent:
    """The content of a registration whose transform, from the image (moving) to the patient (fixed), a file holds.

    to: what the user says that it leads to, for a file that leaves that open, as those of other programs do; else the
    patient. Raises InputError for another kind of file, for a transform that is not rigid, and where the file says that
    it leads elsewhere.
    """
    name, text = file_name.lower(), decode(data, "the file of the transform")
    if not name.endswith((".tfm", ".txt", ".json")):
        raise InputError("a transform is read from .tfm, .txt or .json; in 3D Slicer save it as text (.tfm).")
    in_json = name.endswith(".json")
    transform = transform_from_json(text) if in_json else transform_from_tfm(text)
    said = _said_in_json(text) if in_json else said_of(tfm_comments(text))
    if said.to is not None and to not in (None, said.to):
        raise InputError(f"the file says that its transform leads to {FULL[said.to]}, not to {FULL[to]}.")
    values = tuple(float(value) for value in transform.ravel())
    return RegistrationContent(said.to or to or "patient", values, made_from="given", said=said)


def _said_in_json(text: str) -> FileMetadata:
    content = parse_json(text)
    return said_of(list(content.items()), _FRAMES.get(content["to"]))


def name_of(file_name: str) -> str:
    """A registration's name out of a file's, without what a name may not hold."""
    stem = PurePath(file_name.replace("\\", "/")).stem
    kept = "".join(c for c in stem if c.isprintable())[:80].strip()
    return kept or "Imported registration"
