"""The distal links of the driven snake: bent by camera commands or by their joints, and straightened again."""

from __future__ import annotations

import numpy as np

from ....arrays import Array
from ....pathway.limits.backtracking import largest_fraction
from ....pathway.limits.limits import Configuration, LinksAt
from ....runtime.camera_hand import own_part
from ....snake.bending.visual_motor_kernel import camera_moved
from ....snake.control.parameterised import ParameterisedControl
from ....snake.control.tip_control import DistalContext, outwards, stops
from .command import SnakeCommand
from .constants import DriveConstants
from .manual import at_range, hand_moved, hand_target
from .motion import backtracked, enforced, limits_here, refused_part, too_fast
from .outcome import REST, Outcome
from .refusal import Refusal
from .state import SnakeState
from .trail import Trail

SAME = 1e-9  # fraction by which rounding may make a step longer than permitted


def distal_context(drive: DriveConstants, state: SnakeState) -> DistalContext:
    """The present position of the distal links, for their control."""
    shape, first = state.pose.shape, drive.first
    window = np.ascontiguousarray(state.pose.windows[first:])
    rest, bound = np.array(shape.q[2 * first :]), limits_here(drive, state)[first:]
    if not needs_bends(state):  # control bends are within the bounds in every arm (17)
        bound = enforced(state, bound)
    base = drive.snake.frame_before(first, shape.q, shape.base)
    return DistalContext(drive.distal, drive.distal_query, base, rest, state.tissue.packed, window, bound)


def bend_of(drive: DriveConstants, state: SnakeState) -> Array:
    """(2L',) rad by which the distal joints differ from the conforming shape."""
    bend: Array = state.pose.q[2 * drive.first :] - state.pose.shape.q[2 * drive.first :]
    return bend


def can_look(drive: DriveConstants, state: SnakeState) -> bool:
    """Whether all the links that the camera command moves are inside."""
    return bool(state.pose.measured[drive.first :].all())


def needs_bends(state: SnakeState) -> bool:
    """Whether the control uses precomputed bends."""
    return isinstance(state.control, ParameterisedControl)


def is_bent(drive: DriveConstants, state: SnakeState) -> bool:
    """Whether the distal links are bent so far, or by their joints, that control bends cannot be found anew."""
    distal, pose = 2 * drive.first, state.pose
    r = state.control.bent(pose.q[distal:], pose.shape.q[distal:])
    return state.by_joints or r > state.settings.reoptimise_below


def ready_to_look(drive: DriveConstants, state: SnakeState) -> SnakeState:
    """With the control of the distal links ready here; bends that are planned elsewhere are adopted, not computed."""
    if state.carried and not is_bent(drive, state):
        state = state._replace(settled=False, carried=False)
    if state.settled or (drive.planner is None and needs_bends(state)):
        return state
    control = state.control.copy()
    control.prepare(distal_context(drive, state), state.pose.q[2 * drive.first :].copy())
    return state._replace(control=control, settled=True)


def bend(
    drive: DriveConstants, state: SnakeState, command: SnakeCommand, dt: float, left: float
) -> tuple[SnakeState, Outcome]:
    """Move the distal links by the camera command or back to the conforming shape, with ``left`` s of joint travel."""
    q, rest = state.pose.q[2 * drive.first :].copy(), state.pose.shape.q[2 * drive.first :]
    most = state.settings.speed_max * left
    manual = state.settings.arm == "manual" and command.bend is None and not command.straighten
    steered = command.bend is None and not command.straighten and not state.by_joints and not manual
    if steered and drive.planner is None and not state.settled and needs_bends(state):
        return state, Outcome("held", "the bends of the tip are being found", "planning")
    by_joints = state.by_joints or manual or (command.bend is not None and not command.straighten)
    if not by_joints:
        state = ready_to_look(drive, state)
    state = state._replace(control=state.control.copy())  # the one that this step changes
    if command.straighten:
        return _straighten(drive, state, q, rest, most, by_joints)
    if command.bend is not None:
        return _go(drive, state, q, drive.distal.clamp(rest + command.bend), most, True)
    if manual:
        target = hand_target(drive.distal, q, command.camera * dt, state.hand_joint)
        if np.array_equal(target, q):
            return state, Outcome("held", at_range(drive.snake, state.hand_joint), "range")
        fastest = float(np.abs(target - q).max()) > (1.0 + SAME) * most
        state, outcome = _go(drive, state, q, target, most, True)
        state = _counted(state, hand_moved(drive.distal, q, state.pose.q[2 * drive.first :], state.hand_joint))
        return state, too_fast(state) if fastest and outcome.name == "moved" else outcome
    if by_joints:
        words = "the tip is bent by its joints: straighten it before the camera is steered"
        return state, Outcome("held", words, "bent")
    control, pulled = state.control, _pulled(state, command.camera) * dt
    target = control.wanted(q, pulled, most)
    if np.array_equal(target, q):
        return state, Outcome("held", _no_bend(drive, state, q), "bends")
    cut = control.speed_limited or float(np.abs(target - q).max()) > (1.0 + SAME) * most
    state, outcome = _go(drive, state, q, target, most, False)
    state = _counted(state, _camera_moved(drive, state, q, pulled, pulled - command.camera * dt))
    if outcome.name == "moved" and control.blocked:
        return state, Outcome("shrunk", _no_bend(drive, state, state.pose.q[2 * drive.first :]), "bends")
    return state, too_fast(state) if cut and outcome.name == "moved" else outcome


def _pulled(state: SnakeState, camera: Array) -> Array:
    """(2,) mm/s, velocity of the camera that the hand commands; a guided hand yields to the guidance (35)."""
    if state.settings.arm != "guided":
        return camera
    pulled: Array = camera + state.settings.yield_mm_per_s_per_n * state.forces.guidance
    return pulled


def _camera_moved(
    drive: DriveConstants, state: SnakeState, q: Array, pulled: Array, yielded: Array
) -> tuple[float, float]:
    """(right, down) mm by which the camera went as commanded from q (2L',), without what the hand yielded, (2,) mm."""
    snake = drive.distal
    right, down = camera_moved(q, state.pose.q[2 * drive.first :], snake.length_mm, snake.camera_offset_mm).tolist()
    whole, other = (float(pulled[0]), float(pulled[1])), (float(yielded[0]), float(yielded[1]))
    return own_part((right, down), whole, other) if any(other) else (right, down)


def _counted(state: SnakeState, moved: tuple[float, float]) -> SnakeState:
    """With so much more of the camera commands carried out."""
    right, down = state.obeyed_mm
    return state._replace(obeyed_mm=(right + moved[0], down + moved[1]))


def _straighten(
    drive: DriveConstants, state: SnakeState, q: Array, rest: Array, most: float, by_joints: bool
) -> tuple[SnakeState, Outcome]:
    """Directly to the conforming shape; where that is refused, back along the bends that led here."""
    if not state.trail.back:
        state.control.lead((0.0, 0.0))
        state, outcome = _go(drive, state, q, rest, most, by_joints)
        back = outcome.name == "held" and len(state.trail.bends) > 0
        state = state._replace(trail=state.trail._replace(back=back))
        if not back:
            return state, outcome
    trail = state.trail.before(q, lambda bend: drive.distal.clamp(rest + bend))
    bend, steering = trail.bends[-1] if trail.bends else (np.zeros_like(rest), (0.0, 0.0))
    state.control.lead(steering)
    state, outcome = _go(drive, state, q, drive.distal.clamp(rest + bend), most, by_joints)
    return state._replace(trail=trail._replace(back=outcome.name != "held")), outcome


def _go(
    drive: DriveConstants, state: SnakeState, q: Array, target: Array, most: float, by_joints: bool
) -> tuple[SnakeState, Outcome]:
    """The distal joints from q (2L',) towards others, none by more than ``most`` rad, as far as the limits permit."""
    fastest = float(np.abs(target - q).max()) / most
    if fastest == 0.0:
        return state, REST
    within = min(1.0, 1.0 / fastest)
    context = distal_context(drive, state)
    bound = enforced(state, context.bound)
    links = LinksAt(context.packed, context.window, Configuration.of(context.base, q), bound)

    def attempt(now: SnakeState, share: float) -> tuple[SnakeState, bool]:
        end = Configuration.of(context.base, q + within * share * (target - q))
        verdict = drive.distal_limits.certify(links, end)
        if not verdict.taken:
            return now._replace(refused=Refusal(verdict, end, bound, drive.distal, drive.distal_query)), False
        pose = now.pose
        depth = drive.kept(verdict.deviation, pose.measured, pose.deviation)
        joints = np.concatenate([pose.q[: 2 * drive.first], end.q])
        return now._replace(pose=pose._replace(q=joints, deviation=depth)), True

    state, share = largest_fraction(attempt, state, refused_part)
    if share > 0.0 and by_joints:
        state.control.steering = (0.0, 0.0)
        state = state._replace(by_joints=not state.straight)
    elif share > 0.0:
        state.control.accept(within * share)
    return state, backtracked(state, share)


def _no_bend(drive: DriveConstants, state: SnakeState, q: Array) -> str:
    """The reason why no joint moves the camera as commanded."""
    if not state.certified:  # bounds hold nothing
        end = f": the bends end at r = {state.settings.r_max:g}" if needs_bends(state) else ""
        return f"no bend moves the camera farther in that direction{end}"
    here = ", ".join(stops(distal_context(drive, state), q, drive.first))
    known = state.control.ends(drive.first)
    ends = [words for words in (here, f"the bends known here end with {known}" if known else "") if words]
    return "no bend moves the camera farther in that direction" + (f": {'; '.join(ends)}" if ends else "")


def camera_outwards(drive: DriveConstants, state: SnakeState, q: Array) -> Array:
    """(2,) direction of the camera in its plane as the distal links at q (2L',) bend further, mm."""
    if state.settled and not state.by_joints:
        return state.control.outwards(q)
    return outwards(drive.distal, q, state.pose.shape.q[2 * drive.first :])


def trail_after(drive: DriveConstants, state: SnakeState, command: SnakeCommand) -> Trail:
    """The trail of bends after a step."""
    if state.straight:
        return Trail()
    if command.bends and not command.straighten:
        return state.trail.noted(bend_of(drive, state), state.control.steering)
    return state.trail
