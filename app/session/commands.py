"""Commands of the page, validated at the door (HAZ-05): every number is finite and bounded, every name short."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, TypeAdapter

from app.session.sections import AddKind, StepName
from vfix_engine.imaging.volume import Axis

Identifier = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.\-]+$")]
Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=120)]
Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
Direction = Literal[-1, 0, 1]
RequestId = Annotated[int, Field(ge=0, le=2**53)]


class Command(BaseModel):
    """A wish of the page; ``id`` asks for a reply."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    id: RequestId | None = None


class SetStep(Command):
    type: Literal["step.set"]
    name: StepName


class CaseCommand(Command):
    type: Literal["case.open", "case.delete", "case.restore"]
    case_id: Identifier


class RenameCase(Command):
    type: Literal["case.rename"]
    case_id: Identifier
    name: Name


class PlanCommand(Command):
    type: Literal["plan.open", "plan.duplicate", "plan.delete", "plan.restore"]
    plan_id: Identifier


class RenamePlan(Command):
    type: Literal["plan.rename"]
    plan_id: Identifier
    name: Name


class NewPlan(Command):
    type: Literal["plan.new"]
    name: Name


class ItemCommand(Command):
    type: Literal["item.select", "item.delete", "item.drop", "point.insert_after"]
    item_id: Identifier


class DragItem(Command):
    type: Literal["item.drag"]
    item_id: Identifier
    position: Position


class RenameItem(Command):
    type: Literal["item.rename"]
    item_id: Identifier
    label: Name


class AddMode(Command):
    type: Literal["add.mode"]
    kind: AddKind


class PlainCommand(Command):
    type: Literal[
        "undo",
        "redo",
        "ghost.confirm",
        "ghost.cancel",
        "rehearsal.start",
        "rehearsal.pause",
        "rehearsal.reset",
        "rehearsal.end",
    ]


class Lock(Command):
    type: Literal["lock"]
    locked: bool


class PickOnSlice(Command):
    type: Literal["pick.slice"]
    position: Position


class SetCross(Command):
    type: Literal["slice.cross"]
    position: Position


class SetSlice(Command):
    type: Literal["slice.set"]
    axis: Axis
    position: Coordinate


class SetWindow(Command):
    type: Literal["slice.window"]
    name: Annotated[str, StringConstraints(max_length=24, pattern=r"^[a-z]+$")]
    window: Annotated[float, Field(ge=1, le=10000, allow_inf_nan=False)]  # [HU]
    level: Annotated[float, Field(ge=-2000, le=4000, allow_inf_nan=False)]  # [HU]


class SetView(Command):
    type: Literal["view.set"]
    opacity: Annotated[float, Field(ge=0.1, le=1.0, allow_inf_nan=False)] | None = None
    cut: Literal["whole", "left", "right"] | None = None
    slices: Literal["none", "axial", "coronal", "sagittal", "all"] | None = None


class SetCamera(Command):
    type: Literal["view.camera"]
    view: Literal["anterior", "left", "right", "superior", "oblique", "nose"]


class SetMode(Command):
    type: Literal["rehearsal.mode"]
    mode: Literal["path", "free", "inspect"]
    target_id: Identifier | None = None


class SetRehearsalSettings(Command):
    type: Literal["rehearsal.settings"]
    values: Annotated[
        dict[Identifier, Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]], Field(max_length=16)
    ]


class Project(Command):
    """Where on the canvas do these places appear? Asked by tests and by whoever scripts the page."""

    type: Literal["project"]
    points: Annotated[list[Position], Field(max_length=1000)]


class HandCommand(Command):
    """What a hand on the handle sends: answered at once, never queued behind other work."""

    type: Literal["heartbeat", "grip.release", "rehearsal.take", "rehearsal.let_go"]


class Drive(Command):
    type: Literal["drive", "twist"]
    direction: Direction


AnyCommand = Annotated[
    SetStep
    | CaseCommand
    | RenameCase
    | PlanCommand
    | RenamePlan
    | NewPlan
    | ItemCommand
    | DragItem
    | RenameItem
    | AddMode
    | PlainCommand
    | Lock
    | PickOnSlice
    | SetCross
    | SetSlice
    | SetWindow
    | SetView
    | SetCamera
    | SetMode
    | SetRehearsalSettings
    | Project
    | HandCommand
    | Drive,
    Field(discriminator="type"),
]

_ADAPTER: TypeAdapter[AnyCommand] = TypeAdapter(AnyCommand)


def parse_command(text: str | bytes) -> AnyCommand:
    """Parse one message; raises pydantic's ``ValidationError`` for anything that is not a known, bounded command."""
    return _ADAPTER.validate_json(text)


def stream_of(command: AnyCommand) -> str | None:
    """Commands that stream: only the newest of each counts."""
    match command:
        case SetSlice():
            return f"{command.type}.{command.axis}"
        case SetCross():
            return command.type
        case SetView() if command.cut is None and command.slices is None:
            return command.type
        case DragItem():
            return f"{command.type}.{command.item_id}"
        case _:
            return None
