"""The hint line of the Rehearse tab: what to do next, in one sentence."""

from __future__ import annotations

_NOT_THERE = {
    "absent": "Press Start: the robot is placed at the entry.",
    "failed": "Not begun; the panel says why. Then press Start.",
    "starting": "The robot is being placed at the entry.",
    "silent": "The control process does not answer. End it, then Start.",
}


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
    certified: bool = True,
) -> str:
    """free: no client holds the handle. changed: the plan differs from the driven one. targets: of the driven one.

    blocked: why the robot is not driven with the registration by which it was placed, '' where it is.
    certified: False of a tool in a free hand. mode, phase: of the newest snapshot. doubtful: the verdict of the path is
    not that it fits.
    """
    if points < 2:
        return "The path needs two points. Go to Plan."
    if not certified and (words := _freehand_hint(state, mine, free)):
        return words
    if state in _NOT_THERE:
        return _NOT_THERE[state]
    if free:
        return "Nobody holds the handle. Press ‘Take handle’ to drive."
    if not mine:
        return "You are watching; another window drives. Pause stops the robot."
    if changed and blocked:
        return blocked
    if changed:
        return "The plan has changed. ‘Reset to entry’ takes it as it is now."
    if state == "paused":
        return "Paused. Press Continue, or ‘Reset to entry’."
    if state != "running" and doubtful:
        return "You can still start; the tool stops before bone, not before skin."
    if state != "running":
        return "At the entry. Press Start, then drag the sphere or hold ↑."
    return _task_hint(mode, phase, targets)


def _task_hint(mode: str, phase: str, targets: int) -> str:
    """The hint of a robot that this window drives."""
    if mode == "inspect" and phase == "inspect_hold":
        return "Drag the sphere to swing about the target. A, D twist."
    if mode == "inspect":
        return "Hold ↑: the view point goes onto the target first."
    if mode == "free":
        return "Drag the sphere; A, D twist. The margin to bone is kept."
    if phase == "approach":
        return "Hold ↑: the tip goes straight to the path."
    if phase == "done" and targets:
        return "At the end of the path. Choose Inspect to see a target."
    return "Hold ↑ or W forwards, ↓ or S back, or drag the sphere."


def _freehand_hint(state: str, mine: bool, free: bool) -> str:
    """The hint of a tool in a free hand; '' where it is that of any drive."""
    if state == "starting":
        return "The tool is being put at the entry, in your hand."
    if state == "absent":
        return "Press Start: the tool is put at the entry, in your hand."
    if free:
        return ""
    if not mine:
        return "You watch a free hand. Pause stops the tool." if state in ("ready", "running", "paused") else ""
    if state == "ready":
        return "At the entry. Press Start. Nothing will keep the tool off bone."
    if state == "running":
        return "Drag the sphere to move the tool, with Shift to turn it."
    return ""
