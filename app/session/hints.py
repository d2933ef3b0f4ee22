"""The hint line: what to do next, in one sentence."""

from __future__ import annotations


def patient_hint(case_open: bool, loading: bool) -> str:
    if loading:
        return "The head is being prepared."
    if not case_open:
        return "Choose a head, or import a CT volume or a bone surface."
    return "Turn the head with the left mouse button, zoom with the wheel. Then go to Plan."


def plan_hint(
    points: int, targets: int, add_mode: str, ghost: bool, locked: bool, completed: bool | None, doubtful: bool
) -> str:
    """doubtful: the tool comes nearer to the bone surface than the scan knows where bone is."""
    if ghost:
        return "Is this the right place? Enter or ‘Add here’ adds it, Esc takes it back."
    if locked:
        return "The points are locked. Unlock them to add, move or delete."
    if add_mode == "target":
        return "Click what is to be inspected, in the head or in a slice. Targets stay where you click."
    if points == 0:
        return "Click the place where the tool goes in: at the nostril, in the head or in a slice."
    if points == 1:
        return "Click the next place of the path, further in. Slices and the cut-away show the air."
    if completed is False:
        return "The tool does not get through yet. Move or add points where the path turns orange."
    if completed and doubtful:
        return "The tool passes, but nearer to bone than the scan can tell. Move points, or go on with care."
    if completed and not targets:
        return "The tool passes clear of bone. Add a target to inspect, or go to Rehearse."
    if completed:
        return "The tool passes clear of bone along the whole path. Go to Rehearse."
    return "Add points until the path leads where you need to look; drag a point to move it."


def rehearse_hint(
    points: int, state: str, mine: bool, free: bool, mode: str, done: bool, targets: int, changed: bool
) -> str:
    """free: nobody holds the handle. changed: the plan is not what is driven any more. targets: of what is driven."""
    if points < 2:
        return "A rehearsal needs a path of two points at least. Go back to Plan."
    if state == "absent":
        return "Press Start: the robot is placed at the entry."
    if state == "failed":
        return "The robot could not be placed; the panel says why. Change the path, or try again with Start."
    if state == "starting":
        return "The robot is being placed at the entry."
    if state == "silent":
        return "The control process does not answer. End it in the panel, then start again."
    if free:
        return "Nobody holds the handle. Take it over in the panel to drive."
    if not mine:
        return "You are watching. Another window holds the handle; Pause stops the robot all the same."
    if changed:
        return "The plan has changed. Reset to entry takes it as it is now; until then the path before is driven."
    if state == "paused":
        return "Paused. Press Continue to go on from here, or Reset to entry."
    if state != "running":
        return "The robot stands at the entry. Press Start, then drag the blue sphere on the shaft or hold ↑."
    if mode == "inspect":
        return "Drag the sphere sideways: the tool swings about the target it looks at."
    if done and targets:
        return "The end of the path is reached. Choose Inspect to look at a target."
    return "Drag the blue sphere on the shaft, or hold ↑ and ↓. The margin to the bone surface is kept."
