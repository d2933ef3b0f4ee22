"""Models of plans in the API."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from app.api.dependencies import Flag, Number, Wish
from app.cases.second_volume import IDENTITY, second_to_json
from app.kit.names import MAX_NAME
from app.kit.values import MAX_COORDINATE
from app.planning.verdict import Level
from app.plans.service import Plan
from vfix_engine.anatomy.soft_tissue import TissueKind

# Strict: a true or a text is no length and no setting.
Coordinate = Annotated[float, Field(gt=-MAX_COORDINATE, lt=MAX_COORDINATE, allow_inf_nan=False, strict=True)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
Name = Annotated[str, Field(min_length=1, max_length=MAX_NAME)]
Label = Annotated[str, Field(max_length=MAX_NAME)]
SettingsWish = Annotated[
    dict[Annotated[str, Field(max_length=64)], Number],
    Field(max_length=64),
]
Revision = Annotated[
    int | None, Field(ge=0, strict=True, description="the revision that was seen; another one gives 409")
]


class PointPublic(BaseModel):
    """A path point or a target, LPS mm.

    direction: of the shaft at a path point, from the tip towards the tail, length 1; roll_deg: about it. Null: open.
    """

    id: str
    label: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float] | None = None
    roll_deg: float | None = None


class EditedPoint(PointPublic):
    """A point after an edit, and the plan's revision after it."""

    revision: int


class RobotPublic(BaseModel):
    """Base: transform_base_to_patient, 16 numbers row by row, mm.

    urdf: SHA-256 of a custom URDF; tool_frame: its link that holds the tool. Both null for a shipped robot.
    """

    name: str
    base: list[float] | None
    q_start: list[float] | None
    urdf: str | None = None
    tool_frame: str | None = None


class PathPublic(BaseModel):
    """A path of a plan; positions in LPS mm."""

    id: str
    name: str
    points: list[PointPublic]
    tool: str
    tool_shape: dict[str, float]
    entry_side: str


class ZonePublic(BaseModel):
    """A structure to spare; shape as in a file of zones, or of the kind 'capsules' or 'structure'."""

    id: str
    name: str
    shape: dict[str, Any]
    margin_mm: float
    kind: str
    stiffness_n_per_mm: float | None
    max_depth_mm: float | None
    colour: str
    visible: bool


class RemovedBonePublic(BaseModel):
    """Bone that is to be removed before the tool goes in."""

    id: str
    name: str
    shape: dict[str, Any]


class SecondVolumePublic(BaseModel):
    """What is laid over the head's slices: a volume of a case by its name, else that case's widest CT.

    transform: 16 numbers row by row, from the second volume's LPS to the head's, mm, rigid. opacity: from 0 to 1.
    window, level: its values from black to white, and the value in their middle.
    other_head: confirms that a volume of another case than the plan's shows the same patient.
    """

    model_config = ConfigDict(extra="forbid")

    case: Annotated[str, Field(max_length=64)]
    volume: Annotated[str | None, Field(max_length=64)] = None
    transform: Annotated[list[Number], Field(min_length=16, max_length=16)] = list(IDENTITY)
    opacity: Number = 0.5
    window: Number = 2500.0
    level: Number = 600.0
    other_head: Flag = False


class PlanPublic(BaseModel):
    """A plan; positions in LPS mm. points, tool and tool_shape are those of the chosen path, `path_id`."""

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
    told: Annotated[
        str, Field(description="of undo and redo: what it took back or did again; of a file: its doubts; else ''")
    ]
    notice: str
    path_id: str
    paths: list[PathPublic]
    entry_side: Annotated[str, Field(description="of the chosen path: '', left, right or midline")]
    zones: list[ZonePublic]
    removed_bone: list[RemovedBonePublic]
    notes: str
    second_volume: SecondVolumePublic | None
    registration: Annotated[str | None, Field(description="id of the registration that it uses")]

    @classmethod
    def of(cls, plan: Plan) -> "PlanPublic":
        values: dict[str, Any] = {name: getattr(plan, name) for name in cls.model_fields if name != "schema_"}
        listed = ("points", "targets", "zones", "removed_bone")
        parts = {name: [vars(part) for part in values.pop(name)] for name in listed}
        paths = [{**vars(path), "points": [vars(point) for point in path.points]} for path in values.pop("paths")]
        second = second_to_json(values.pop("second_volume"))
        return cls.model_validate({**values, **parts, "paths": paths, "second_volume": second, "schema": plan.schema})


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
    """A shipped tool by its name; omitted bend and shaft radius stay the shipped ones."""

    name: Name
    bend_deg: Annotated[float | None, Field(allow_inf_nan=False, strict=True)] = None
    shaft_radius_mm: Annotated[float | None, Field(allow_inf_nan=False, strict=True)] = None

    def shape(self) -> dict[str, float]:
        shape = {"bend_deg": self.bend_deg, "shaft_radius_mm": self.shaft_radius_mm}
        return {name: value for name, value in shape.items() if value is not None}


class OwnRobotPublic(BaseModel):
    """A stored URDF; name, urdf and tool_frame are the values for a plan's robot.

    links: possible tool frames; ends: leaf links. notes: assumptions for values that the file lacks.
    """

    name: str
    urdf: str
    tool_frame: str
    links: list[str]
    ends: list[str]
    notes: list[str]


class PlanUpdate(Wish):
    """Changes of a plan; omitted fields stay."""

    name: Name | None = None
    deleted: Flag | None = None
    locked: Flag | None = None
    settings: SettingsWish | None = None
    robot: RobotWish | None = None
    tool: ToolWish | None = None
    revision: Revision = None


class PointCreate(Wish):
    """A path point or a target; index: position among the path points, by default the end."""

    position: Position
    label: Label | None = None
    index: Annotated[int | None, Field(ge=0, strict=True)] = None
    revision: Revision = None


class TargetCreate(Wish):
    position: Position
    label: Label | None = None
    revision: Revision = None


class TargetsTake(Wish):
    """plan: id of the plan of the same head whose targets are added."""

    plan: Annotated[str, Field(max_length=64)]
    revision: Revision = None


class PointUpdate(Wish):
    """Changes of a path point or a target; omitted fields stay."""

    position: Position | None = None
    label: Label | None = None
    revision: Revision = None


class StepBack(Wish):
    """Undo or redo one edit."""

    revision: Revision = None


class SnapWish(Wish):
    position: Position


class SnapPublic(BaseModel):
    """The nearest point clear of bone, LPS mm; lies_in: what the CT shows there."""

    position: tuple[float, float, float]
    moved_mm: float
    reason: str
    lies_in: TissueKind


class SoftTissuePublic(BaseModel):
    """Largest length of the tool's centreline in tissue above -300 HU, and the arc length of the tip in that pose.

    length_mm and at_mm are null without a CT or outside of it; complete is false where the scan ends in tissue beside
    the tool, so that the length may be larger.
    """

    length_mm: float | None
    at_mm: float | None
    complete: bool


class EvaluationPublic(BaseModel):
    """Result of a dry run of the plan.

    verdict, short, words: as in the plan's report. bone_clearance_mm: of the whole tool per sample, null beyond the
    reached point; clearance_mm is its older name, as is min_clearance_mm. soft_tissue: along the tool.
    removed_mm3: bone that the plan removes before, in mm³.
    """

    revision: int
    verdict: Level
    short: str
    words: str
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
    transform_base_to_patient: list[list[float]] | None
    transform_base_to_image: list[list[float]]
    q_start: list[float]
    removed_mm3: float
