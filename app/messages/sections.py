"""The view model that the page is sent: every section as a typed dictionary of plain JSON values.

A group names the sections that one part of the session publishes together.
``scripts/declarations.py`` writes the page's TypeScript declarations from :data:`GROUPS`, the commands and the answers.
Lengths are in mm, forces in N, positions in the patient frame (LPS).
A section that does not exist is None.
"""

from dataclasses import dataclass
from typing import Annotated, Literal, NotRequired, TypedDict

from vfix_engine.imaging.volume import Axis

StepName = Literal["patient", "plan", "rehearse"]
ItemKind = Literal["point", "target"]
AddKind = Literal["point", "target", "none"]
CorridorStatus = Literal["none", "computing", "done", "failed"]
RehearsalState = Literal["absent", "starting", "ready", "running", "paused", "silent", "failed"]


@dataclass(frozen=True)
class Length:
    """Number of entries of an annotated list; it becomes a tuple in the declarations."""

    count: int


Position = Annotated[list[float], Length(3)]


# -- the case


class CaseEntry(TypedDict):
    """A case in the list."""

    id: str
    name: str
    created: str
    deleted: bool


class CasesSection(TypedDict):
    """All cases, the deleted ones included."""

    items: list[CaseEntry]


class FrameView(TypedDict):
    """Frame of the file that the case was made of; assumed: the file did not name it."""

    name: str
    assumed: bool


class SurfaceView(TypedDict):
    """A surface of the case and what is said of it."""

    name: str
    triangles: int
    words: str


class CaseSection(TypedDict):
    """The open case; loading: what is being read, None when all of it is there."""

    id: str
    name: str
    frame: FrameView
    spacing_mm: Position | None
    surfaces: list[SurfaceView]
    uncertainty: str
    has_volume: bool
    beads: int
    notes: list[str]
    detail: str | None
    loading: str | None


class SliceGrid(TypedDict):
    """Size of a slice's picture in pixels; origin: centre of its first pixel; u and v: from one pixel to the next."""

    columns: int
    rows: int
    origin: Position
    u: Position
    v: Position


class SlicePlane(SliceGrid):
    """One slice: its place along the plane's normal, the range of places, and the grid of a finer picture within it."""

    position: float
    lo: float
    hi: float
    step: float
    detail: SliceGrid | None


class SlicesSection(TypedDict):
    """The three slices through the cross, and the grey values [HU]."""

    cross: Position
    window_name: str
    window: float
    level: float
    planes: dict[Axis, SlicePlane]


class ViewSection(TypedDict):
    """How the head is shown: opacity 0 to 1, the cut, and the slices in the scene ('none', an axis or 'all')."""

    opacity: float
    cut: Literal["whole", "left", "right"]
    slices: str


class HeadSections(TypedDict):
    """The case and how it is shown."""

    cases: CasesSection
    case: CaseSection | None
    slices: SlicesSection | None
    view: ViewSection


# -- the plan


class PlanEntry(TypedDict):
    """A plan in the list."""

    id: str
    name: str
    modified: str
    deleted: bool


class PlansSection(TypedDict):
    """All plans of the case, the deleted ones included."""

    items: list[PlanEntry]


class ItemEntry(TypedDict):
    """A point of the path or a target."""

    id: str
    label: str
    position: Position


class ItemsSection(TypedDict):
    """Points and targets, in order."""

    points: list[ItemEntry]
    targets: list[ItemEntry]


class GhostView(TypedDict):
    """What a click would add."""

    kind: ItemKind
    position: Position
    words: str


class PlanSection(ItemsSection):
    """The open plan; degree and length of its spline are 0 without one."""

    id: str
    name: str
    frame: str
    unit: str
    selected: str | None
    locked: bool
    can_undo: bool
    can_redo: bool
    add_mode: AddKind
    degree: int
    length_mm: float
    ghost: GhostView | None


class CurveSection(TypedDict):
    """Places along the path."""

    points: list[Position]


class SoftTissueView(TypedDict):
    """Soft tissue that the tool passes at most, and where its tip is then; complete: the scan holds all of it."""

    length_mm: float | None
    at_mm: float | None
    complete: bool


class ScaleView(TypedDict):
    """The scale of clearances [mm]: range, margin, and the colours evenly spaced from lo to hi."""

    lo: float
    hi: float
    margin: float
    colours: list[str]


class CorridorSection(TypedDict):
    """The dry run of the plan; completed is None until it has ended."""

    status: CorridorStatus
    words: str
    caution: bool
    completed: bool | None
    min_clearance_mm: float | None
    soft_tissue: SoftTissueView | None
    warning: str
    scale: ScaleView | None


class PlanningSections(TypedDict):
    """The plans of the case and what the tool makes of the open one."""

    plans: PlansSection
    plan: PlanSection | None
    curve: CurveSection
    corridor: CorridorSection


# -- the rehearsal


class MotionView(TypedDict, total=False):
    """The newest snapshot of the controller; absent while no robot is in place. Numbers that do not exist are None."""

    mode: str
    phase: str
    held: bool
    reason: str
    holding: str
    force_n: float | None
    tip_error_mm: float | None
    clearance_mm: float | None
    clearance_capped: bool
    margin_mm: float | None
    progress_mm: float | None
    length_mm: float | None
    target_error_mm: float | None
    path_done: bool
    tip: Position
    grip: Position
    virtual_point: Position


class RehearsalSection(MotionView):
    """The rehearsal and who drives it; mine: this window holds the handle, holder: who else does."""

    state: RehearsalState
    words: str
    mine: bool
    holder: str | None
    can_take: bool
    plan_changed: NotRequired[bool]
    target_id: NotRequired[str | None]


class DetailsSection(TypedDict, total=False):
    """How the control loop keeps its period; empty while no robot is in place."""

    loop_hz: float | None
    step_us: float | None
    step_us_p99: float | None
    lateness_us_p50: float | None
    lateness_us_p99: float | None
    overruns: int
    rows: int
    steps: int
    priority: str


class SettingField(TypedDict):
    """One setting as a slider."""

    name: str
    label: str
    unit: str
    lo: float
    hi: float
    step: float
    digits: int
    value: float


class SettingsSection(TypedDict):
    """The settings in force; answered counts the changes that were answered, refused ones included."""

    answered: int
    words: str
    warning: str
    fields: list[SettingField]


class ToolSection(TypedDict):
    """Segments (start, end) of robot and tool."""

    segments: list[list[Position]]


class RehearsalSections(TypedDict):
    """The rehearsal of the open plan; driven and curve: of the plan that is driven where that is an older one."""

    rehearsal: RehearsalSection
    driven: ItemsSection | None
    curve: NotRequired[CurveSection]
    details: DetailsSection
    settings: SettingsSection
    tool: ToolSection


# -- the session


class StepSection(TypedDict):
    """The step that is shown, those that can be gone to, and what to do next."""

    name: StepName
    available: list[StepName]
    hint: str


class SceneSection(TypedDict):
    """Whether the three-dimensional scene shows the head; words: what it waits for."""

    ready: bool
    words: str


class CameraSection(TypedDict):
    """Height of the view at the centre of the scene."""

    view_height_mm: float | None


class SessionSections(TypedDict, total=False):
    """What belongs to no single step."""

    step: StepSection
    scene: SceneSection
    camera: CameraSection


GROUPS: tuple[type, ...] = (SessionSections, HeadSections, PlanningSections, RehearsalSections)


# -- messages


class ProjectAnswer(TypedDict):
    """Places on the canvas in parts of its size, None for a place behind the camera; None without a camera."""

    places: list[Annotated[list[float], Length(2)] | None] | None


class StateMessage(TypedDict):
    """Sections that changed, by name."""

    type: Literal["state"]
    sections: dict[str, object]


class ErrorMessage(TypedDict):
    """Why a command was refused."""

    message: str


class NoteMessage(TypedDict):
    """Words for the user."""

    type: Literal["note"]
    words: str
    error: bool


class ReplyMessage(TypedDict):
    """The answer to a command that asked for one by its id."""

    type: Literal["reply"]
    id: int
    ok: bool
    result: NotRequired[object]
    error: NotRequired[ErrorMessage]


ANSWERS: dict[str, type] = {"project": ProjectAnswer}  # by the command that it answers; all others answer None
