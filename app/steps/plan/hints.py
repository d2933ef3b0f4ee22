"""The hint line of the Plan step: what to do next, in one sentence."""

from __future__ import annotations


def plan_hint(
    points: int,
    targets: int,
    add_mode: str,
    ghost: bool,
    locked: bool,
    completed: bool | None,
    doubtful: bool,
    failed: bool,
) -> str:
    """doubtful: the tool comes nearer to the bone surface than the scan knows where bone is. failed: the dry run."""
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
        return "The tool was not driven along the path; the bar below says why."
    if completed is False:
        return "The tool does not get through. Move points where the path turns grey, or choose another tool or robot."
    if completed and doubtful:
        return "The tool passes, but nearer to bone than the scan can tell. Move points, or go on with care."
    if completed and not targets:
        return "The tool passes clear of bone. Add a target to inspect, or go to Rehearse."
    if completed:
        return "The tool passes clear of bone along the whole path. Go to Rehearse."
    return "Drag a point to move it, or click to add one; the verdict follows."
