"""In which order measured points belong to the places in the image, where nobody knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from app.registration.document import RegistrationContent
from app.registration.fit_report import FEWEST, in_our_words
from vfix_engine.errors import InputError
from vfix_engine.registration import match_points


@dataclass(frozen=True)
class OrderCandidate:
    """One order. measured_of: by a pair's id, the id of the pair whose measured point it gets. fre_mm: of its fit."""

    measured_of: Mapping[str, str]
    fre_mm: float


@dataclass(frozen=True)
class OrderAnswer:
    """The orders that fit, the best one first.

    ambiguous: more than one fits about as well, so that somebody has to say. unchanged: the best is the present one.
    """

    candidates: tuple[OrderCandidate, ...]
    ambiguous: bool
    unchanged: bool
    words: str


def order_of(content: RegistrationContent) -> OrderAnswer:
    """The order of the measured points, found by the distances between them; points that are left out stay.

    There may be more places in the image than measured points, or the other way round.
    Raises InputError where there are too few of them, or too many.
    """
    seen = [pair for pair in content.pairs if pair.enabled and pair.in_image is not None]
    measured = [pair for pair in content.pairs if pair.enabled and pair.measured is not None]
    if min(len(seen), len(measured)) < FEWEST:
        raise InputError("an order needs three points in the image and three measured ones.")
    points, places = (np.array(rows, float) for rows in ([p.measured for p in measured], [p.in_image for p in seen]))
    try:
        found = match_points(points, places)
    except InputError as error:
        raise InputError(in_our_words(error)) from None
    candidates = tuple(
        OrderCandidate(
            {seen[place].id: measured[point].id for point, place in zip(one.fixed, one.moving, strict=True)},
            one.fre_mm,
        )
        for one in found.candidates
    )
    unchanged = all(key == value for key, value in candidates[0].measured_of.items())
    return OrderAnswer(candidates, found.ambiguous, unchanged, _words(found.ambiguous, unchanged))


def _words(ambiguous: bool, unchanged: bool) -> str:
    if ambiguous:
        return (
            "Several orders fit about as well. Choose the right one, or measure again in a known order. The points are "
            "laid out so evenly that only somebody who knows which one was touched can say."
        )
    return "The points are in the right order." if unchanged else "Another order fits far better."
