"""Commands of the structures to spare, of the bone to be removed, and of a plan's paths."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import Command, Identifier, Name, Position
from app.tabs.plan.region_sections import DrawKind, FreeSide, Purpose

Number = Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False)]  # [mm, N/mm]; what may be, the plan says


class DrawRegion(Command):
    """Begin to draw: the next clicks are of a region of this kind. sizes_mm: its radius, or its half sizes."""

    type: Literal["region.draw"]
    purpose: Purpose
    kind: DrawKind
    sizes_mm: Annotated[tuple[Number, ...], Field(max_length=3)] = ()
    free_side: FreeSide = "S"


class RegionPlain(Command):
    """End a chain with the places that were clicked, or draw nothing any more."""

    type: Literal["region.done", "region.cancel"]


class RegionOfStructure(Command):
    """Spare a structure of the case."""

    type: Literal["region.structure"]
    structure: Identifier


class RegionCommand(Command):
    type: Literal["region.select", "region.delete"]
    region_id: Identifier


class ChangeRegion(Command):
    """Change some of a region; what is left out stays. no_depth: the greatest depth is left open.

    turn: the other side of a half-space is kept free.
    """

    type: Literal["region.change"]
    region_id: Identifier
    name: Name | None = None
    colour: Annotated[str, Field(max_length=7)] | None = None
    visible: bool | None = None
    soft: bool | None = None
    margin_mm: Number | None = None
    stiffness_n_per_mm: Number | None = None
    max_depth_mm: Number | None = None
    no_depth: bool = False
    sizes_mm: Annotated[list[Number], Field(max_length=3)] | None = None
    place: Position | None = None
    turn: bool = False


REGION_COMMANDS: tuple[type[Command], ...] = (DrawRegion, RegionPlain, RegionOfStructure, RegionCommand, ChangeRegion)
