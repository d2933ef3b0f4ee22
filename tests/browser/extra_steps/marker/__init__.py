"""Marker: a step of the page in one folder; a button lays a ball where the slices cross."""

from typing import Literal, TypedDict

from app.messages.fields import Command
from app.messages.sections import Position
from app.steps.spec import StepSpec


class LayMarker(Command):
    type: Literal["marker.lay"]


class MarkerView(TypedDict):
    """Where the marker lies, and how often it was laid."""

    position: Position
    laid: int


class MarkerSections(TypedDict):
    """The marker, None before it was laid."""

    marker: MarkerView | None


SPEC = StepSpec("marker", "Marker", 40, __name__, "MarkerStep", (LayMarker,), MarkerSections, has_routes=True)
