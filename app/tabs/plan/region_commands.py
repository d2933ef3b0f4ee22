"""Commands that draw and select regions: protected structures, and bone to be removed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import ClientMessage, Identifier
from app.tabs.plan.region_sections import DrawKind, FreeSide, Purpose

Number = Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False)]  # [mm, N/mm]; what may be, the plan says


class DrawRegion(ClientMessage):
    """Begin to draw: the next clicks are of a region of this kind. sizes_mm: its radius, or its half sizes."""

    type: Literal["region.draw"]
    purpose: Purpose
    kind: DrawKind
    sizes_mm: Annotated[tuple[Number, ...], Field(max_length=3)] = ()
    free_side: FreeSide = "S"


class RegionPlain(ClientMessage):
    """End a chain with the places that were clicked, or draw nothing any more."""

    type: Literal["region.done", "region.cancel"]


class SelectRegion(ClientMessage):
    type: Literal["region.select"]
    region_id: Identifier


REGION_COMMANDS: tuple[type[ClientMessage], ...] = (DrawRegion, RegionPlain, SelectRegion)
