"""What is said of soft tissue: what the tool passes of it, and what a place lies in."""

from __future__ import annotations

from vfix_engine.imaging.soft_tissue import Surroundings, TissuePassed

_LIES_IN: dict[Surroundings, str] = {
    "air_inside": "",
    "soft_tissue": "The place lies in soft tissue, not in the airway.",
    "outside_body": "The place lies outside the body.",
    "outside_scan": "The place lies outside the scan; whether it is air is not known.",
    "not_known": "Without a CT it is not known whether the place is air.",
}

_CUT_OFF = "Soft tissue is not known: the scan ends in tissue beside the tool"


def tissue_words(passed: TissuePassed) -> str:
    """A sentence about the tool's centreline in the worst pose of a path."""
    if passed.length_mm is None or passed.at_mm is None:
        return "Soft tissue is not known: no CT shows the tool's way."
    if passed.length_mm == 0.0:
        return f"{'Passes no soft tissue' if passed.complete else _CUT_OFF}."
    length = "less than 1 mm" if passed.length_mm < 0.5 else f"{passed.length_mm:.0f} mm"
    at_least = "" if passed.complete else " at least; the scan ends in tissue there"
    return f"Passes {length} of soft tissue{at_least}, when the tip is at {passed.at_mm:.0f} mm."


def place_words(lies_in: Surroundings) -> str:
    """A sentence about a place that is offered; '' for one in the air inside the body."""
    return _LIES_IN[lies_in]
