"""Sections of the protected structures and of the bone to be removed."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position

Purpose = Literal["spare", "remove"]
DrawKind = Literal["sphere", "capsules", "capsule", "box", "half_space", "patch"]
FreeSide = Literal["R", "L", "A", "P", "S", "I"]


class RegionView(TypedDict):
    """A protected structure, or a region of bone to be removed.

    kind: of its shape. sub: its shape and how it is kept, in words. sizes: a radius, or a box's half sizes along its
    axes; place: where it is taken by when it is moved, None of a structure of the case. What a purpose or a kind does
    not have is None.
    """

    id: str
    purpose: Purpose
    name: str
    kind: str
    sub: str
    sizes_mm: list[float]
    place: Position | None
    shape: dict[str, object]
    colour: str
    visible: bool
    soft: bool
    margin_mm: float | None
    stiffness_n_per_mm: float | None
    max_depth_mm: float | None


class DrawingView(TypedDict):
    """What is being drawn by clicks; places: those of a chain so far, of this radius and in this colour."""

    purpose: Purpose
    kind: DrawKind
    places: list[Position]
    radius_mm: float
    colour: str
    words: str


class StructureChoice(TypedDict):
    """A structure of the case that can be protected as it is."""

    id: str
    name: str


class RegionsSection(TypedDict):
    """Regions of the open plan."""

    items: list[RegionView]
    selected: str | None
    drawing: DrawingView | None
    structures: list[StructureChoice]
    locked: bool


class RemovedRegionView(TypedDict):
    """The bone in a region that is to be removed, in words."""

    id: str
    words: str


class RemovedBoneSection(TypedDict):
    """The bone that the open plan removes; words: in all, '' where nothing is to be removed, or why it is not known."""

    items: list[RemovedRegionView]
    words: str


class RegionSections(TypedDict):
    """What the Plan tab shows beside points and targets; removed_bone is None while it is counted."""

    regions: RegionsSection | None
    removed_bone: RemovedBoneSection | None
