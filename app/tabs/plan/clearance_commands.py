"""Commands of the clearance along the path."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import ClientMessage

ArcLength = Annotated[float, Field(ge=0.0, le=1e4, allow_inf_nan=False)]  # mm


class ShowTool(ClientMessage):
    """Show the tool where its tip is at an arc length of the path, and the slices there."""

    type: Literal["clearance.show"]
    s_mm: ArcLength

    def stream(self) -> str:
        return self.type


class HideTool(ClientMessage):
    """Show no tool in the plan."""

    type: Literal["clearance.hide"]


COMMANDS: tuple[type[ClientMessage], ...] = (ShowTool, HideTool)
