"""Sections shared by all tabs: the open case and its display, points and targets, the scene, the camera."""

from __future__ import annotations

from typing import Annotated, Literal, TypedDict

from app.cases.kinds import PatientPart
from app.cases.structures import CaseKind
from app.messages.sections import Length, Position
from vfix_engine.files.volume import Axis

ItemKind = Literal["point", "target"]


class FrameView(TypedDict):
    """Frame of the file from which the case was made; assumed: the file did not name it."""

    name: str
    assumed: bool


class SurfaceView(TypedDict):
    """A surface of the case and its report."""

    name: str
    triangles: int
    words: str


class OutlineView(TypedDict):
    """A surface whose cut is drawn in the slices, and the colour. closed: by flat faces where its volume ends."""

    surface: str
    colour: str
    closed: bool


class OverlayView(TypedDict):
    """A volume that can be overlaid on the open case; words: its grid."""

    id: str
    name: str
    words: str
    notes: list[str]


class LandmarkView(TypedDict):
    """A named place of the anatomy, LPS mm."""

    name: str
    position: Position


class CaseSection(TypedDict):
    """The open case; noun, surface: how its kind and its anatomy are called.

    parts: of the Patient tab that are for it. sliced: it may have slices. size_mm: of its first surface along the axes.
    loading: the part that is being read, None when all of it is there.
    window: width and centre of grey values that the scanner's files suggest, None where they do not.
    volumes: names of the CT volumes in the slices, the widest first, finer ones over it. outlines: structures that can
    be drawn in the slices. images: it has images that can identify its patient.
    """

    id: str
    name: str
    kind: CaseKind
    noun: str
    surface: str
    parts: list[PatientPart]
    sliced: bool
    size_mm: list[float]
    landmarks: list[LandmarkView]
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


class ScopePoseView(TypedDict):
    """A place in the lumen, the way ahead, and up in the picture."""

    tip: Position
    shaft: Position
    side: Position


class ScopeSection(TypedDict):
    """What the page's endoscope shows: where its surface and its poses come from; '' for none yet.

    key: another one for another surface. look: of the tissue. hand: a drag in the picture and the arrow keys move the
    camera. own: the picture is turned as the robot's own camera is, which has no lens that could be tilted. pose: what
    is shown before there is a robot. words: why there is no picture.
    """

    surface: str
    key: str
    poses: str
    look: Literal["nose", "colon", "cavity"]
    hand: bool
    own: bool
    pose: ScopePoseView | None
    words: str


class SliceGrid(TypedDict):
    """Size of a slice's picture in pixels; origin: centre of its first pixel; u and v: from one pixel to the next."""

    columns: int
    rows: int
    origin: Position
    u: Position
    v: Position


class SlicePlane(SliceGrid):
    """One slice: position and range along the plane's normal, and the grid of a finer picture within it."""

    position: float
    lo: float
    hi: float
    step: float
    detail: SliceGrid | None


class SlicesSection(TypedDict):
    """The three slices through the crosshair, and the grey values [HU]."""

    cross: Position
    window_name: str
    window: float
    level: float
    planes: dict[Axis, SlicePlane]


class SkinSection(TypedDict):
    """The skin in the scene. possible: the case has a CT of a head. shown: switched on, and there or being made.

    opacity: 0 to 1. colour: as in the scene. words: why it could not be made, or the warning that it is a patient's
    face; else ''.
    """

    possible: bool
    shown: bool
    opacity: float
    colour: str
    words: str


class ViewSection(TypedDict):
    """How the head is shown: opacity 0 to 1, the cut, the slices in the scene ('none', an axis or 'all'), the skin."""

    opacity: float
    cut: Literal["whole", "left", "right"]
    slices: str
    skin: SkinSection


class CaseSections(TypedDict):
    """The case and its display."""

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
    """Whether the three-dimensional scene shows the head; words: the reason for waiting."""

    ready: bool
    words: str


class CameraSection(TypedDict):
    """Height of the view at the centre of the scene; pivot: the centre of rotation since the last click, if any."""

    view_height_mm: float | None
    pivot: Position | None


class LabelView(TypedDict):
    """A label at a position of the scene."""

    kind: str
    words: str
    position: Position


class ProjectAnswer(TypedDict):
    """Positions on the canvas as fractions of its size, None for one behind the camera; None without a camera."""

    places: list[Annotated[list[float], Length(2)] | None] | None


ANSWERS: dict[str, type] = {"project": ProjectAnswer}  # by the command that it answers; all others answer None
