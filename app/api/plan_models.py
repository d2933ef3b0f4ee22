"""Models of plans in the API."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from app.api.dependencies import Flag, Number, Wish
from app.cases.second_volume import IDENTITY
from app.kit.names import MAX_NAME
from app.kit.values import MAX_COORDINATE
from app.planning.verdict import Level
from vfix_engine.anatomy.soft_tissue import TissueKind

# Strict: a true or a text is no length and no setting.
Coordinate = Annotated[float, Field(gt=-MAX_COORDINATE, lt=MAX_COORDINATE, allow_inf_nan=False, strict=True)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
Name = Annotated[str, Field(min_length=1, max_length=MAX_NAME)]
Revision = Annotated[
    int | None, Field(ge=0, strict=True, description="the revision that was seen; another one gives 409")
]


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
