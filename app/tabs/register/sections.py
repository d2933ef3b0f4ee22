"""Sections of the Register tab."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position
from app.registration.document import MadeFrom, MeasuredFrom
from app.registration.fit_report import FitState, FleSource
from app.registration.service import UseState
from app.registration.touched_surface import TouchedFrom
from app.tabs.register.calibration_view import CalibrationView

BeadState = Literal["found", "confirmed", "rejected"]
MarkState = Literal[BeadState, "left_out"]


class RegistrationEntry(TypedDict):
    """A registration in the list."""

    id: str
    name: str
    modified: str
    deleted: bool


class RegistrationsSection(TypedDict):
    """The registrations of the open case."""

    items: list[RegistrationEntry]


class BeadEntry(TypedDict):
    """A bead that was found in the CT; name: of its point, once it is one, else what that would be called."""

    id: str
    name: str
    position: Position
    diameter_mm: float
    state: BeadState


class BeadSearchView(TypedDict):
    """How beads were looked for. diameter_mm: None for every size; left_out: dense places that are no beads."""

    diameter_mm: float | None
    threshold_hu: float
    cautions: list[str]
    left_out: int


class PairEntry(TypedDict):
    """A point seen twice; a place that is missing is None. residual_mm: how far it is off under the transform."""

    id: str
    label: str
    in_image: Position | None
    measured: Position | None
    enabled: bool
    weight: float
    measured_from: MeasuredFrom
    bead: str
    residual_mm: float | None


class WrongPairView(TypedDict):
    """The pair that does not fit the others."""

    pair: str
    label: str
    certainty: Literal["outlier", "suspect"]
    words: str


class FitView(TypedDict):
    """How the registration stands. fre_mm, mean_residual_mm: how well the pairs fit, not how exact the tool is."""

    state: FitState
    words: str
    used: int
    fre_mm: float | None
    mean_residual_mm: float | None
    wrong: WrongPairView | None
    fle_mm: float | None
    fle_source: FleSource
    simulated: bool
    cautions: list[str]


class ErrorRow(TypedDict):
    """The error to be expected at a target, or at the worst place of the path (s_mm along it)."""

    label: str
    rms_mm: float
    within_95_mm: float
    position: Position
    s_mm: float | None


class ErrorsView(TypedDict):
    """The error to be expected in the open plan, and what it means."""

    rows: list[ErrorRow]
    words: str


class OrderMove(TypedDict):
    """A pair and the measured point that an order gives it. measured_at: label of the pair that it stands at now."""

    label: str
    measured_at: str
    measured: Position
    stays: bool


class OrderView(TypedDict):
    """An order that fits: what each pair of the image gets, and how well the points fit then."""

    moves: list[OrderMove]
    fre_mm: float


class OrdersView(TypedDict):
    """What was found of the order of the measured points, the order that fits best first."""

    candidates: list[OrderView]
    ambiguous: bool
    unchanged: bool
    words: str


class RefinementView(TypedDict):
    """What a refinement did, mm. residual_mm: of the `kept` points; it is never the accuracy. stability: 0 to 1."""

    residual_mm: float
    kept: int
    moved_mm: float
    stability: float


class TouchedView(TypedDict):
    """What was touched on a structure, by its id; refinement: None while the registration was not refined on it."""

    structure: str
    count: int
    measured_from: TouchedFrom
    refinement: RefinementView | None


class RegistrationSection(TypedDict):
    """The open registration; fle_stated_mm: the localisation error that was stated, None where it is estimated.

    anatomy: name of the structure that the case is driven in. touched: None where no surface was touched.
    """

    id: str
    revision: int
    name: str
    locked: bool
    deleted: bool
    can_undo: bool
    can_redo: bool
    made_from: MadeFrom
    has_volume: bool
    selected: str | None
    beads: list[BeadEntry]
    search: BeadSearchView | None
    pairs: list[PairEntry]
    fit: FitView
    fle_stated_mm: float | None
    errors: ErrorsView
    orders: OrdersView | None
    anatomy: str
    touched: TouchedView | None
    calibration: CalibrationView


class PlanUseSection(TypedDict):
    """The registration that the open plan uses. here: it is the one that is open in this tab. to: what it leads to.

    words: that it can be used, or why not. Of one that can: doubts to know before, and what error is to be expected.
    has_balls: the error at the plan's targets is known, and drawn as balls about them.
    """

    plan: str
    registration: str | None
    name: str | None
    state: UseState
    to: Literal["patient", "base"] | None
    words: str
    doubts: list[str]
    error_words: str
    has_balls: bool
    here: bool
    locked: bool


class FiducialMark(TypedDict):
    """A mark in the slices and the scene. measured: where it was measured, in the image; None without a fit.

    state: of a bead, or 'left_out' of a point that the fit leaves out.
    """

    id: str
    label: str
    position: Position
    measured: Position | None
    state: MarkState
    selected: bool


class FiducialsSection(TypedDict):
    """The marks of beads and points while the tab is open."""

    items: list[FiducialMark]


class TrackerView(TypedDict):
    """The tracked pointer that the planner listens to: whether it is seen, and words that say so."""

    state: Literal["connecting", "waiting", "fresh", "stale"]
    words: str


class RegisterSections(TypedDict):
    """Registrations of the case, the open one, and the one of the open plan."""

    registrations: RegistrationsSection
    registration: RegistrationSection | None
    plan_use: PlanUseSection | None
    fiducials: FiducialsSection
    pointer: TrackerView | None
