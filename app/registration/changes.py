"""What changed between two contents of a registration, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable

from app.kit.values import Position
from app.plans.diff import SAME_MM, figure, listed
from app.registration.calibration_records import PointerTip, RobotToTracker
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.file_metadata import FULL
from app.registration.found_beads import FoundBead, bead_label
from app.registration.touched_surface import TouchedSurface

_FROM = {"typed": "typed", "file": "read from a file", "simulated": "simulated", "tracker": "measured by the tracker"}
_MADE = {
    "none": "not known",
    "pairs": "fitted to the points",
    "given": "taken over from elsewhere",
    "surface": "refined on a surface",
}


def changes(before: RegistrationContent, after: RegistrationContent) -> tuple[str, ...]:
    """Sentences, in the order of the panel; none where the two are the same.

    A transform that follows from the points is not told beside them.
    """
    found = [] if before.to == after.to else [f"Registered to {FULL[after.to]} instead of {FULL[before.to]}."]
    found += listed(before.beads, after.beads, lambda bead: f"Bead ‘{bead_label(bead)}’", _bead)
    if before.search != after.search:
        found.append("Beads were looked for." if after.search is not None else "The search for beads is gone.")
    found += listed(before.pairs, after.pairs, lambda pair: f"Point ‘{pair.label}’", _pair)
    if before.fle_mm != after.fle_mm:
        was, now = (_fle(content.fle_mm) for content in (before, after))
        found.append(f"Error of one point: {now} instead of {was}.")
    found += _surface(before.surface, after.surface)
    found += _calibration("pointer", before.pointer, after.pointer)
    found += _calibration("robot", before.robot, after.robot)
    if before.made_from != after.made_from:
        found.append(f"The transform is {_MADE[after.made_from]}, which was {_MADE[before.made_from]}.")
    elif not found and before != after:
        found.append("Another transform is taken over.")
    return tuple(found)


def _bead(was: FoundBead, now: FoundBead) -> Iterable[str]:
    if (by := math.dist(was.position, now.position)) > SAME_MM:
        yield f"moved by {by:.1f} mm"
    if was.rejected != now.rejected:
        yield "rejected" if now.rejected else "not rejected any more"
    if (was.diameter_mm, was.peak_hu, was.voxels, was.name) != (now.diameter_mm, now.peak_hu, now.voxels, now.name):
        yield "found anew"


def _pair(was: FiducialPair, now: FiducialPair) -> Iterable[str]:
    if was.label != now.label:
        yield f"renamed from ‘{was.label}’"
    yield from _place("the place in the image", was.in_image, now.in_image)
    yield from _place("the measured place", was.measured, now.measured)
    if was.measured_from != now.measured_from and None not in (was.measured, now.measured):
        yield f"{_FROM[now.measured_from]} instead of {_FROM[was.measured_from]}"
    if was.enabled != now.enabled:
        yield "fitted" if now.enabled else "left out of the fit"
    if was.weight != now.weight:
        yield f"weight {now.weight:g} instead of {was.weight:g}"
    if was.bead != now.bead:
        yield "at a found bead" if now.bead else "not at a found bead any more"


def _place(what: str, was: Position | None, now: Position | None) -> Iterable[str]:
    if was is None or now is None:
        if was != now:
            yield f"{what} is {'given' if was is None else 'gone'}"
    elif (by := math.dist(was, now)) > SAME_MM:
        yield f"{what} moved by {by:.1f} mm"
    elif was != now:
        yield f"{what} moved by less than {SAME_MM:g} mm"


def _fle(value: float | None) -> str:
    return "estimated from the fit" if value is None else figure(value, " mm")


def _surface(was: TouchedSurface | None, now: TouchedSurface | None) -> Iterable[str]:
    if was == now:
        return
    if was is None or now is None:
        counts = [0 if one is None else len(one.points) for one in (was, now)]
        yield f"Points touched on a surface: {counts[1]} instead of {counts[0]}."
    elif (was.structure, was.points, was.measured_from) != (now.structure, now.points, now.measured_from):
        yield f"Other points were touched on a surface: {len(now.points)} instead of {len(was.points)}."
    elif now.refinement is None:
        yield "The refinement on the touched points is gone."
    else:
        yield f"Refined on the touched points, by up to {now.refinement.moved_mm:.1f} mm."


def _calibration(
    what: str, was: PointerTip | RobotToTracker | None, now: PointerTip | RobotToTracker | None
) -> Iterable[str]:
    if was != now:
        word = "gone" if now is None else "new" if was is None else "another one"
        yield f"The calibration of the {what} is {word}."
