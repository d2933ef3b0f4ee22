"""The hint line of the Plan tab: what to do next. The verdict itself is in the card."""

from __future__ import annotations

from typing import Literal

from app.planning.verdict import Level, Reason

SearchState = Literal["", "runs", "none", "ways"]
"""Of the search for a path: 'none' if it found no way, 'ways' while one is shown that the path does not follow."""

_OF_SEARCH: dict[SearchState, str] = {
    "runs": "",
    "none": "No way: move entry or target, or remove bone.",
    "ways": "Choose a way and use it.",
}
_CLICK_TARGET = "Click a target, in head or slice."
_LOCKED = "Locked. Unlock to edit."
_TURN_SHAFT = "Turn the shaft: ‘Suggest a path’ finds its directions."
_NEXT: dict[Reason, str] = {
    "spent": "Look at it in Register, or go on with care.",
    "margin": "Little margin left: move points, or go on with care.",
    "surface": "Move points, or go on with care.",
    "registration": "Measure better in Register, or move points.",
    "registration_unknown": "Measure the registration in Register.",
    "scan_ends": "Scan ends here: move points or scan further.",
    "side": "Check the side of the entry.",
    "held": "Move the grey points, or change the tool.",
    "pierced": "Lead the path through the nostril, or move its points.",
    "refused": "Move the first point, or change tool or robot.",
}


def plan_hint(
    points: int,
    targets: int,
    add_mode: str,
    ghost: bool,
    locked: bool,
    verdict: tuple[Level, Reason] | None,
    search: SearchState = "",
    at_nostril: bool = False,
    pierced_mm: float | None = None,
) -> str:
    """verdict: level and reason; None while it is not known, or where the dry run has failed.

    at_nostril: the path begins at a nostril. pierced_mm: along the path, where the tool pierces tissue.
    """
    if ghost:
        return "Right place? Enter adds it, Esc cancels."
    if search and not locked:
        return _OF_SEARCH[search]
    if verdict is not None:
        level, reason = verdict
        if locked:
            return _LOCKED
        if reason == "pierced" and at_nostril:
            return _TURN_SHAFT
        if reason == "wall":
            return f"Pierces a wall between air spaces at {pierced_mm or 0.0:.0f} mm: go round."
        return _next(level, reason, targets, add_mode)
    if locked:
        return _LOCKED
    if points == 1 and targets:
        return f"Suggest a path, or click {'another target' if add_mode == 'target' else 'further in'}."
    if add_mode == "target":
        return _CLICK_TARGET
    if points == 0:
        return "Click where the tool goes in: a nostril."
    if points == 1:
        return "Click further in, or add a target and Suggest."
    return "Drag a point, or click to add one."


def _next(level: Level, reason: Reason, targets: int, add_mode: str) -> str:
    """What to do about a verdict."""
    if add_mode == "target" and not targets and level not in ("blocked", "pierces"):
        return _CLICK_TARGET
    if reason in _NEXT:
        return _NEXT[reason]
    return "Go to Rehearse." if targets else "Add a target to inspect, or go to Rehearse."
