"""Marker: a tab of the page in one folder; a button lays a ball where the slices cross."""

from typing import Literal, TypedDict

from app.messages.fields import ClientMessage
from app.messages.sections import Position
from app.tabs.spec import TabSpec


class LayMarker(ClientMessage):
    type: Literal["marker.lay"]


class MarkerView(TypedDict):
    """Where the marker lies, and how often it was laid."""

    position: Position
    laid: int


class MarkerSections(TypedDict):
    """The marker, None before it was laid."""

    marker: MarkerView | None


SPEC = TabSpec(
    "marker", "Marker", 40, __name__, "MarkerTab", (LayMarker,), MarkerSections, has_routes=True, needs="case"
)
