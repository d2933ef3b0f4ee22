"""Certified motions of the whole robot from one conforming shape towards another; the operator's bend stays.

A shape changes only by ``moved_towards``. A refused motion leaves the pose unchanged.
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

TISSUE_RESERVE_MM = 0.5  # [mm] four times the motion of breathing by 8 mm in 4 s within 20 ms
RIM_SHARE = 1.25  # factor on the wall's speed at the last sample: how fast it may have become since
RIM_LEAST_MM_PER_S = 2.0  # where the tissue was at rest at the last sample, as at the end of a breath


def tissue_age_s(drive: DriveConstants, state: SnakeState) -> float:
    """Age of the pathway in use; 0 where nothing moves, and where each step samples the tissue itself."""
    return state.t - state.tissue.seen_t if drive.moves and drive.planner is None else 0.0


def limits_of(drive: DriveConstants, state: SnakeState, placed: Placed) -> Array:
    """(L,) mm, b_i of the links that are inside, less the possible motion of the wall since it was sampled."""
    if not drive.moves:
        return np.where(placed.measured, placed.bound, np.inf)
    if drive.planner is None:
        kept = np.maximum(placed.bound - reserve(state.tissue.rim, placed.windows, tissue_age_s(drive, state)), 0.0)
    else:
        kept = np.maximum(placed.bound - TISSUE_RESERVE_MM, 0.0)
    return np.where(placed.measured, kept, np.inf)


def enforced(state: SnakeState, limit: Array) -> Array:
    """(L,) mm, the limits that hold a motion: none where no motion is certified."""
    return limit if state.certified else np.full_like(limit, np.inf)


def limits_here(drive: DriveConstants, state: SnakeState) -> Array:
    """The same at the robot's pose."""
    return limits_of(drive, state, placed_here(state))


def placed_here(state: SnakeState) -> Placed:
    """Windows, measured links and bounds at the robot's pose."""
    pose = state.pose
    return Placed(pose.windows, pose.measured, pose.bound)


def reserve(rim: Array, windows: IntArray, age_s: float) -> Array:
    """(L,) mm, the largest motion of the wall in each link's window within a time in s, by its sampled speed."""
    fastest: Array = np.maximum.reduceat(rim, windows.ravel())[::2]
    return np.maximum(RIM_SHARE * fastest, RIM_LEAST_MM_PER_S) * age_s


def time_left(state: SnakeState, dt: float) -> float:
    """Time in s of this step of ``dt`` s for which the fastest joint can still move at full speed."""
    return max(dt - float(np.abs(state.pose.q - state.began).max()) / state.settings.speed_max, 0.0)


def speed_ratio(state: SnakeState, wanted: ShapeSolution, dt: float) -> float:
    """Speed of the fastest joint towards a shape, as a fraction of the permitted speed."""
    return float(np.abs(wanted.q - state.pose.shape.q).max()) / (state.settings.speed_max * dt)


def in_order(joint_s: Array) -> bool:
    """Whether the joints are in order along the curve: other shapes have no windows."""
    return bool((joint_s[1:] >= joint_s[:-1]).all() and np.isfinite(joint_s).all())


def moved_towards(
    drive: DriveConstants, state: SnakeState, wanted: ShapeSolution, dt: float
) -> tuple[SnakeState, bool]:
    """Moved to another conforming shape as far as certificate and joint speeds permit; else refused."""
    pose = state.pose
    ratio = speed_ratio(state, wanted, dt)
    if ratio > 1.0:
        wanted = blended(pose.shape, wanted, 1.0 / ratio)
    if not in_order(wanted.joint_s):
        return state._replace(refused=None), False
    placed = drive.placed(state.bounds, wanted.joint_s)
    limit = enforced(state, limits_of(drive, state, placed))
    start, end = Configuration.of(pose.shape.base, pose.q), Configuration.of(wanted.base, _bent(drive, state, wanted))
    # A link that enters, or gets another window and thereby a smaller bound, has to be within its bound.
    known = known_within(pose.deviation.depth, pose.bound, placed.bound)
    links = LinksAt(state.tissue.packed, placed.windows, start, limit, known)
    verdict = drive.limits.certify(links, end)
    parted = verdict.taken or verdict.exhausted  # one that was only bisected too often is within its bounds
    if drive.planner is not None and not parted and np.isfinite(verdict.deviation.depth).all():
        wanted, end = _eased(drive, state, wanted, end, dt, placed.windows, limit)
        verdict = drive.limits.certify(links, end)
    if not verdict.taken:
        return state._replace(refused=Refusal(verdict, end, limit, drive.snake, drive.query)), False
    depth = drive.kept(verdict.deviation, placed.measured)
    return state._replace(pose=Pose(wanted, np.array(end.q), *placed, depth)), True


def retreated(drive: DriveConstants, state: SnakeState, dt: float) -> SnakeState:
    """Back within bounds that links exceed because the tissue moved, as fast as the joints permit."""
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
    """The nearest shape within the bounds, if there is one."""
    context = DistalContext(drive.snake, drive.query, end.base, end.q, state.tissue.packed, windows, limit)
    q = drive.eased(context, state.pose.q, state.settings.speed_max * dt)
    if q is None:
        return wanted, end
    return replace(wanted, q=drive.snake.clamp(wanted.q + (q - end.q)), exact=False), Configuration.of(end.base, q)


def refused_part(state: SnakeState) -> float:
    """The certified part of the motion refused last, if the limit of bisections was the reason."""
    refused = state.refused
    return refused.verdict.part if refused is not None and refused.verdict.exhausted else 1.0


def backtracked(state: SnakeState, share: float) -> Outcome:
    """Outcome of a motion of which the fraction ``share`` was admissible, 0 where none was."""
    if share == 1.0:
        return MOVED
    name: Literal["shrunk", "held"] = "shrunk" if share > 0.0 else "held"
    return state.refused.outcome(name) if state.refused is not None else Outcome(name)


def too_fast(state: SnakeState) -> Outcome:
    """Outcome of a step scaled down to the joints' speed."""
    fastest = np.degrees(state.settings.speed_max)
    return Outcome("shrunk", f"the joints are as fast as they may be, {fastest:.3g}°/s", "speed")
