"""What REST answers of registrations."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from msgspec import Meta

from app.documents import Document
from app.operations.fields import Place
from app.operations.public import DocumentPublic, common_values, with_content
from app.plans.model import NOTICE
from app.registration.calibration_records import PointerTip, RobotToTracker, pointer_cautions, robot_cautions
from app.registration.document import MeasuredFrom, RegistrationContent
from app.registration.fit_report import FitReport, FitState, FleSource, WrongPair, report_of

Length = Annotated[float | None, Meta(description="mm; null where it is not known")]
BeadState = Literal["found", "confirmed", "rejected"]


@dataclass(frozen=True)
class PairPublic:
    """A point seen twice, mm: in the image (LPS) and as measured; null where that is missing yet.

    residual_mm: its distance under the transform, not an error of the tool. bead: id of the bead it is the centre of.
    """

    id: str
    label: str
    in_image: Place | None
    measured: Place | None
    enabled: bool
    weight: float
    measured_from: MeasuredFrom
    bead: str
    residual_mm: Length


@dataclass(frozen=True)
class FoundBeadPublic:
    """A bead that was found; confirmed: a pair was made of it. Position in LPS mm; name: as the case has it."""

    id: str
    name: str
    position: Place
    diameter_mm: float
    peak_hu: float
    voxels: int
    state: BeadState


@dataclass(frozen=True)
class FitPublic:
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
    cautions: tuple[str, ...]

    @classmethod
    def of(cls, report: FitReport) -> FitPublic:
        return cls(**{field.name: getattr(report, field.name) for field in fields(cls)})


@dataclass(frozen=True)
class PointerTipPublic(PointerTip):
    """The tip of a tracked pointer, mm in the frame whose pose the tracker tells, and how it was found.

    residual_mm: rms distance of the tip from where it stood; tip_error_mm: expected rms error of it; swing_deg: half
    angle of the cone that the pointer was swung in. cautions: sentences.
    """

    cautions: tuple[str, ...]


@dataclass(frozen=True)
class RobotToTrackerPublic(RobotToTracker):
    """Where the tracker stands beside the robot. transform: from the tracker to the base, 16 numbers row by row, mm.

    covariance: 36 numbers, row by row, of its error (t, ω) in mm and rad. cautions: sentences.
    """

    cautions: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
@with_content(RegistrationContent)
class RegistrationPublic(DocumentPublic):
    """A registration. transform: from the image (LPS) to the frame `to`, 16 numbers row by row, mm.

    made_from: 'none' while there is no transform (what stands there means nothing then), 'pairs', 'given' of one that
    was read from a file, or 'surface' of one that was refined on touched points. fle_mm: as stated; null where it is
    estimated, see `fit`. told: of undo and redo what it took back or did again; of a file its doubts; else ''.
    """

    case_hash: str
    schema: str
    told: str
    pairs: list[PairPublic]
    beads: list[FoundBeadPublic]
    fit: FitPublic
    pointer: PointerTipPublic | None
    robot: RobotToTrackerPublic | None
    notice: str = NOTICE

    @classmethod
    def of(cls, document: Document[RegistrationContent]) -> RegistrationPublic:
        content, report = document.content, report_of(document.content)
        pointer, robot = content.pointer, content.robot
        pairs = [PairPublic(**vars(pair), residual_mm=report.residuals_mm.get(pair.id)) for pair in content.pairs]
        own = {
            "pairs": pairs,
            "beads": _beads(content),
            "fit": FitPublic.of(report),
            "pointer": pointer and PointerTipPublic(**vars(pointer), cautions=pointer_cautions(pointer)),
            "robot": robot and RobotToTrackerPublic(**vars(robot), cautions=robot_cautions(robot)),
        }
        of_document = {name: getattr(document, name) for name in ("case_hash", "schema", "told")}
        return cls(**common_values(document), **of_document, **(vars(content) | own))


def _beads(content: RegistrationContent) -> list[FoundBeadPublic]:
    confirmed = {pair.bead for pair in content.pairs}
    found = []
    for bead in content.beads:
        values = {name: value for name, value in vars(bead).items() if name != "rejected"}
        state: BeadState = "confirmed" if bead.id in confirmed else "rejected" if bead.rejected else "found"
        found.append(FoundBeadPublic(**values, state=state))
    return found
