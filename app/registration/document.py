"""Contents of registrations: how the image of a case lies on the patient, and the fiducials that say so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import numpy as np
from msgspec import Meta

from app.documents import Document, new_in
from app.kit.names import check_stored_label
from app.operations.fields import REFUSED, MaybeId, Place
from app.registration.calibration_records import PointerTip, RobotToTracker, Rows, check_rigid, check_robot
from app.registration.file_metadata import FileMetadata
from app.registration.found_beads import MAX_BEADS, BeadSearchRecord, FoundBead, check_beads
from app.registration.touched_surface import TouchedSurface, check_surface
from vfix_engine.errors import InputError
from vfix_engine.frames import ImageRegistration, RegisteredTo

SCHEMA = "vfix-registration/4"  # one more with a field that is new in it
MAX_PAIRS = 100
MAX_FLE_MM = 50.0
MAX_WEIGHT = 1e6
IDENTITY = tuple(np.eye(4).ravel().tolist())

_FLE_REFUSED = f"a localisation error of {{:g}} mm cannot be; say more than 0 and up to {MAX_FLE_MM:g} mm."
_WEIGHT_REFUSED = "a pair's weight is above 0; leave a pair out of the fit by its switch."
Fle = Annotated[float, Meta(gt=0.0, le=MAX_FLE_MM, extra={REFUSED: _FLE_REFUSED})]  # [mm]
Weight = Annotated[float, Meta(gt=0.0, le=MAX_WEIGHT, extra={REFUSED: _WEIGHT_REFUSED})]

MeasuredFrom = Literal["typed", "file", "simulated", "tracker"]
MadeFrom = Literal["none", "pairs", "given", "surface"]


@dataclass(frozen=True)
class FiducialPair:
    """One point seen twice, in mm: in the image (LPS), and measured in the frame that is registered to.

    Either may be missing while a registration is made. measured_from: how it was measured. bead: id of the bead found
    in the CT that `in_image` is the centre of, '' for another place. Only an enabled pair is fitted, by its weight.
    """

    label: str
    in_image: Place | None
    measured: Place | None
    id: MaybeId = ""
    enabled: bool = True
    weight: Weight = 1.0
    measured_from: MeasuredFrom = "typed"
    bead: MaybeId = ""

    @property
    def complete(self) -> bool:
        """Whether it was seen in the image and measured."""
        return self.in_image is not None and self.measured is not None


@dataclass(frozen=True)
class RegistrationContent:
    """transform: 16 numbers, row by row, from the image to the frame `to`, see `vfix_engine.frames`; mm.

    pairs: the fiducials that it was found with, or is judged by. made_from: 'pairs' of a transform that was fitted to
    them, 'given' of one that came from elsewhere, 'surface' of one that was refined on touched points of a surface,
    'none' while there is none: the transform means nothing then.
    fle_mm: rms length of the localisation error of one fiducial, as stated; None where it is estimated from the fit.
    beads, search: what was found in the CT, and how it was looked for. surface: what was touched for a refinement.
    pointer, robot: what it was measured with, where that was calibrated.
    said: what the file of a given transform says of it, also while it is refined; None for no file.
    """

    to: RegisteredTo = "patient"
    transform: Rows = IDENTITY
    pairs: Annotated[tuple[FiducialPair, ...], Meta(max_length=MAX_PAIRS)] = ()
    made_from: MadeFrom = "none"
    fle_mm: Annotated[Fle | None, new_in(2)] = None
    beads: Annotated[tuple[FoundBead, ...], Meta(max_length=MAX_BEADS), new_in(2)] = ()
    search: Annotated[BeadSearchRecord | None, new_in(2)] = None
    surface: Annotated[TouchedSurface | None, new_in(3)] = None
    pointer: Annotated[PointerTip | None, new_in(3)] = None
    robot: Annotated[RobotToTracker | None, new_in(3)] = None
    said: Annotated[FileMetadata | None, new_in(4)] = None

    @property
    def said_simulated(self) -> bool:
        """Whether the file that the transform comes from says that it is simulated."""
        return self.made_from in ("given", "surface") and self.said is not None and self.said.simulated

    @property
    def registration(self) -> ImageRegistration:
        """What `vfix_engine.frames` composes; it means nothing while `made_from` is 'none'."""
        return ImageRegistration(np.array(self.transform).reshape(4, 4), self.to)

    @property
    def used_pairs(self) -> tuple[FiducialPair, ...]:
        """The pairs that a fit uses."""
        return tuple(pair for pair in self.pairs if pair.enabled and pair.complete)

    @property
    def fre_mm(self) -> float | None:
        """Fiducial registration error: the root mean square of the used pairs' distances; None without a pair.

        It tells how well the pairs fit, not how far a target is off.
        """
        residuals = self.residuals_mm(self.used_pairs)
        return float(np.sqrt(np.mean(np.square(residuals)))) if residuals else None

    def residuals_mm(self, pairs: tuple[FiducialPair, ...]) -> list[float]:
        """The distances of complete pairs under the transform."""
        if not pairs:
            return []
        transform = self.registration.transform
        placed = np.array([pair.in_image for pair in pairs]) @ transform[:3, :3].T + transform[:3, 3]
        distances: list[float] = np.linalg.norm(placed - np.array([pair.measured for pair in pairs]), axis=1).tolist()
        return distances


StoredRegistration: TypeAlias = Document[RegistrationContent]


def check_registration(content: RegistrationContent) -> RegistrationContent:
    """The content, where it is a rigid transform and its parts do not contradict each other; types say the rest.

    Raises InputError or one of its kinds.
    """
    check_rigid(content.transform, "the registration's transform")
    for pair in content.pairs:
        check_stored_label(pair.label, "label")
    ids = [pair.id for pair in content.pairs if pair.id]
    if len(set(ids)) < len(ids):
        raise InputError("two pairs of the registration have the same identifier.")
    check_beads(content.beads, content.search)
    check_surface(content.surface)
    check_robot(content.robot)
    return content
