"""The driven snake is inserted along its curve, from one conforming shape to the next."""

from __future__ import annotations

from ....pathway.limits.backtracking import largest_fraction
from ....snake.conform.conforming import blended
from ....snake.conform.moved_off import moved_off
from .constants import DriveConstants, Placed
from .distal import distal_context, is_bent, needs_bends
from .fixed_base import HELD
from .inline_planner import InlinePlanner
from .link_windows import link_windows, planning_margin
from .motion import backtracked, in_order, limits_of, moved_towards, refused_part, speed_ratio, too_fast
from .outcome import MOVED, Outcome
from .state import Ahead, ShapeSample, SnakeState

SAME = 1e-9  # fraction by which rounding may make a step longer than permitted
SAME_MM = 1e-9  # [mm] of insertion that counts as none: a shape this near is the robot's own


def end_of_way(drive: DriveConstants, state: SnakeState, tip_s: float, sign: float) -> str | None:
    """The reason why no motion is possible from there in that direction; None where it is."""
    if sign <= 0.0:
        return "the robot is out" if tip_s <= 0.0 else None
    if tip_s >= state.tissue.length_mm:
        return "the end of the path"
    if tip_s < drive.longest_mm:
        return None
    return f"all {drive.snake.links} links are inside: the robot is at its full length"


def farthest_mm(drive: DriveConstants, state: SnakeState) -> float:
    """Arc length in mm to which the tip can be inserted: the end of the path, or where no link is left."""
    return min(state.tissue.length_mm, drive.longest_mm)


def insert(drive: DriveConstants, state: SnakeState, wanted_mm: float, dt: float) -> tuple[SnakeState, Outcome]:
    """Forwards or backwards along the curve."""
    if drive.fixed_base:
        return state, Outcome("held", HELD, "end")
    sign = 1.0 if wanted_mm > 0.0 else -1.0
    if drive.planner is None:
        state, held = _known(drive, state, sign)
        held = held or _bent(drive, state)
    else:
        held = _bent(drive, state)
        if held is None:
            state, held = _planned(drive, drive.planner, state, sign)
    if held is not None:
        return state, held
    ahead_s, ahead = state.ahead.samples[0]
    remaining, most = ahead_s - state.tip_s, state.settings.insertion_step_mm
    ratio = speed_ratio(state, ahead, dt)
    part = min(abs(wanted_mm), most) / abs(remaining)
    within = min(1.0, part, 1.0 / ratio if ratio > 0.0 else 1.0)
    if within > 1.0 - SAME:  # the sum of the steps is rounded: no step is made for the remainder
        within = 1.0
    done = MOVED
    if within < min(1.0, part):
        done = too_fast(state)
    elif abs(wanted_mm) > (1.0 + SAME) * min(most, abs(remaining)) and 0.0 < ahead_s < farthest_mm(drive, state):
        done = Outcome("shrunk", f"a step goes {most:g} mm at most, and to the next planned shape", "step")

    def attempt(now: SnakeState, share: float) -> tuple[SnakeState, bool]:
        part = share * within
        if now.tip_s + part * remaining == now.tip_s:  # joints would move and the tip would not
            return now, False
        return moved_towards(drive, now, blended(now.pose.shape, ahead, part), dt)

    state, share = largest_fraction(attempt, state, refused_part)
    if share == 0.0:
        return state, backtracked(state, share)
    tissue = state.tissue
    if tissue.goal is not None:  # the tissue's goal advances with the robot
        tissue = tissue._replace(goal=blended(tissue.goal, ahead, share * within))
    passed = state.ahead.passed() if share * within >= 1.0 else state.ahead
    state = _carried(drive, state._replace(tip_s=state.pose.shape.tip_s, tissue=tissue, ahead=passed))
    return state, done if share == 1.0 else backtracked(state, share)


def _carried(drive: DriveConstants, state: SnakeState) -> SnakeState:
    """After an insertion: control bends are found anew, or taken along while the tip is bent on their surface."""
    if not (state.settled and needs_bends(state) and not state.by_joints and is_bent(drive, state)):
        return state._replace(settled=False)
    control = state.control.copy()
    control.move_to(distal_context(drive, state))
    return state._replace(control=control, carried=True)


def _bent(drive: DriveConstants, state: SnakeState) -> Outcome | None:
    """Held, where the tip is bent and its bend does not go along."""
    if not state.settings.lock_bend and is_bent(drive, state):
        return Outcome("held", "the tip is bent: straighten it before it is inserted or drawn back", "bent")
    return None


def _known(drive: DriveConstants, state: SnakeState, sign: float) -> tuple[SnakeState, Outcome | None]:
    """With the next adopted shape as the first one ahead, or held."""
    end = end_of_way(drive, state, state.tip_s, sign)
    if end is not None:
        return state, Outcome("held", end, "end")
    ahead = state.ahead
    while ahead.left(sign) and (ahead.samples[0].place_mm - state.tip_s) * sign <= SAME_MM:
        ahead = ahead.passed()
    held = None if ahead.left(sign) else Outcome("held", "the shapes ahead are being planned", "planning")
    return state._replace(ahead=ahead), held


def _planned(
    drive: DriveConstants, planner: InlinePlanner, state: SnakeState, sign: float
) -> tuple[SnakeState, Outcome | None]:
    """With the next shape as the first one ahead, planned now unless it is known, or held."""
    ahead, tip_s = state.ahead, state.tip_s
    if ahead.samples and (ahead.samples[0].place_mm - tip_s) * sign > 0.0:
        return state, None
    end = end_of_way(drive, state, tip_s, sign)
    if end is not None:
        return state, Outcome("held", end, "end")
    place = tip_s + sign * ahead.spacing_mm
    place = min(place, farthest_mm(drive, state)) if sign > 0.0 else max(place, 0.0)
    shape = planner.inserted(state.tissue.curve, place, ahead.last, ahead.planned)
    if not in_order(shape.joint_s):
        return state.restarted(), Outcome("held", "no shape conforms to the path there", "end")
    # A link gets a smaller bound as it reaches a narrower position; the shapes that lead there are planned for it.
    windows, measured, _ = drive.placed(state.bounds, shape.joint_s)
    around = link_windows(drive.pathway, shape.joint_s, drive.first, planning_margin(ahead.spacing_mm))
    limit = limits_of(drive, state, Placed(windows, measured, state.bounds.at(drive.inscribed, around)))
    bend = state.pose.q - state.pose.shape.q if state.settings.lock_bend else None
    shape = moved_off(shape, drive.snake, drive.query, state.tissue.packed, windows, limit, bend) or shape
    sample = ShapeSample(place, shape)
    return state._replace(ahead=Ahead(ahead.spacing_mm, ahead.last, shape, int(sign), (sample,))), None
