"""Sections of the Rehearse tab."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from app.drives.sections import DetailsSection, DriveMotion, DriveSection
from app.messages.sections import Position
from app.workspace.sections import CurveSection, ItemsSection


class MotionView(DriveMotion, total=False):
    """The newest snapshot of the controller; absent while no robot is in place. Numbers that do not exist are None.

    so_far: least clearance and greatest depth in soft tissue while driven, beside the dry run's, in words; '' before.
    """

    mode: str
    phase: str
    held: bool
    reason: str
    so_far: str
    tip_error_mm: float | None
    clearance_mm: float | None
    clearance_capped: bool
    margin_mm: float | None
    target_error_mm: float | None
    path_done: bool
    grip: Position
    virtual_point: Position


class RehearsalSection(MotionView, DriveSection):
    """The rehearsal of a plan: the drive, and what is the rigid tool's."""

    plan_changed: NotRequired[bool]
    target_id: NotRequired[str | None]


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


class OptionView(TypedDict):
    """A switch of the rehearsal; words: what it does, or would do; refusal: why it cannot be used, '' where it can."""

    name: str
    label: str
    words: str
    on: bool
    refusal: str


class CentreChoice(TypedDict):
    """A place for the remote centre; value: 'entry', or the id of a path point."""

    value: str
    label: str


class CentreSection(TypedDict):
    """Where the remote centre is; chosen: a choice's value, or 'mm' for a place in between.

    at_mm: along the path, None where it is not known. trouble: why it cannot be there, '' where it can.
    """

    choices: list[CentreChoice]
    chosen: str
    at_mm: float | None
    length_mm: float
    trouble: str


class OptionsSection(TypedDict):
    """Switches of the rehearsal as they are wanted; words: when they come into force, '' where they are.

    centre: None while the remote centre is off.
    """

    items: list[OptionView]
    centre: CentreSection | None
    words: str


class ToolSection(TypedDict):
    """Axes (start, end) of the tool's parts from the tip on, and their radii; both empty without a robot."""

    segments: list[list[Position]]
    radii_mm: list[float]


class RehearsalSections(TypedDict):
    """The rehearsal of the open plan; driven and curve: of the plan that is driven where that is an older one."""

    rehearsal: RehearsalSection
    driven: ItemsSection | None
    curve: NotRequired[CurveSection]
    details: DetailsSection
    settings: SettingsSection
    options: OptionsSection
    tool: ToolSection
