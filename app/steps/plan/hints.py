"""The hint line of the Plan step: what to do next, in one sentence."""

from __future__ import annotations

from app.services.verdict import Reason

_PASSES: dict[Reason, str] = {
    "spent": "The tool passes; the registration may use up the margin. Look at it in Register, or go on with care.",
    "margin": "The tool passes, but hardly farther from bone than the margin. Move points, or go on with care.",
    "surface": "The tool passes, but nearer to bone than the scan can tell. Move points, or go on with care.",
    "registration": "The tool passes only if the registration is exact: it may be off by more than the clearance. "
    "Measure better in Register, or move points.",
    "registration_unknown": "The tool passes in the image; how far the registration may be off is not known.",
    "scan_ends": "The tool passes what the scan shows, which ends beside the tool: what lies beyond is not known.",
}


def plan_hint(
    points: int,
    targets: int,
    add_mode: str,
    ghost: bool,
    locked: bool,
    completed: bool | None,
    reason: Reason | None,
    failed: bool,
) -> str:
    """reason: of the verdict, None while there is none. failed: the dry run."""
    if ghost:
        return "Is this the right place? Enter or ‘Add here’ adds it, Esc takes it back."
    if locked:
        return "The points are locked. Unlock them to add, move or delete."
    if add_mode == "target" and not (completed and targets):
        return "Click what is to be inspected, in the head or in a slice. Targets stay where you click."
    if points == 0:
        return "Click the place where the tool goes in: at the nostril, in the head or in a slice."
    if points == 1:
        return "Click the next place of the path, further in. Slices and the cut-away show the air."
    if failed:
        return "The tool was not driven along the path; the panel and the bar below say why."
    if completed is False:
        return "The tool does not get through. Move points where the path turns grey, or choose another tool or robot."
    if completed and reason in _PASSES:
        return _PASSES[reason]
    if completed and not targets:
        return "The tool passes clear of bone. Add a target to inspect, or go to Rehearse."
    if completed:
        return "The tool passes clear of bone along the whole path. Go to Rehearse."
    return "Drag a point to move it, or click to add one; the verdict follows."
