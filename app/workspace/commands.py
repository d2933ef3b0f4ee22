"""Commands for what every tab shares: slices, the look of the anatomy, and the camera."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from app.messages.fields import ClientMessage, Coordinate, Position
from vfix_engine.files.volume import Axis


class SetCross(ClientMessage):
    type: Literal["slice.cross"]
    position: Position

    def stream(self) -> str:
        return self.type


class SetSlice(ClientMessage):
    type: Literal["slice.set"]
    axis: Axis
    position: Coordinate

    def stream(self) -> str:
        return f"{self.type}.{self.axis}"


class SetWindow(ClientMessage):
    type: Literal["slice.window"]
    name: Annotated[str, StringConstraints(max_length=24, pattern=r"^[a-z]+$")]
    window: Annotated[float, Field(ge=1, le=10000, allow_inf_nan=False)]  # [HU]
    level: Annotated[float, Field(ge=-2000, le=4000, allow_inf_nan=False)]  # [HU]


class SetView(ClientMessage):
    type: Literal["view.set"]
    opacity: Annotated[float, Field(ge=0.1, le=1.0, allow_inf_nan=False)] | None = None
    cut: Literal["whole", "left", "right"] | None = None
    slices: Literal["none", "axial", "coronal", "sagittal", "all"] | None = None
    skin: bool | None = None
    skin_opacity: Annotated[float, Field(ge=0.1, le=1.0, allow_inf_nan=False)] | None = None

    def stream(self) -> str | None:
        """A newer opacity stands for an older one of the same surface; a switch is never left out."""
        one = (self.opacity is None) != (self.skin_opacity is None)
        if not one or (self.cut, self.slices, self.skin) != (None, None, None):
            return None
        return f"{self.type}.{'bone' if self.skin_opacity is None else 'skin'}"


class SetCamera(ClientMessage):
    type: Literal["view.camera"]
    view: Literal["anterior", "left", "right", "superior", "oblique", "nose"]


class LabelsByPage(ClientMessage):
    """The page writes the labels of the scene itself, or no longer does."""

    type: Literal["view.labels"]
    by_page: bool


class Project(ClientMessage):
    """Request for the positions of these points on the canvas, by tests and scripts of the page."""

    type: Literal["project"]
    points: Annotated[list[Position], Field(max_length=1000)]


COMMANDS: tuple[type[ClientMessage], ...] = (SetCross, SetSlice, SetWindow, SetView, SetCamera, LabelsByPage, Project)
