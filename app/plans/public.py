"""What REST answers of plans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from app.operations.public import DocumentPublic, with_content
from app.plans.model import FRAME, NOTICE, SCHEMA, UNIT, Plan, PlanContent
from app.plans.points import PlanPoint


@dataclass(frozen=True)
class RobotPublic:
    """Base: transform_base_to_patient, 16 numbers row by row, mm.

    urdf: SHA-256 of a custom URDF; tool_frame: its link that holds the tool. Both null for a shipped robot.
    """

    name: str
    base: list[float] | None
    q_start: list[float] | None
    urdf: str | None = None
    tool_frame: str | None = None


@dataclass(frozen=True, kw_only=True)
class EditedPoint(PlanPoint):
    """A point after an edit, and the plan's revision after it."""

    revision: int


@dataclass(frozen=True, kw_only=True)
class _Beside(DocumentPublic):
    """What is answered beside the fields of a plan's content."""

    schema: str
    case_hash: str
    frame: str
    unit: str
    told: str
    notice: str
    points: tuple[PlanPoint, ...]
    tool: str
    tool_shape: Mapping[str, float]
    entry_side: str


@dataclass(frozen=True, kw_only=True)
@with_content(PlanContent)
class PlanPublic(_Beside):
    """A plan; positions in LPS mm. points, tool and tool_shape are those of the chosen path, `path_id`.

    tool_shape: bend_deg, shaft_radius_mm where not the shipped ones. told: of undo and redo: what it took back or did
    again; of a file: its doubts; else ''. entry_side: of the chosen path. registration: id of the one that it uses.
    """

    robot: RobotPublic

    @classmethod
    def of(cls, plan: Plan) -> PlanPublic:
        """The answer. A plan that REST is asked for has every field of this."""
        content = plan.content
        said: dict[str, Any] = {
            "schema": SCHEMA,
            "frame": FRAME,
            "unit": UNIT,
            "notice": NOTICE,
            "robot": RobotPublic(**content.robot),
        }
        names = [field.name for field in fields(cls) if field.name not in said]
        values: dict[str, Any] = {name: getattr(content if hasattr(content, name) else plan, name) for name in names}
        return cls(**values, **said)
