"""Export of a plan in the frame of the robot's base, for the robot's own program, as JSON or CSV; never read back.

The transforms of the base's placement and the image's registration are composed in `vfix_engine.frames` only.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from app.documents import Document
from app.documents.documents import Documents
from app.exchange.csv_files import shielded
from app.kit.errors import NotFound
from app.kit.text_tables import to_json_text
from app.planning.evaluation import Planning
from app.plans.model import NOTICE, Plan, PlanPoint
from app.registration.document import RegistrationContent
from app.registration.driven import DrivenRegistration
from app.registration.fit_report import report_of
from vfix_engine.arrays import Array
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.frames import ImageRegistration, transform_image_to_base
from vfix_engine.geometry.shaft_directions import roll_of, rolled_frame

JSON_SCHEMA, TABLE_SCHEMA = "vfix-plan-in-base/1", "vfix-plan-in-base-table/1"
_STRAIGHT = 1e-6  # sine of the bend below which a tool counts as straight
_COLUMNS = ("kind", "label", "s_mm", "x", "y", "z", "shaft_x", "shaft_y", "shaft_z", "roll_deg")


@dataclass(frozen=True)
class BasePoint:
    """A place in the base frame, in mm.

    kind: 'point' or 'target' of the plan, 'driven' for a pose of its dry run. s_mm: arc length of a driven pose.
    direction: unit vector from the tip towards the tail of the shaft, or None. roll_deg: roll of a bent tool about the
    direction, right-handed; 0 if it bends towards z of the place's own frame, see
    `vfix_engine.geometry.shaft_directions.rolled_frame`; None if it is not planned, and for poses of a straight tool.
    """

    kind: Literal["point", "target", "driven"]
    label: str
    position: tuple[float, ...]
    direction: tuple[float, ...] | None = None
    roll_deg: float | None = None
    s_mm: float | None = None


class BaseExport:
    """Exports plans in their robot's frame. A call may take seconds and may run in any thread."""

    def __init__(self, planning: Planning, registrations: Documents[RegistrationContent]) -> None:
        self._planning, self._registrations = planning, registrations

    def text(self, plan: Plan, form: str, registration: str | None = None) -> str:
        """Return the plan's points and targets, and the driven path with the shaft's directions, as text of a file.

        registration: id or name of the image's registration, instead of the plan's; without either, image and patient
            share a frame, as in a simulation.
        Raises PlanError if the robot is not placed, the registration cannot be used or the form is unknown, and
        NotFound for an unknown registration.
        """
        if form not in ("json", "csv"):
            raise PlanError(f"in the robot's frame a plan is json or csv, not {form:.20}.")
        if registration is not None:
            plan = replace(plan, content=replace(plan.content, registration=self._registration(plan, registration).id))
        used = self._planning.registration(plan)
        transform = _transform(plan, None if used is None else used.image)
        driven, remark = self._driven(plan, used)
        points = [_moved(point, transform) for point in (*_planned(plan), *driven)]
        head = _head(plan, transform, used, remark)
        return _json(head, points) if form == "json" else _table(head, points)

    def _registration(self, plan: Plan, name: str) -> Document[RegistrationContent]:
        listed = self._registrations.list(plan.case_id)
        for one in [*(one for one in listed if one.id == name), *(one for one in reversed(listed) if one.name == name)]:
            if one.unreadable:
                raise PlanError(one.unreadable)
            return one
        known = ", ".join(repr(one.name) for one in listed) or "none"
        raise NotFound(f"there is no registration {name!r:.80} of this plan's head; there are: {known}.")

    def _driven(self, plan: Plan, used: DrivenRegistration | None) -> tuple[list[BasePoint], str]:
        """Return the poses of the dry run every 0.5 mm in the image frame, and a remark if it does not complete."""
        if len(plan.content.points) < 2:
            return [], "The plan has no path."
        try:
            evaluation = self._planning.evaluate(plan, through=used)
        except VfixError as error:
            return [], f"The path is not driven: {error}"
        found = []
        for s, back, front in evaluation.run.stations():
            along = back[-1] - front[-1]  # along the last part, which is the shaft
            direction = tuple((along / np.linalg.norm(along)).tolist())
            found.append(BasePoint("driven", "", tuple(front[0].tolist()), direction, _roll_deg(front, back), s))
        if evaluation.completed:
            return found, ""
        reached, length = evaluation.reached_mm, evaluation.length_mm
        return found, f"The tool gets {reached:.1f} of {length:.1f} mm: {evaluation.reason}."


def _planned(plan: Plan) -> list[BasePoint]:
    kinds: tuple[tuple[Literal["point", "target"], Sequence[PlanPoint]], ...] = (
        ("point", plan.content.points),
        ("target", plan.content.targets),
    )
    return [
        BasePoint(kind, point.label, point.position, point.direction, point.roll_deg)
        for kind, points in kinds
        for point in points
    ]


def _transform(plan: Plan, registration: ImageRegistration | None) -> Array:
    """Return transform_image_to_base (4, 4), mm. Raises PlanError if the pose of the base is not known."""
    placed = plan.content.robot.get("base")
    if placed is None and (registration is None or registration.to != "base"):
        raise PlanError(
            "the plan's robot is not placed; keep the simulated placing "
            "(vfix plan place), or name a registration to the base."
        )
    base = np.eye(4) if placed is None else np.reshape(np.array(placed, dtype=np.float64), (4, 4))
    return transform_image_to_base(base, registration)


def _moved(point: BasePoint, transform: Array) -> BasePoint:
    turn, shift = transform[:3, :3], transform[:3, 3]
    position = tuple((turn @ np.array(point.position) + shift).tolist())
    if point.direction is None:
        return BasePoint(point.kind, point.label, position, None, None, point.s_mm)
    direction, roll_deg = tuple((turn @ np.array(point.direction)).tolist()), None
    if point.roll_deg is not None:
        roll_deg = float(np.degrees(roll_of(turn @ rolled_frame(point.direction, np.radians(point.roll_deg)))))
    return BasePoint(point.kind, point.label, position, direction, roll_deg, point.s_mm)


def _roll_deg(front: Array, back: Array) -> float | None:
    """Return the roll of a pose in its own frame in degrees; None for a straight tool.

    front, back: starts and ends (S, 3) of the tool's parts, ordered from the tip.
    """
    shaft = front[-1] - back[-1]  # towards the tip
    shaft /= np.linalg.norm(shaft)
    bent = front[0] - back[0]
    across = bent - (bent @ shaft) * shaft
    if np.linalg.norm(across) < _STRAIGHT * np.linalg.norm(bent):
        return None
    across /= np.linalg.norm(across)
    return float(np.degrees(roll_of(np.column_stack([np.cross(shaft, across), shaft, across]))))


def _head(plan: Plan, transform: Array, registration: DrivenRegistration | None, remark: str) -> dict[str, Any]:
    """Return the metadata of the file.

    The residual `fre_mm` states how well the pairs fit, not the error at a target.
    """
    named: dict[str, Any] | None = None
    if registration is not None:
        content = registration.content
        report = report_of(content)
        named = {
            "id": registration.id,
            "name": registration.name,
            "to": registration.image.to,
            "fre_mm": content.fre_mm,
            "simulated": report.simulated,
            "doubts": list(report.doubts),
        }
        remark = " ".join([remark, *report.doubts]).strip()
    return {
        "notice": NOTICE,
        "name": plan.name,
        "plan": plan.id,
        "revision": plan.revision,
        "case_hash": plan.case_hash,
        "frame": "base",
        "unit": "mm",
        "robot": plan.content.robot.get("name"),
        "tool": plan.content.tool,
        "transform_image_to_base": transform.ravel().tolist(),
        "registration": named,
        "remark": remark or ("" if named else "Image and patient are taken for one frame, as in a simulation."),
    }


def _json(head: Mapping[str, Any], points: Sequence[BasePoint]) -> str:
    def row(point: BasePoint) -> dict[str, Any]:
        values = {
            "label": point.label,
            "s_mm": point.s_mm,
            "position": list(point.position),
            "direction": None if point.direction is None else list(point.direction),
            "roll_deg": point.roll_deg,
        }
        return {name: value for name, value in values.items() if value is not None}

    listed = {"points": "point", "targets": "target", "path_as_driven": "driven"}
    rows = {name: [row(point) for point in points if point.kind == kind] for name, kind in listed.items()}
    return to_json_text({"schema": JSON_SCHEMA, **head, **rows})


def _table(head: Mapping[str, Any], points: Sequence[BasePoint]) -> str:
    out = io.StringIO()
    out.write(f"# {NOTICE}\n# schema={TABLE_SCHEMA}\n")
    for name, value in head.items():
        if name != "notice":
            out.write(f"# {name}={value if name in ('frame', 'unit') else json.dumps(value, ensure_ascii=False)}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for point in points:
        shaft = ("", "", "") if point.direction is None else tuple(map(repr, point.direction))
        s, roll = (("" if value is None else repr(value)) for value in (point.s_mm, point.roll_deg))
        writer.writerow([point.kind, shielded(point.label), s, *map(repr, point.position), *shaft, roll])
    return out.getvalue()
