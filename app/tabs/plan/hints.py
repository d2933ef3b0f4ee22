"""The hint line of the Plan tab: what to do next. The verdict itself is in the card."""

from __future__ import annotations

from app.planning.verdict import Level, Reason

_CLICK_TARGET = "Click what is to be inspected, in the head or in a slice. Targets stay where you click."
_LOCKED = "The points are locked. Unlock them to add, move or delete."
_NEXT: dict[Reason, str] = {
    "spent": "Look at it in Register, or go on with care.",
    "margin": "Hardly more than the margin is left: move points, or go on with care.",
    "surface": "Move points, or go on with care.",
    "registration": "Measure better in Register, or move points.",
    "registration_unknown": "In the image the tool passes.",
    "scan_ends": "The tool passes what the scan shows.",
    "side": "Check the side under Paths.",
    "held": "Move points where the path turns grey, or choose another tool or robot.",
    "pierced": "Lead the path through the nostril, or move its points.",
    "wall": "Lead the path round it, or go on with care.",
    "refused": "Move the first point, or choose another tool or robot.",
}


def plan_hint(
    points: int,
    targets: int,
    add_mode: str,
    ghost: bool,
    locked: bool,
    verdict: tuple[Level, Reason] | None,
) -> str:
    """verdict: level and reason; None while it is not known, or where the dry run has failed."""
    if ghost:
        return "Is this the right place? Enter or ‘Add here’ adds it, Esc takes it back."
    if verdict is not None:
        level, reason = verdict
        return _LOCKED if locked else _next(level, reason, targets, add_mode)
    if locked:
        return _LOCKED
    if add_mode == "target":
        return _CLICK_TARGET
    if points == 0:
        return "Click the place where the tool goes in: at the nostril, in the head or in a slice."
    if points == 1:
        return "Click the next place of the path, further in. Slices and the cut-away show the air."
    return "Drag a point to move it, or click to add one; the verdict follows."


def _next(level: Level, reason: Reason, targets: int, add_mode: str) -> str:
    """What to do about a verdict."""
    if add_mode == "target" and not targets and level not in ("blocked", "pierces"):
        return _CLICK_TARGET
    if reason in _NEXT:
        return _NEXT[reason]
    return "Go to Rehearse." if targets else "Add a target to inspect, or go to Rehearse."
