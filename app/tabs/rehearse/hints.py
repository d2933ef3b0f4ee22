"""The hint line of the Rehearse tab: what to do next, in one sentence."""

from __future__ import annotations


def rehearse_hint(
    points: int,
    state: str,
    mine: bool,
    free: bool,
    mode: str,
    phase: str,
    targets: int,
    changed: bool,
    doubtful: bool = False,
    blocked: str = "",
) -> str:
    """free: no client holds the handle. changed: the plan differs from the driven one. targets: of the driven one.

    blocked: why the robot is not driven with the registration by which it was placed, '' where it is.
    mode, phase: of the newest snapshot. doubtful: the verdict of the path is not that it fits.
    """
    if points < 2:
        return "A rehearsal needs a path of two points at least. Go back to Plan."
    if state == "absent":
        return "Press Start: the robot is placed at the entry."
    if state == "failed":
        return "The rehearsal was not begun; the panel says why. Change what stops it, then press Start."
    if state == "starting":
        return "The robot is being placed at the entry."
    if state == "silent":
        return "The control process does not answer. End it in the panel, then start again."
    if free:
        return "Nobody holds the handle. Take it over in the panel to drive."
    if not mine:
        return "You are watching. Another window holds the handle; Pause stops the robot all the same."
    if changed and blocked:
        return blocked
    if changed:
        return "The plan has changed. Reset to entry takes it as it is now; until then the path before is driven."
    if state == "paused":
        return "Paused. Press Continue to go on from here, or Reset to entry."
    if state != "running" and doubtful:
        return "You can still start; the tool stops before bone, not before skin."
    if state != "running":
        return "The robot stands at the entry. Press Start, then drag the blue sphere on the shaft or hold ↑."
    if mode == "inspect" and phase == "inspect_hold":
        return "Drag the sphere sideways: the tool swings about the target it looks at. A and D twist it."
    if mode == "inspect":
        return "Drag the blue sphere, or hold ↑ or W: the view point is brought onto the target first."
    if mode == "free":
        return "Drag the blue sphere on the shaft; A and D twist the tool. The margin to the bone surface is kept."
    if phase == "done" and targets:
        return "The end of the path is reached. Choose Inspect to look at a target."
    return (
        "Hold ↑ or W to drive forwards, ↓ or S back (in a list W and S), or drag the blue sphere. "
        "The margin to the bone surface is kept."
    )
