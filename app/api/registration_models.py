"""Models of registrations in the API."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.api.calibration_models import PointerTipPublic, RobotToTrackerPublic
from app.api.dependencies import Flag, Number, Wish
from app.api.plan_models import Label, Name, Position, Revision
from app.plans.model import NOTICE
from app.registration.document import MadeFrom, MeasuredFrom
from app.registration.editor import StoredRegistration
from app.registration.fit_report import FitReport, FitState, FleSource, WrongPair, report_of
from app.registration.found_beads import BeadSearchRecord
from app.registration.said_by_file import SaidByFile
from app.registration.service import LONGEST_S, MEASURE_S, PlanRegistration, UseState
from app.registration.simulated_touch import DEFAULT_NOISE_MM
from app.registration.target_errors import ErrorAlongPath, ErrorAtTarget, ErrorTable
from app.registration.touched_surface import TouchedSurface
from vfix_engine.frames import RegisteredTo
from vfix_engine.registration.beads import THRESHOLD_HU

Triple = tuple[float, float, float]
Length = Annotated[float | None, Field(description="mm; null where it is not known")]


class PairPublic(BaseModel):
    """A point seen twice, mm: in the image (LPS) and as measured; null where that is missing yet.

    residual_mm: its distance under the transform, not an error of the tool. bead: id of the bead it is the centre of.
    """

    id: str
    label: str
    in_image: Triple | None
    measured: Triple | None
    enabled: bool
    weight: float
    measured_from: MeasuredFrom
    bead: str
    residual_mm: Length


class FoundBeadPublic(BaseModel):
    """A bead that was found; confirmed: a pair was made of it. Position in LPS mm; name: as the case has it."""

    id: str
    name: str
    position: Triple
    diameter_mm: float
    peak_hu: float
    voxels: int
    state: Literal["found", "confirmed", "rejected"]


class FitPublic(BaseModel):
    """How the registration stands; lengths in mm.

    fre_mm: root mean square of the residuals of the used pairs, mean_residual_mm: their mean; both tell how well the
    pairs fit, and neither is the error at a target. fle_mm: rms length of one fiducial's localisation error.
    """

    state: FitState
    words: str
    used: int
    fre_mm: Length
    mean_residual_mm: Length
    wrong: WrongPair | None
    fle_mm: Length
    fle_source: FleSource
    simulated: bool
    cautions: list[str]

    @classmethod
    def of(cls, report: FitReport) -> FitPublic:
        return cls.model_validate(report, from_attributes=True)


class RegistrationPublic(BaseModel):
    """A registration. transform: from the image (LPS) to the frame `to`, 16 numbers row by row, mm.

    made_from: 'none' while there is no transform (what stands there means nothing then), 'pairs', 'given' of one that
    was read from a file, or 'surface' of one that was refined on touched points. fle_mm: as stated; null where it is
    estimated, see `fit`.
    """

    id: str
    name: str
    case_id: str
    case_hash: str
    schema_: Annotated[str, Field(alias="schema")]
    to: RegisteredTo
    transform: list[float]
    made_from: MadeFrom
    fle_mm: Length
    pairs: list[PairPublic]
    beads: list[FoundBeadPublic]
    search: BeadSearchRecord | None
    surface: TouchedSurface | None
    fit: FitPublic
    pointer: PointerTipPublic | None
    robot: RobotToTrackerPublic | None
    said: SaidByFile | None
    created: str
    modified: str
    revision: int
    locked: bool
    deleted_at: str | None
    can_undo: bool
    can_redo: bool
    unreadable: Annotated[str, Field(description="in a list: why the content cannot be read; '' where it can")]
    told: Annotated[
        str, Field(description="of undo and redo: what it took back or did again; of a file: its doubts; else ''")
    ]
    notice: str = NOTICE

    @classmethod
    def of(cls, document: StoredRegistration) -> RegistrationPublic:
        content, report = document.content, report_of(document.content)
        own = ("pairs", "beads", "search", "surface", "fit", "pointer", "robot", "said", "schema_", "notice")
        values: dict[str, Any] = {
            name: getattr(document, name, None) for name in cls.model_fields if name not in own and name not in _CONTENT
        }
        values |= {name: getattr(content, name) for name in _CONTENT}
        pairs = [{**vars(pair), "residual_mm": report.residuals_mm.get(pair.id)} for pair in content.pairs]
        confirmed = {pair.bead for pair in content.pairs}
        beads = [
            {**vars(bead), "state": "confirmed" if bead.id in confirmed else "rejected" if bead.rejected else "found"}
            for bead in content.beads
        ]
        parts = {"pairs": pairs, "beads": beads, "search": content.search, "surface": content.surface,
                 "said": content.said, "schema": document.schema}  # fmt: skip
        tools = {"pointer": PointerTipPublic.of(content.pointer), "robot": RobotToTrackerPublic.of(content.robot)}
        return cls.model_validate({**values, **parts, **tools, "fit": FitPublic.of(report)})


_CONTENT = ("to", "transform", "made_from", "fle_mm")


class RegistrationCreate(Wish):
    """A new registration; empty, or a copy of another one of the case. to: of an empty one, else that of the copied."""

    name: Name
    to: RegisteredTo | None = None
    copy_of: Annotated[str | None, Field(max_length=64)] = None


class FleWish(Wish):
    """The rms length of one fiducial's localisation error, mm; null estimates it from the fit."""

    mm: Number | None


class RegistrationUpdate(Wish):
    """Changes of a registration, one per request; omitted fields stay."""

    name: Name | None = None
    deleted: Flag | None = None
    locked: Flag | None = None
    fle: FleWish | None = None
    made_from: Literal["pairs"] | None = None
    to: RegisteredTo | None = None
    revision: Revision = None


class BeadsWish(Wish):
    """What to look for in the CT; a diameter of null finds beads of every size."""

    diameter_mm: Number | None = None
    threshold_hu: Number = THRESHOLD_HU


class BeadWish(Wish):
    """Confirmed: a pair is made of the bead; rejected: its pair is taken away; null: neither."""

    confirmed: Flag | None
    revision: Revision = None


class PairCreate(Wish):
    """A pair, of which either place may be missing."""

    label: Label | None = None
    in_image: Position | None = None
    measured: Position | None = None
    revision: Revision = None


class PairUpdate(Wish):
    """Changes of a pair; omitted fields stay, a place that is null is taken away."""

    label: Label | None = None
    in_image: Position | None = None
    measured: Position | None = None
    enabled: Flag | None = None
    weight: Number | None = None
    revision: Revision = None

    def fields(self) -> dict[str, Any]:
        """What was said, without the revision."""
        said = self.model_dump(exclude={"revision"}, exclude_unset=True)
        return {name: value for name, value in said.items() if value is not None or name in ("in_image", "measured")}


class TouchWish(Wish):
    """A touch of the simulated pointer. noise_mm: rms length of its error; seed: of the error, null for a new one."""

    noise_mm: Number = DEFAULT_NOISE_MM
    seed: Annotated[int | None, Field(ge=0, lt=2**63, strict=True)] = None
    revision: Revision = None


class MeasureWish(Wish):
    """How long the tracked pointer rests on the point."""

    seconds: Annotated[float, Field(ge=0.1, le=LONGEST_S, allow_inf_nan=False, strict=True)] = MEASURE_S
    revision: Revision = None


class MeasuredPair(BaseModel):
    """The registration after a point was measured; spread_mm: rms distance of the poses from their mean."""

    spread_mm: float
    registration: RegistrationPublic


class EditedPair(BaseModel):
    """A pair that was added, and the registration after it."""

    pair: str
    registration: RegistrationPublic


class OrderWish(Wish):
    """The order to take: by a pair's id, the id of the pair whose measured point it gets."""

    measured_of: Annotated[dict[str, str], Field(min_length=1, max_length=100)]
    revision: Revision = None


class ErrorTablePublic(BaseModel):
    """The error to be expected at a plan's targets and along its chosen path, and what that means or why it is open."""

    fle_mm: Length
    fle_source: FleSource
    targets: list[ErrorAtTarget]
    path: ErrorAlongPath | None
    words: str

    @classmethod
    def of(cls, table: ErrorTable) -> ErrorTablePublic:
        return cls.model_validate(table, from_attributes=True)


class PlanRegistrationWish(Wish):
    """The registration that a plan uses; null for none."""

    registration: Annotated[str | None, Field(min_length=1, max_length=64)]
    revision: Revision = None


class PlanRegistrationPublic(BaseModel):
    """The registration that a plan refers to: 'ready', or why it cannot be used, with words; null without any.

    doubts: of one that is ready, what to know before it is gone by, such as a point that does not fit the others.
    """

    plan_id: str
    registration: str | None
    name: str | None
    state: UseState
    words: str
    doubts: tuple[str, ...]
    errors: ErrorTablePublic | None

    @classmethod
    def of(cls, plan_id: str, used: PlanRegistration, errors: ErrorTable | None) -> PlanRegistrationPublic:
        name = None if used.document is None else used.document.name
        table = None if errors is None else ErrorTablePublic.of(errors)
        return cls(
            plan_id=plan_id, registration=used.id, name=name, state=used.state, words=used.words, doubts=used.doubts,
            errors=table,
        )  # fmt: skip
