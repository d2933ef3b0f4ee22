"""Registrations as documents: how the image of a case lies on the patient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from app.services.documents import DocumentKind
from app.services.names import check_label
from app.services.plan_model import Position, check_position, number
from vfix_engine.errors import InputError
from vfix_engine.frames import ImageRegistration, RegisteredTo
from vfix_engine.given import rigid_transform

SCHEMA = "vfix-registration/1"
MAX_PAIRS = 100
_IDENTITY = tuple(np.eye(4).ravel().tolist())


@dataclass(frozen=True)
class FiducialPair:
    """One point seen twice, in mm: in the image (LPS), and measured in the frame that is registered to."""

    label: str
    in_image: Position
    measured: Position


@dataclass(frozen=True)
class RegistrationContent:
    """transform: 16 numbers, row by row, from the image to the frame `to`, see `vfix_engine.frames`; mm.

    pairs: the fiducials that it was found with, or is judged by.
    """

    to: RegisteredTo = "patient"
    transform: tuple[float, ...] = _IDENTITY
    pairs: tuple[FiducialPair, ...] = ()

    @property
    def registration(self) -> ImageRegistration:
        """What `vfix_engine.frames` composes."""
        return ImageRegistration(np.array(self.transform).reshape(4, 4), self.to)

    @property
    def fre_mm(self) -> float | None:
        """Fiducial registration error: the root mean square of the pairs' distances; None without a pair.

        It tells how well the pairs fit, not how far a target is off.
        """
        if not self.pairs:
            return None
        transform = self.registration.transform
        placed = np.array([pair.in_image for pair in self.pairs]) @ transform[:3, :3].T + transform[:3, 3]
        off = placed - np.array([pair.measured for pair in self.pairs])
        return float(np.sqrt((off**2).sum(axis=1).mean()))


def registration_to_json(content: RegistrationContent) -> dict[str, Any]:
    """The content as plain JSON values, each number unrounded."""
    pairs = [
        {"label": pair.label, "in_image": list(pair.in_image), "measured": list(pair.measured)}
        for pair in content.pairs
    ]
    return {"to": content.to, "transform": list(content.transform), "pairs": pairs}


def registration_from_json(data: Mapping[str, Any]) -> RegistrationContent:
    """The inverse of `registration_to_json`, checked. Raises InputError or one of its kinds."""
    known = {"to", "transform", "pairs"}
    if set(data) != known:
        raise InputError(f"a registration has {', '.join(sorted(known))}, and says each of them.")
    if not isinstance(data["transform"], list) or len(data["transform"]) != 16:
        raise InputError("a registration's transform has 16 numbers, row by row.")
    if not isinstance(data["pairs"], list):
        raise InputError("a registration's pairs must be a list.")
    transform = tuple(number(value, "the registration's transform") for value in data["transform"])
    return check_registration(RegistrationContent(data["to"], transform, tuple(_pair(item) for item in data["pairs"])))


def check_registration(content: RegistrationContent) -> RegistrationContent:
    """The content, where it is a rigid transform and its pairs are places. Raises InputError or one of its kinds."""
    if content.to not in get_args(RegisteredTo):
        raise InputError(f"a registration is to {' or '.join(get_args(RegisteredTo))}, not {content.to!r:.20}.")
    if len(content.pairs) > MAX_PAIRS:
        raise InputError(f"{len(content.pairs)} pairs are too many; a registration has {MAX_PAIRS} at most.")
    rigid_transform(np.array(content.transform).reshape(4, 4), "the registration's transform")
    for pair in content.pairs:
        check_label(pair.label, "label")
        check_position(pair.in_image)
        check_position(pair.measured)
    return content


def _pair(item: Any) -> FiducialPair:
    if not isinstance(item, Mapping) or set(item) != {"label", "in_image", "measured"}:
        raise InputError("each pair of a registration has a label, in_image and measured.")
    places = [item["in_image"], item["measured"]]
    if not all(isinstance(place, list) for place in places):
        raise InputError("a place of a registration's pair is a list of three numbers, in mm.")
    in_image, measured = (check_position(place) for place in places)
    return FiducialPair(check_label(item["label"], "label"), in_image, measured)


REGISTRATION = DocumentKind(
    name="registration",
    noun="registration",
    schema=SCHEMA,
    empty=RegistrationContent,
    read=registration_from_json,
    write=registration_to_json,
    check=check_registration,
)
