"""What the API says about plans, and what it takes."""

from typing import Annotated, Any

from pydantic import BaseModel, Field

from app.api.dependencies import Wish
from app.services.names import MAX_NAME
from app.services.plan_model import MAX_COORDINATE
from app.services.plans import Plan
from vfix_engine.imaging.soft_tissue import Surroundings

# Strict: a true or a text is no length and no setting.
Coordinate = Annotated[float, Field(gt=-MAX_COORDINATE, lt=MAX_COORDINATE, allow_inf_nan=False, strict=True)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
Name = Annotated[str, Field(min_length=1, max_length=MAX_NAME)]
Label = Annotated[str, Field(max_length=MAX_NAME)]
SettingsWish = Annotated[
    dict[Annotated[str, Field(max_length=64)], Annotated[float, Field(allow_inf_nan=False, strict=True)]],
    Field(max_length=64),
]
Revision = Annotated[int | None, Field(ge=0, description="the revision that was seen; another one gives 409")]


class PointPublic(BaseModel):
    id: str
    label: str
    position: tuple[float, float, float]


class EditedPoint(PointPublic):
    """A point as an edit left it, and the revision of the plan that the edit made."""

    revision: int


class RobotPublic(BaseModel):
    """Base: transform_base_to_patient, 16 numbers row by row, mm.

    urdf: SHA-256 of a URDF of one's own; tool_frame: its link that holds the tool. Both null of a shipped robot.
    """

    name: str
    base: list[float] | None
    q_start: list[float] | None
    urdf: str | None = None
    tool_frame: str | None = None


class PlanPublic(BaseModel):
    """A plan; positions in LPS mm."""

    schema_: Annotated[str, Field(alias="schema")]
    id: str
    name: str
    case_id: str
    case_hash: str
    frame: str
    unit: str
    points: list[PointPublic]
    targets: list[PointPublic]
    tool: str
    tool_shape: Annotated[dict[str, float], Field(description="bend_deg, shaft_radius_mm where not the shipped ones")]
    robot: RobotPublic
    settings: dict[str, float]
    created: str
    modified: str
    revision: int
    locked: bool
    deleted_at: str | None
    unreadable: Annotated[str, Field(description="in a list: why the content cannot be read; '' where it can")]
    notice: str

    @classmethod
    def of(cls, plan: Plan) -> "PlanPublic":
        values: dict[str, Any] = {name: getattr(plan, name) for name in cls.model_fields if name != "schema_"}
        points = {name: [vars(point) for point in values.pop(name)] for name in ("points", "targets")}
        return cls.model_validate({**values, **points, "schema": plan.schema})


class PlanCreate(Wish):
    """A new plan; empty, or a copy of another one of the case."""

    name: Name
    copy_of: Annotated[str | None, Field(max_length=64)] = None


class RobotWish(Wish):
    """A shipped robot by its name, or a URDF that was uploaded."""

    name: Name
    urdf: Annotated[str | None, Field(min_length=64, max_length=64)] = None
    tool_frame: Name | None = None


class ToolWish(Wish):
    """A shipped tool by its name; bend and radius of its shaft stay the shipped ones where they are left out."""

    name: Name
    bend_deg: Annotated[float | None, Field(allow_inf_nan=False, strict=True)] = None
    shaft_radius_mm: Annotated[float | None, Field(allow_inf_nan=False, strict=True)] = None

    def shape(self) -> dict[str, float]:
        shape = {"bend_deg": self.bend_deg, "shaft_radius_mm": self.shaft_radius_mm}
        return {name: value for name, value in shape.items() if value is not None}


class OwnRobotPublic(BaseModel):
    """A URDF that was stored; name, urdf and tool_frame are what a plan's robot is set to.

    links: that may hold the tool; ends: those without a child. notes: what was assumed because the file does not say.
    """

    name: str
    urdf: str
    tool_frame: str
    links: list[str]
    ends: list[str]
    notes: list[str]


class PlanUpdate(Wish):
    """Changes of a plan; what is left out stays."""

    name: Name | None = None
    deleted: bool | None = None
    locked: bool | None = None
    settings: SettingsWish | None = None
    robot: RobotWish | None = None
    tool: ToolWish | None = None
    revision: Revision = None


class PointCreate(Wish):
    """A path point or a target; index: before which path point, the end where it is left out."""

    position: Position
    label: Label | None = None
    index: Annotated[int | None, Field(ge=0)] = None
    revision: Revision = None


class TargetCreate(Wish):
    position: Position
    label: Label | None = None
    revision: Revision = None


class PointUpdate(Wish):
    """Changes of a path point or a target; what is left out stays."""

    position: Position | None = None
    label: Label | None = None
    revision: Revision = None


class StepBack(Wish):
    """Undo or redo one edit."""

    revision: Revision = None


class SnapWish(Wish):
    position: Position


class SnapPublic(BaseModel):
    """The nearest place clear of bone, LPS mm; lies_in: what the CT shows there, which does not move it."""

    position: tuple[float, float, float]
    moved_mm: float
    reason: str
    lies_in: Surroundings


class SoftTissuePublic(BaseModel):
    """Tissue above -300 HU that the tool's centreline passes in its worst pose, and where its tip is then.

    length_mm and at_mm are null without a CT or outside of it; complete is false where the scan ends in tissue beside
    the tool, so that more may be passed.
    """

    length_mm: float | None
    at_mm: float | None
    complete: bool


class EvaluationPublic(BaseModel):
    """The plan as the controller would drive it.

    bone_clearance_mm: of the whole tool per sample, null where it did not get; clearance_mm is the same under its older
    name, as is min_clearance_mm. soft_tissue: what the tool passes besides.
    """

    revision: int
    s_mm: list[float]
    positions: list[tuple[float, float, float]]
    clearance_mm: list[float | None]
    min_clearance_mm: float
    bone_clearance_mm: list[float | None]
    min_bone_clearance_mm: float
    soft_tissue: SoftTissuePublic
    completed: bool
    reason: str
    reached_mm: float
    length_mm: float
    degree: int
    transform_base_to_patient: list[list[float]]
    q_start: list[float]
