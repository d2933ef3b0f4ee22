"""Commands of painted labels: made, painted on, taken back, changed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from app.messages.fields import Command, Identifier, Name, Position
from vfix_engine.anatomy.labels.painting import LEAST_RADIUS_MM, MOST_POINTS, MOST_RADIUS_MM


class NewLabel(Command):
    """Make a label, empty or with the voxels inside a structure."""

    type: Literal["label.new"]
    name: Name
    structure_id: Identifier | None = None


class DrawStroke(Command):
    """One stroke of the brush: points are its centres, normal is across a disc."""

    type: Literal["label.stroke"]
    label_id: Identifier
    mode: Literal["paint", "erase"]
    brush: Literal["disc", "ball"]
    radius_mm: Annotated[float, Field(ge=LEAST_RADIUS_MM, le=MOST_RADIUS_MM)]
    points: Annotated[tuple[Position, ...], Field(min_length=1, max_length=MOST_POINTS)]
    normal: Position


class LabelStep(Command):
    type: Literal["label.undo", "label.redo", "label.delete", "label.restore"]
    label_id: Identifier


class ChangeLabel(Command):
    type: Literal["label.change"]
    label_id: Identifier
    name: Name | None = None
    colour: Annotated[str, StringConstraints(pattern=r"^#[0-9a-f]{6}$")] | None = None
    locked: bool | None = None


PAINT_COMMANDS = (NewLabel, DrawStroke, LabelStep, ChangeLabel)
