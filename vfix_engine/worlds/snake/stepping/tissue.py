"""The driven snake follows the tissue: the present pathway, and the shape that conforms to it."""

from __future__ import annotations

import numpy as np

from ....pathway.limits.backtracking import largest_fraction
from ....snake.conform.conforming import blended
from .constants import DriveConstants
from .distal import distal_context
from .motion import (
    backtracked,
    limits_here,
    moved_towards,
    refused_part,
    retreated,
    speed_ratio,
    time_left,
    tissue_age_s,
)
from .outcome import REST, Outcome
from .state import SnakeState

TISSUE_SHARE = 0.5  # largest fraction of the joints' speed for following the tissue; the rest is the hand's
LEAST_LEFT = 0.01  # of a step: with less joint travel left no further motion is tried
OLDEST_S = 0.06  # [s] an older pathway permits no motion


def lost(drive: DriveConstants, state: SnakeState) -> str | None:
    """The reason why there is no pathway that permits motion; None while there is."""
    age_s = tissue_age_s(drive, state)
    if state.tissue.lost is None and age_s > OLDEST_S + 1e-9:
        return "waiting for the tissue"  # seen longer ago than permits a motion
    return state.tissue.lost


def follow_tissue(drive: DriveConstants, state: SnakeState, dt: float) -> tuple[SnakeState, Outcome]:
    """Update the pathway, and move, as fast as the joints permit, to the shape that conforms to it."""
    state = _seen(drive, state, dt)
    if (words := lost(drive, state)) is not None:
        return state, Outcome("held", words, "tissue")
    was, outcome = state.pose.shape, REST
    if state.following:
        state, outcome = _to_goal(drive, state, dt)
    left = time_left(state, dt)
    if state.certified and left >= LEAST_LEFT * dt and _beyond(drive, state):
        state = retreated(drive, state, left)
    if state.settled and (outcome.name != "rest" or state.pose.shape is not was):
        control = state.control.copy()
        control.move_to(distal_context(drive, state))
        state = state._replace(control=control)
    return state, outcome


def _seen(drive: DriveConstants, state: SnakeState, dt: float) -> SnakeState:
    """After sampling the tissue, if that is due and this drive samples it itself."""
    planner, tissue = drive.planner, state.tissue
    if planner is None or state.t < tissue.due:
        return state
    found = planner.look(state.t)
    if isinstance(found, str):  # the first words, not new ones each step
        return state._replace(tissue=tissue._replace(lost=tissue.lost or found))
    packed, curve = found
    tip_s = min(state.tip_s, curve.length)
    most = TISSUE_SHARE * state.settings.speed_max * max(planner.every_s, dt)
    goal = planner.following(curve, tip_s, state.pose.shape, most)
    tissue = tissue._replace(
        packed=packed, curve=curve, length_mm=curve.length, lost=None, due=state.t + planner.every_s, goal=goal
    )
    return drive.measured(state._replace(tissue=tissue, tip_s=tip_s, ahead=state.ahead.restarted(goal)))


def _to_goal(drive: DriveConstants, state: SnakeState, dt: float) -> tuple[SnakeState, Outcome]:
    """Move towards the tissue's goal, at a speed that reaches it when the tissue is sampled again."""
    goal = state.tissue.goal
    if goal is None:
        return state, REST
    due = min(dt / max(state.tissue.due - state.t + dt, dt), 1.0)  # fraction of the way until the next sample
    whole = due == 1.0 and speed_ratio(state, goal, dt) <= 1.0
    state, share = largest_fraction(
        lambda now, share: moved_towards(drive, now, blended(now.pose.shape, goal, share * due), dt),
        state,
        refused_part,
    )
    if share == 0.0 or (whole and share == 1.0):
        state = state._replace(tissue=state.tissue._replace(goal=None))
    if share == 0.0:  # no goal until the tissue has moved again
        state = state.restarted()
    return state, backtracked(state, share)


def _beyond(drive: DriveConstants, state: SnakeState) -> bool:
    """Whether a link has to retreat at once, at any cost.

    Where plans are made elsewhere, a link that only uses up its reserve waits for the next plan.
    """
    pose = state.pose
    limit = np.where(pose.measured, pose.bound, np.inf) if drive.planner is None else limits_here(drive, state)
    return bool((pose.deviation.depth > limit).any())
