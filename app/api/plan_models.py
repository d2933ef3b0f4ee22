"""Models of plans in the API."""

from typing import Annotated

from pydantic import BaseModel, Field

from app.api.dependencies import RequestBody
from app.kit.values import MAX_COORDINATE
from app.planning.verdict import Level
from vfix_engine.anatomy.soft_tissue import TissueKind

# Strict: a true or a text is no length and no setting.
Coordinate = Annotated[float, Field(gt=-MAX_COORDINATE, lt=MAX_COORDINATE, allow_inf_nan=False, strict=True)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
Revision = Annotated[
    int | None, Field(ge=0, strict=True, description="the revision that was seen; another one gives 409")
]


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


class SnapRequest(RequestBody):
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

    verdict, word, short, words: as in the plan's report. bone_clearance_mm: of the whole tool per sample, null beyond
    the reached point; clearance_mm is its older name, as is min_clearance_mm. soft_tissue: along the tool.
    removed_mm3: bone that the plan removes before, in mm³.
    """

    revision: int
    verdict: Level
    word: str
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
