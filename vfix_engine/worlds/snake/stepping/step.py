"""One step of the driven snake: a desired motion and a verdict.

The conforming shape, the control of the distal links or the operator determine a goal, and the hard limits of
``limits.py`` decide whether, and how far, the robot moves there. Without a command nothing moves, except that the
robot's shape follows a moving pathway.
"""

from __future__ import annotations

from .command import SnakeCommand
from .constants import DriveConstants
from .distal import bend, camera_outwards, trail_after
from .insertion import insert
from .motion import time_left
from .outcome import REST, Outcome, both
from .state import SnakeState
from .tissue import LEAST_LEFT, follow_tissue, lost


def step(drive: DriveConstants, state: SnakeState, command: SnakeCommand, dt: float) -> SnakeState:
    """The state after ``dt`` s; every motion is certified, whatever its source."""
    refused = state.refused_commands
    if not command.finite:
        command, refused = command.cleaned, refused + 1
    began, speed = state.pose.q, command.insert_mm_per_s
    state = state._replace(
        t=state.t + dt, steps=state.steps + 1, began=began, refused_commands=refused, inserting=speed != 0.0,
        toward=state.toward if speed == 0.0 else 1 if speed > 0.0 else -1,
    )  # fmt: skip
    outcome = REST
    if drive.moves:
        state, outcome = follow_tissue(drive, state, dt)
    if (speed != 0.0 or command.bends) and not (state.certified and lost(drive, state)):
        state, done = _obeyed(drive, state, command, dt)
        outcome = both(outcome, done)
    distal = slice(2 * drive.first, None)
    before, after = began[distal], state.pose.q[distal]
    depth = state.pose.deviation.depth[drive.first :]
    felt = drive.hand.step(state.felt, before, after, dt, depth, camera_outwards(drive, state, after))
    return state._replace(
        mode="looking" if command.bends and speed == 0.0 else "inserting", result=outcome, felt=felt,
        trail=trail_after(drive, state, command),
    )  # fmt: skip


def _obeyed(drive: DriveConstants, state: SnakeState, command: SnakeCommand, dt: float) -> tuple[SnakeState, Outcome]:
    """The operator's command, with the joint speed that following the tissue has left."""
    left = time_left(state, dt)
    if left < LEAST_LEFT * dt:
        return state, Outcome("held", "the joints are as fast as they may be, following the tissue", "speed")
    if command.insert_mm_per_s == 0.0:
        return bend(drive, state, command, dt, left)
    state, outcome = insert(drive, state, command.insert_mm_per_s * dt, left)
    if outcome.name == "moved" and command.bends:
        return state, Outcome("shrunk", "insertion comes first: the tip was not bent", "insertion")
    return state, outcome
