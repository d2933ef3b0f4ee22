"""Commands of the Route tab, beside the operations on routes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.lumen.marks import MarkKind
from app.messages.fields import ClientMessage, Identifier


class OpenRoute(ClientMessage):
    type: Literal["route.open"]
    route_id: Identifier


class PickRoutePlace(ClientMessage):
    """What the next click on the wall is: an end, a polyp or label, or the new place of one; '' for nothing.

    mark_id: which one is moved.
    """

    type: Literal["route.pick"]
    what: Literal["entry", "end", MarkKind, "move", ""]
    mark_id: Identifier | None = None


class ChooseContour(ClientMessage):
    """Choose the contour nearest to a place along the way, in mm; None: none of them."""

    type: Literal["route.contour.choose"]
    at_mm: Annotated[float, Field(ge=0.0, le=1e4, allow_inf_nan=False)] | None


class ViewWall(ClientMessage):
    """Compute which part of the wall the robot can view, or show it in the scene, or not."""

    type: Literal["route.viewable"]
    shown: bool | None = None


COMMANDS: tuple[type[ClientMessage], ...] = (OpenRoute, PickRoutePlace, ChooseContour, ViewWall)
