"""Sections of the Plan step."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position
from app.views.sections import CurveSection, ItemKind, ItemsSection

AddKind = Literal["point", "target", "none"]
CorridorStatus = Literal["none", "computing", "done", "failed"]


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


class RobotChoice(TypedDict):
    """A robot that comes along; words: what it is."""

    name: str
    title: str
    words: str


class ToolChoice(RobotChoice):
    """A tool that comes along, with its own bend, 0 of a straight one, and radius."""

    bend_deg: float
    shaft_radius_mm: float


class InstrumentsSection(TypedDict):
    """What can be chosen; bounds (low, high) of a tool's bend and of its shaft's radius."""

    robots: list[RobotChoice]
    tools: list[ToolChoice]
    bend_bounds_deg: list[float]
    radius_bounds_mm: list[float]


class PlanRobotView(TypedDict):
    """The plan's robot; of a URDF of one's own: its hash, the link that holds the tool, and all that could.

    trouble: why it cannot be read, '' where it can.
    """

    name: str
    title: str
    words: str
    urdf: str | None
    tool_frame: str | None
    links: list[str]
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
    robot: PlanRobotView
    tool: PlanToolView


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


class PlanSections(TypedDict):
    """The plans of the case and what the tool makes of the open one."""

    plans: PlansSection
    instruments: InstrumentsSection
    plan: PlanSection | None
    curve: CurveSection
    corridor: CorridorSection
