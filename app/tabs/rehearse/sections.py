"""Sections of the Rehearse tab."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict

from app.drives.sections import DetailsSection, DriveMotion, DriveSection
from app.messages.sections import Position
from app.workspace.sections import CurveSection, ItemsSection
from vfix_engine.runtime.control_mode import ControlMode, Device


class MotionView(DriveMotion, total=False):
    """The newest snapshot of the controller; absent while there is no robot. Numbers that do not exist are None.

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


class ControlView(TypedDict):
    """How the tool is driven, or will be: control mode, device of a teleoperated drive, and preset, None for none.

    certified: every motion is certified before it is made; never in a free hand.
    """

    mode: ControlMode
    device: Device
    preset: str | None
    certified: bool


class ContactView(TypedDict):
    """Contacts of a part of a tool in a free hand so far, the deepest, and its depth now; lengths in mm."""

    structure: str
    part: str
    count: int
    max_depth_mm: float | None
    depth_mm: float | None


class RehearsalSection(MotionView, DriveSection):
    """The rehearsal of a plan: the drive, and the fields of the tool. contacts: in a free hand, the deepest first."""

    control: NotRequired[ControlView]
    contacts: NotRequired[list[ContactView]]
    plan_changed: NotRequired[bool]
    target_id: NotRequired[str | None]


class NearnessView(TypedDict):
    """The tool's clearance to bone or to a protected structure; lengths in mm.

    at_least: it is farther away than clearances are measured, which is the value. soft: the tool may enter its layer,
    whose thickness is the margin. level: as in a verdict; 'blocked' where the tool is nearer than the margin.
    """

    name: str
    clearance_mm: float
    margin_mm: float
    at_least: bool
    soft: bool
    level: Literal["fits", "tight", "blocked"]


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
    """The present settings; answered counts the changes that were answered, refused ones included."""

    answered: int
    words: str
    warning: str
    fields: list[SettingField]


class OptionView(TypedDict):
    """An option of the rehearsal; words: its effect, or what it would be; refusal: why it cannot be used, or ''."""

    name: str
    label: str
    words: str
    on: bool
    refusal: str


class CentreChoice(TypedDict):
    """A position for the remote centre; value: 'entry', or the id of a path point."""

    value: str
    label: str


class CentreSection(TypedDict):
    """Position of the remote centre; chosen: a choice's value, or 'mm' for a position in between.

    at_mm: along the path, None where it is not known. trouble: why it cannot be there, '' where it can.
    """

    choices: list[CentreChoice]
    chosen: str
    at_mm: float | None
    length_mm: float
    trouble: str


class LengthSection(TypedDict):
    """The length of an option that has one, such as the tube's radius, and the range that is offered; mm."""

    mm: float
    lo: float
    hi: float
    step: float


class OptionsSection(TypedDict):
    """Selected options of the rehearsal; words: when they take effect, '' where they have.

    centre: None while the remote centre is off. lengths: of the options that are on and have one.
    """

    items: list[OptionView]
    centre: CentreSection | None
    lengths: dict[str, LengthSection]
    words: str


class ApproachPlace(TypedDict):
    """A path point that can be approached, and its arc length."""

    id: str
    label: str
    at_mm: float


class ApproachSection(TypedDict):
    """Places of the driven path that the tip can go to; length_mm: of the path.

    refusal: why none can be approached now, '' where one can.
    """

    points: list[ApproachPlace]
    length_mm: float
    refusal: str


class ToolSection(TypedDict):
    """Axes (start, end) of the tool's parts from the tip on, and their radii; both empty without a robot."""

    segments: list[list[Position]]
    radii_mm: list[float]


class StageView(TypedDict):
    """A stage of the error chain with its one number; known: it is that of the plan's own registration.

    refusal: why it cannot be switched on, '' where it can.
    """

    name: str
    label: str
    unit: str
    most: float
    step: float
    value: float
    on: bool
    known: bool
    hint: str
    refusal: str


class TruthSection(TypedDict):
    """What really happens to the tool that is driven; LPS mm. Tips and numbers are None where no stage is on.

    followed: the head, by a reference. compensated_mm_per_n: what the robot compensates, 0: nothing. below_margin: the
    true tool is nearer to bone than the margin of the certificate.
    """

    stages: list[StageView]
    followed: bool
    compensated_mm_per_n: float
    may_compensate: bool
    believed: Position | None
    true: Position | None
    difference_mm: float | None
    clearance_mm: float | None
    clearance_capped: bool
    below_margin: bool


class RehearsalSections(TypedDict):
    """The rehearsal of the open plan; driven and curve: of the plan that is driven where that is an older one.

    nearness: bone, then the protected structures; empty without a robot. approach: None without what is driven.
    """

    rehearsal: RehearsalSection
    driven: ItemsSection | None
    curve: NotRequired[CurveSection]
    details: DetailsSection
    settings: SettingsSection
    options: OptionsSection
    approach: ApproachSection | None
    tool: ToolSection
    nearness: list[NearnessView]
    truth: TruthSection
