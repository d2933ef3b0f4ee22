"""Contents of registrations: how the image of a case lies on the patient, and the fiducials that say so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from app.services.names import check_stored_label
from app.services.plan_model import Position, check_position, number
from app.services.plan_points import check_id
from app.services.registration.calibration_records import (
    PointerTip,
    RobotToTracker,
    check_pointer,
    check_rigid,
    check_robot,
    pointer_from_json,
    robot_from_json,
    tool_to_json,
)
from app.services.registration.found_beads import (
    BeadSearchRecord,
    FoundBead,
    bead_from_json,
    bead_to_json,
    check_beads,
    search_from_json,
    search_to_json,
)
from app.services.registration.said_by_file import SaidByFile, check_said, said_from_json, said_to_json
from app.services.registration.touched_surface import TouchedSurface, check_surface, surface_from_json, surface_to_json
from vfix_engine.errors import InputError
from vfix_engine.frames import ImageRegistration, RegisteredTo

MAX_PAIRS = 100
MAX_FLE_MM = 50.0
MAX_WEIGHT = 1e6
IDENTITY = tuple(np.eye(4).ravel().tolist())

MeasuredFrom = Literal["typed", "file", "simulated", "tracker"]
MadeFrom = Literal["none", "pairs", "given", "surface"]


@dataclass(frozen=True)
class FiducialPair:
    """One point seen twice, in mm: in the image (LPS), and measured in the frame that is registered to.

    Either may be missing while a registration is made. measured_from: how it was measured. bead: id of the bead found
    in the CT that `in_image` is the centre of, '' for another place. Only an enabled pair is fitted, by its weight.
    """

    label: str
    in_image: Position | None
    measured: Position | None
    id: str = ""
    enabled: bool = True
    weight: float = 1.0
    measured_from: MeasuredFrom = "typed"
    bead: str = ""

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
    transform: tuple[float, ...] = IDENTITY
    pairs: tuple[FiducialPair, ...] = ()
    made_from: MadeFrom = "none"
    fle_mm: float | None = None
    beads: tuple[FoundBead, ...] = ()
    search: BeadSearchRecord | None = None
    surface: TouchedSurface | None = None
    pointer: PointerTip | None = None
    robot: RobotToTracker | None = None
    said: SaidByFile | None = None

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


def registration_to_json(content: RegistrationContent) -> dict[str, Any]:
    """The content as plain JSON values, each number unrounded."""
    return {
        "to": content.to,
        "transform": list(content.transform),
        "pairs": [pair_to_json(pair) for pair in content.pairs],
        "made_from": content.made_from,
        "fle_mm": content.fle_mm,
        "beads": [bead_to_json(bead) for bead in content.beads],
        "search": search_to_json(content.search),
        "surface": surface_to_json(content.surface),
        "pointer": tool_to_json(content.pointer),
        "robot": tool_to_json(content.robot),
        "said": said_to_json(content.said),
    }


def pair_to_json(pair: FiducialPair) -> dict[str, Any]:
    """A pair as plain JSON values."""
    places = {"in_image": pair.in_image, "measured": pair.measured}
    return {**vars(pair), **{name: None if place is None else list(place) for name, place in places.items()}}


def registration_from_json(data: Mapping[str, Any]) -> RegistrationContent:
    """The inverse of `registration_to_json`, checked. Raises InputError or one of its kinds."""
    known = set(RegistrationContent.__dataclass_fields__)
    if set(data) != known:
        raise InputError(f"a registration has {', '.join(sorted(known))}, and says each of them.")
    if not isinstance(data["transform"], list) or len(data["transform"]) != 16:
        raise InputError("a registration's transform has 16 numbers, row by row.")
    if not isinstance(data["pairs"], list) or not isinstance(data["beads"], list):
        raise InputError("a registration's pairs and beads must be lists.")
    return check_registration(
        RegistrationContent(
            data["to"],
            tuple(number(value, "the registration's transform") for value in data["transform"]),
            tuple(_pair(item) for item in data["pairs"]),
            data["made_from"],
            data["fle_mm"],
            tuple(bead_from_json(item) for item in data["beads"]),
            search_from_json(data["search"]),
            surface_from_json(data["surface"]),
            pointer_from_json(data["pointer"]),
            robot_from_json(data["robot"]),
            said_from_json(data["said"]),
        )
    )


def check_registration(content: RegistrationContent) -> RegistrationContent:
    """The content, where it is a rigid transform and its pairs are places. Raises InputError or one of its kinds."""
    if content.to not in get_args(RegisteredTo):
        raise InputError(f"a registration is to {' or '.join(get_args(RegisteredTo))}, not {content.to!r:.20}.")
    if content.made_from not in get_args(MadeFrom):
        raise InputError(f"a registration is made from {', '.join(get_args(MadeFrom))}, not {content.made_from!r:.20}.")
    if len(content.pairs) > MAX_PAIRS:
        raise InputError(f"{len(content.pairs)} pairs are too many; a registration has {MAX_PAIRS} at most.")
    check_rigid(content.transform, "the registration's transform")
    for pair in content.pairs:
        check_pair(pair)
    ids = [pair.id for pair in content.pairs if pair.id]
    if len(set(ids)) < len(ids):
        raise InputError("two pairs of the registration have the same identifier.")
    check_fle(content.fle_mm)
    check_beads(content.beads)
    check_surface(content.surface)
    check_pointer(content.pointer)
    check_robot(content.robot)
    check_said(content.said)
    return content


def check_fle(fle_mm: Any) -> float | None:
    """A stated localisation error; None stays None. Raises InputError."""
    if fle_mm is None:
        return None
    fle = number(fle_mm, "the localisation error")
    if not 0.0 < fle <= MAX_FLE_MM:
        raise InputError(f"a localisation error of {fle:g} mm cannot be; say more than 0 and up to {MAX_FLE_MM:g} mm.")
    return fle


def check_pair(pair: FiducialPair) -> FiducialPair:
    """The pair, where it can be one. Raises InputError or one of its kinds."""
    check_stored_label(pair.label, "label")
    for place in (pair.in_image, pair.measured):
        if place is not None:
            check_position(place)
    for text in (pair.id, pair.bead):
        if text != "":
            check_id(text, "a pair")
    weight = number(pair.weight, "a pair's weight")
    if not 0.0 < weight <= MAX_WEIGHT:
        raise InputError("a pair's weight is above 0; leave a pair out of the fit by its switch.")
    if pair.measured_from not in get_args(MeasuredFrom):
        raise InputError(f"a point is measured by {', '.join(get_args(MeasuredFrom))}, not {pair.measured_from!r:.20}.")
    if not isinstance(pair.enabled, bool):
        raise InputError("whether a pair is fitted is true or false.")
    return pair


def _pair(item: Any) -> FiducialPair:
    known = set(FiducialPair.__dataclass_fields__)
    if not isinstance(item, Mapping) or set(item) != known:
        raise InputError(f"each pair of a registration has {', '.join(sorted(known))}.")
    for name in ("in_image", "measured"):
        if not isinstance(item[name], (list, type(None))):
            raise InputError("a place of a registration's pair is a list of three numbers, in mm, or null.")
    places = {name: None if item[name] is None else check_position(item[name]) for name in ("in_image", "measured")}
    return check_pair(FiducialPair(**{**item, **places}))
