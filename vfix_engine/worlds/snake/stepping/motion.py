"""Certified motions of the whole robot from one conforming shape towards another; the operator's bend stays.

The one way in which a shape changes: ``moved_towards``. What is refused leaves the pose as it is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from ....arrays import Array, IntArray
from ....pathway.limits.limits import Configuration, LinksAt
from ....pathway.limits.link_bounds import known_within
from ....snake.conform.conformance import ShapeSolution
from ....snake.conform.conforming import blended
from ....snake.control.tip_control import DistalContext
from .constants import DriveConstants, Placed
from .outcome import MOVED, Outcome
from .refusal import Refusal
from .state import Pose, SnakeState

TISSUE_RESERVE_MM = 0.5  # [mm] four times what breathing by 8 mm in 4 s moves in 20 ms
RIM_SHARE = 1.25  # of the wall's speed at the last look: how fast it may have become since
RIM_LEAST_MM_PER_S = 2.0  # where the tissue was at rest at the last look, as at the end of a breath


def tissue_age_s(drive: DriveConstants, state: SnakeState) -> float:
    """Since the pathway in use was seen; 0 where nothing moves, and where each step sees for itself."""
    return state.t - state.tissue.seen_t if drive.moves and drive.planner is None else 0.0


def limits_of(drive: DriveConstants, state: SnakeState, placed: Placed) -> Array:
    """(L,) mm, b_i of the links that are inside, less how far the wall may have come since it was seen."""
    if not drive.moves:
        return np.where(placed.measured, placed.bound, np.inf)
    if drive.planner is None:
        kept = np.maximum(placed.bound - reserve(state.tissue.rim, placed.windows, tissue_age_s(drive, state)), 0.0)
    else:
        kept = np.maximum(placed.bound - TISSUE_RESERVE_MM, 0.0)
    return np.where(placed.measured, kept, np.inf)


def limits_here(drive: DriveConstants, state: SnakeState) -> Array:
    """The same where the robot is."""
    return limits_of(drive, state, placed_here(state))


def placed_here(state: SnakeState) -> Placed:
    """What the robot is measured against where it is."""
    pose = state.pose
    return Placed(pose.windows, pose.measured, pose.bound)


def reserve(rim: Array, windows: IntArray, age_s: float) -> Array:
    """(L,) mm that the wall in each link's window moves at most in so many s, by the speed that it was seen at."""
    fastest: Array = np.maximum.reduceat(rim, windows.ravel())[::2]
    return np.maximum(RIM_SHARE * fastest, RIM_LEAST_MM_PER_S) * age_s


def time_left(state: SnakeState, dt: float) -> float:
    """Time of this step of ``dt`` s for which the fastest joint may still go at full speed, s."""
    return max(dt - float(np.abs(state.pose.q - state.began).max()) / state.settings.speed_max, 0.0)


def speed_ratio(state: SnakeState, wanted: ShapeSolution, dt: float) -> float:
    """Speed of the fastest joint towards a shape, of what joints may do; a bend at a joint's end is no help."""
    return float(np.abs(wanted.q - state.pose.shape.q).max()) / (state.settings.speed_max * dt)


def in_order(joint_s: Array) -> bool:
    """Whether joints lie one after the other along the curve: a shape in which they do not has no windows."""
    return bool((joint_s[1:] >= joint_s[:-1]).all() and np.isfinite(joint_s).all())


def moved_towards(
    drive: DriveConstants, state: SnakeState, wanted: ShapeSolution, dt: float
) -> tuple[SnakeState, bool]:
    """At another conforming shape, if the certificate lets it, as far as the joints' speed allows; else refused."""
    pose = state.pose
    ratio = speed_ratio(state, wanted, dt)
    if ratio > 1.0:
        wanted = blended(pose.shape, wanted, 1.0 / ratio)
    if not in_order(wanted.joint_s):
        return state._replace(refused=None), False
    placed = drive.placed(state.bounds, wanted.joint_s)
    limit = limits_of(drive, state, placed)
    start, end = Configuration.of(pose.shape.base, pose.q), Configuration.of(wanted.base, _bent(drive, state, wanted))
    # A link that comes to count, gets another window or with it a smaller bound, has to be within its bound.
    known = known_within(pose.deviation.depth, pose.bound, placed.bound)
    links = LinksAt(state.tissue.packed, placed.windows, start, limit, known)
    verdict = drive.limits.certify(links, end)
    parted = verdict.taken or verdict.exhausted  # what has only been parted too often is within its bounds already
    if drive.planner is not None and not parted and np.isfinite(verdict.deviation.depth).all():
        wanted, end = _eased(drive, state, wanted, end, dt, placed.windows, limit)
        verdict = drive.limits.certify(links, end)
    if not verdict.taken:
        return state._replace(refused=Refusal(verdict, end, limit, drive.snake, drive.query)), False
    depth = drive.kept(verdict.deviation, placed.measured)
    return state._replace(pose=Pose(wanted, np.array(end.q), *placed, depth)), True


def retreated(drive: DriveConstants, state: SnakeState, dt: float) -> SnakeState:
    """Back towards the bounds that the tissue's motion has left links beyond, as fast as joints may."""
    pose, limit = state.pose, limits_here(drive, state)
    here = Configuration.of(pose.shape.base, pose.q)
    wanted, end = _eased(drive, state, pose.shape, here, dt, pose.windows, limit)
    links = LinksAt(state.tissue.packed, pose.windows, here, limit, pose.deviation.depth)
    verdict = drive.limits.certify(links, end)
    if not verdict.taken:
        return state
    depth = drive.kept(verdict.deviation, pose.measured)
    return state._replace(pose=pose._replace(shape=wanted, q=np.array(end.q), deviation=depth))


def _bent(drive: DriveConstants, state: SnakeState, shape: ShapeSolution) -> Array:
    """Joints (2L,) of a conforming shape with the bend that the distal links have."""
    bend = state.pose.q - state.pose.shape.q
    bend[: 2 * drive.first] = 0.0
    return drive.snake.clamp(shape.q + bend)


def _eased(
    drive: DriveConstants,
    state: SnakeState,
    wanted: ShapeSolution,
    end: Configuration,
    dt: float,
    windows: IntArray,
    limit: Array,
) -> tuple[ShapeSolution, Configuration]:
    """The nearest shape that keeps the bounds, if there is one."""
    context = DistalContext(drive.snake, drive.query, end.base, end.q, state.tissue.packed, windows, limit)
    q = drive.eased(context, state.pose.q, state.settings.speed_max * dt)
    if q is None:
        return wanted, end
    return replace(wanted, q=drive.snake.clamp(wanted.q + (q - end.q)), exact=False), Configuration.of(end.base, q)


def refused_part(state: SnakeState) -> float:
    """Of the motion that was refused last, the part that was certified, if parting it more often was the end."""
    refused = state.refused
    return refused.verdict.part if refused is not None and refused.verdict.exhausted else 1.0


def backtracked(state: SnakeState, share: float) -> Outcome:
    """Of a motion of which ``share`` was admissible, 0 where none was."""
    if share == 1.0:
        return MOVED
    name: Literal["shrunk", "held"] = "shrunk" if share > 0.0 else "held"
    return state.refused.outcome(name) if state.refused is not None else Outcome(name)


def too_fast(state: SnakeState) -> Outcome:
    """A step that is cut by the joints' speed."""
    fastest = np.degrees(state.settings.speed_max)
    return Outcome("shrunk", f"the joints are as fast as they may be, {fastest:.3g}°/s", "speed")
