"""Sections of what all tabs share: the open case and how it is shown, points and targets, the scene, the camera."""

from __future__ import annotations

from typing import Annotated, Literal, TypedDict

from app.messages.sections import Length, Position
from vfix_engine.files.volume import Axis

ItemKind = Literal["point", "target"]


class FrameView(TypedDict):
    """Frame of the file that the case was made of; assumed: the file did not name it."""

    name: str
    assumed: bool


class SurfaceView(TypedDict):
    """A surface of the case and what is said of it."""

    name: str
    triangles: int
    words: str


class OutlineView(TypedDict):
    """A surface whose cut is drawn in the slices, and the colour. closed: by flat faces where its volume ends."""

    surface: str
    colour: str
    closed: bool


class OverlayView(TypedDict):
    """A volume that can be laid over the open case; words: its grid."""

    id: str
    name: str
    words: str
    notes: list[str]


class CaseSection(TypedDict):
    """The open case; loading: what is being read, None when all of it is there.

    window: width and centre of grey values that the scanner's files suggest, None where they do not.
    volumes: names of the CT volumes in the slices, the widest first, the finer ones over it. outlines: what can be
    drawn of its structures in the slices. images: it has some that can identify its patient.
    """

    id: str
    name: str
    frame: FrameView
    spacing_mm: Position | None
    surfaces: list[SurfaceView]
    uncertainty: str
    has_volume: bool
    images: bool
    beads: int
    notes: list[str]
    detail: str | None
    loading: str | None
    window: Annotated[list[float], Length(2)] | None
    volumes: list[str]
    overlays: list[OverlayView]
    outlines: list[OutlineView]


class SliceGrid(TypedDict):
    """Size of a slice's picture in pixels; origin: centre of its first pixel; u and v: from one pixel to the next."""

    columns: int
    rows: int
    origin: Position
    u: Position
    v: Position


class SlicePlane(SliceGrid):
    """One slice: its place along the plane's normal, the range of places, and the grid of a finer picture within it."""

    position: float
    lo: float
    hi: float
    step: float
    detail: SliceGrid | None


class SlicesSection(TypedDict):
    """The three slices through the cross, and the grey values [HU]."""

    cross: Position
    window_name: str
    window: float
    level: float
    planes: dict[Axis, SlicePlane]


class SkinSection(TypedDict):
    """The skin in the scene. possible: the case has a CT of a head. shown: switched on, and there or being made.

    opacity: 0 to 1. words: why it could not be made, or the warning that it is a patient's face; else ''.
    """

    possible: bool
    shown: bool
    opacity: float
    words: str


class ViewSection(TypedDict):
    """How the head is shown: opacity 0 to 1, the cut, the slices in the scene ('none', an axis or 'all'), the skin."""

    opacity: float
    cut: Literal["whole", "left", "right"]
    slices: str
    skin: SkinSection


class CaseSections(TypedDict):
    """The case and how it is shown."""

    case: CaseSection | None
    slices: SlicesSection | None
    view: ViewSection


class ItemEntry(TypedDict):
    """A point of the path or a target."""

    id: str
    label: str
    position: Position


class ItemsSection(TypedDict):
    """Points and targets, in order."""

    points: list[ItemEntry]
    targets: list[ItemEntry]


class CurveSection(TypedDict):
    """Places along the path."""

    points: list[Position]


class SceneSection(TypedDict):
    """Whether the three-dimensional scene shows the head; words: what it waits for."""

    ready: bool
    words: str


class CameraSection(TypedDict):
    """Height of the view at the centre of the scene; pivot: what the view turns about since the last click, if any."""

    view_height_mm: float | None
    pivot: Position | None


class LabelView(TypedDict):
    """Words at a place of the scene."""

    kind: str
    words: str
    position: Position


class ProjectAnswer(TypedDict):
    """Places on the canvas in parts of its size, None for a place behind the camera; None without a camera."""

    places: list[Annotated[list[float], Length(2)] | None] | None


ANSWERS: dict[str, type] = {"project": ProjectAnswer}  # by the command that it answers; all others answer None
