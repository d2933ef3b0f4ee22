"""Sections of the Plan tab."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position
from app.planning.verdict import Level
from app.tabs.plan.cone_section import ConeSection
from app.tabs.plan.openings_section import OpeningSections
from app.tabs.plan.paths import PathSections
from app.tabs.plan.region_sections import RegionSections
from app.tabs.plan.second_volume import SecondVolumeSections
from app.tabs.plan.shaft_section import ShaftSection
from app.tabs.plan.versions import VersionSections
from app.workspace.sections import CurveSection, ItemKind, ItemsSection

AddKind = Literal["point", "target", "none"]
EvaluationStatus = Literal["none", "computing", "done", "failed"]
EvaluationState = Literal["none", "current", "waits", "drag", "drag_waits"]


class PlanEntry(TypedDict):
    """A plan in the list."""

    id: str
    name: str
    modified: str
    deleted: bool


class PlansSection(TypedDict):
    """All plans of the case, the deleted ones included."""

    items: list[PlanEntry]


class GhostView(TypedDict):
    """What a click would add."""

    kind: ItemKind
    position: Position
    words: str


class RobotOption(TypedDict):
    """A robot that comes along; words: what it is."""

    name: str
    title: str
    words: str


class ToolOption(RobotOption):
    """A tool that comes along, with its own bend, 0 of a straight one, and radius."""

    bend_deg: float
    shaft_radius_mm: float


class InstrumentsSection(TypedDict):
    """What can be chosen; bounds (low, high) of a tool's bend, of its shaft's radius, and of the margin."""

    robots: list[RobotOption]
    tools: list[ToolOption]
    bend_bounds_deg: list[float]
    radius_bounds_mm: list[float]
    margin_bounds_mm: list[float]


class PlanRobotView(TypedDict):
    """The plan's robot; of a URDF of one's own: its hash, the link that holds the tool, and all that could.

    is_placed: the plan keeps where its base stands. trouble: why it cannot be read, '' where it can.
    """

    name: str
    title: str
    words: str
    urdf: str | None
    tool_frame: str | None
    links: list[str]
    is_placed: bool
    notes: list[str]
    trouble: str


class PlanToolView(TypedDict):
    """The plan's tool in its shape; bend_deg is None of a straight one."""

    name: str
    title: str
    words: str
    bend_deg: float | None
    shaft_radius_mm: float
    changed: bool
    trouble: str


class PlanSection(ItemsSection):
    """The open plan; degree and length of its spline are 0 without one. margin_mm: to bone, as it is set.

    nearest_target: id of the target nearest to the path's end, None without a path or a target. short_mm: how far
    before it the path ends, 0 where it ends at it.
    """

    id: str
    revision: int
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
    nearest_target: str | None
    short_mm: float
    ghost: GhostView | None
    robot: PlanRobotView
    tool: PlanToolView
    margin_mm: float


class VerdictPart(TypedDict):
    """A piece of the verdict's sentence; s_mm: arc length of the tip that it is about, None where it is about none."""

    words: str
    s_mm: float | None


class ObstacleCurve(TypedDict):
    """Clearance of the whole tool to bone or to a hard protected structure along the path, and its margin, in mm."""

    name: str
    margin_mm: float
    clearance_mm: list[float]


class ClearanceProfile(TypedDict):
    """Along the path, at one pose of the dry run for every 0.5 mm: all lists are of one length, in mm.

    curves: bone first, then each hard protected structure.
    exact_to_mm: bone that is farther away is at this distance or beyond.
    tissue_mm and tissue_depth_mm: along which length and how deep the tool is in soft tissue; None without a CT.
    registration_mm: what the registration may be off by at the tip (95 %); None without one.
    sideways_mm: how far sideways air leads round the tissue that the tool passes; None where not known anywhere.
    """

    s_mm: list[float]
    curves: list[ObstacleCurve]
    exact_to_mm: float
    tissue_mm: list[float] | None
    tissue_depth_mm: list[float] | None
    registration_mm: list[float] | None
    sideways_mm: list[float] | None


class PiercedView(TypedDict):
    """The tissue that the tool pierces, on its axis where the tip is at s_mm: from outside to inside, in LPS."""

    begin: Position
    end: Position


class FigureView(TypedDict):
    """A figure of the verdict, see `VerdictFigure`."""

    name: str
    value: float | None
    level: Level
    s_mm: float | None
    whole_mm: float | None
    digits: int
    at_least: bool


class VerdictView(TypedDict):
    """The verdict on the path: level from bone and reach; short: in a few words.

    figures: the one that decides first.
    pierced: what is drawn in red; None where the tool pierces nothing.
    show_mm: arc length of the place to look at first, of the first figure that has one.
    nearest: name of what leaves least above its margin, bone or a protected structure, nearest_curve: its curve, and
    nearest_mm: arc length of that place. base_mm: distance of the robot's base from the entry.
    """

    level: Level
    short: str
    parts: list[VerdictPart]
    figures: list[FigureView]
    pierced: PiercedView | None
    show_mm: float
    nearest: str
    nearest_curve: int
    nearest_mm: float
    length_mm: float
    base_mm: float
    profile: ClearanceProfile


class ScaleView(TypedDict):
    """The scale of clearances [mm]: range, margin, and the colours evenly spaced from lo to hi.

    unknown: colour of the part of the path that the tool does not reach; None where there is none. blocked: colour of
    what is pierced, and of a verdict that is blocked or pierces.
    """

    lo: float
    hi: float
    margin: float
    colours: list[str]
    unknown: str | None
    blocked: str


class EvaluationSection(TypedDict):
    """The dry run of the plan; completed is None until it has ended.

    level, short: of the verdict, also where the tool does not fit at the entry or the run has failed; None and '' while
    the path is judged. word: of the level, of the verdict that is shown where there is none, '' without either.
    job: id of the one that computes it, None where none does. cancelled: somebody ended it.
    verdict: of a run that has ended, or of an earlier one while another is computed; shown_mm: arc length at which the
    tool is shown, None where it is not.
    state: what the verdict is of: 'current' of the stored path; 'waits' an earlier answer, while this one is computed;
    'drag' of the path as it would be under a hand, with the robot's base kept, 'drag_waits' of an earlier place of the
    hand. state_words says so.
    """

    status: EvaluationStatus
    words: str
    level: Level | None
    word: str
    short: str
    completed: bool | None
    warning: str
    scale: ScaleView | None
    job: str | None
    cancelled: bool
    verdict: VerdictView | None
    shown_mm: float | None
    state: EvaluationState
    state_words: str


class PlanSections(PathSections, OpeningSections, RegionSections, VersionSections, SecondVolumeSections):
    """The plans of the case and what the tool makes of the open one."""

    plans: PlansSection
    instruments: InstrumentsSection
    plan: PlanSection | None
    curve: CurveSection
    corridor: EvaluationSection
    shaft: ShaftSection
    cones: ConeSection
