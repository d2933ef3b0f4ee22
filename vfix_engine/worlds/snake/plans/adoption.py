"""Requests of a driven snake to a planner in another process, and the adoption of its plans."""

from __future__ import annotations

import math

import numpy as np

from ....arrays import Array
from ....errors import ControlError
from ....pathway.limits.limits import beyond_text
from ....pathway.packed import PackedPathway, pack
from ....snake.conform.conformance import ShapeSolution
from ....snake.conform.conforming import blended
from ....snake.control.parameterised import ParameterisedControl
from ....snake.control.tip_control import DistalContext
from ..settings import DriveSettings
from ..stepping.constants import DriveConstants
from ..stepping.distal import bend_of, can_look, distal_context, needs_bends
from ..stepping.insertion import SAME_MM, end_of_way
from ..stepping.motion import reserve, tissue_age_s
from ..stepping.state import Ahead, ShapeSample, SnakeState
from ..stepping.tissue import TISSUE_SHARE
from .messages import BendsWanted, LookWanted, PlanInputs, PlannedShape, PlannerAnswer, ShapeAtTime

BENDS_MM = 1e-6  # [mm] of insertion since bends were requested: beyond it they belong to another position


def wanted(drive: DriveConstants, state: SnakeState, view: LookWanted | None = None) -> PlanInputs | None:
    """The request to a planner, or None; ``view``: from where a look-round continues."""
    age_s, settings = tissue_age_s(drive, state), state.settings
    look = state.t if drive.moves and age_s >= settings.tissue_s - 1e-9 else None
    sign, near, ahead = state.toward, state.pose.shape, state.ahead
    bends = _bends_wanted(drive, state) if view is None else None
    if look is not None:
        near = state.tissue.goal or near
    elif ahead.left(sign):
        near = ahead.end
    known = look is None and (ahead.left(sign) > 1 or end_of_way(drive, state, near.tip_s, sign))
    if drive.fixed_base or known:
        sign = 0
    if look is None and not sign and bends is None and view is None:
        return None
    most = TISSUE_SHARE * settings.speed_max * settings.tissue_s
    kept = np.zeros(drive.snake.links)
    if drive.moves:  # estimated time until the plan after this one is adopted
        kept = reserve(state.tissue.rim, state.pose.windows, age_s + settings.tissue_s)
    # Where no bound holds a motion the hand's bend may be far beyond it: shapes that keep it within are then sought in
    # vain, for so long that the robot waits for them.
    bend = state.pose.q - state.pose.shape.q if state.certified else np.zeros(drive.snake.dof)
    return PlanInputs(
        look, PlannedShape.of(near), near.tip_s, most, sign, ahead.spacing_mm, bend, state.bounds, kept, bends, view
    )


def _bends_wanted(drive: DriveConstants, state: SnakeState) -> BendsWanted | None:
    """Where control bends are missing and may soon be needed: all links inside, and no insertion in progress."""
    if state.settled or state.by_joints or state.inserting or not (needs_bends(state) and can_look(drive, state)):
        return None
    return bends_place(drive, state)


def bends_place(drive: DriveConstants, state: SnakeState) -> BendsWanted:
    """The position of the distal links, as an input of a planner."""
    place = distal_context(drive, state)
    return BendsWanted(state.tissue.seen_t, place.base, place.rest, place.window, place.bound, state.tip_s)


def adopted(drive: DriveConstants, state: SnakeState, plan: PlannerAnswer, age_s: float) -> SnakeState:
    """The state with a plan that was requested ``age_s`` s ago; its outdated parts are ignored."""
    if plan.seen is not None or plan.lost is not None:
        state = state._replace(tissue=state.tissue._replace(lost=plan.lost))
    if plan.seen is not None:
        state = _adopted_look(drive, state, plan, plan.seen, age_s)
    elif plan.ahead:
        state = state._replace(ahead=_extended(state, plan))
    if plan.bends and plan.wanted is not None:
        state = _adopted_bends(drive, state, plan, plan.wanted)
    return state


def _adopted_look(
    drive: DriveConstants, state: SnakeState, plan: PlannerAnswer, seen: ShapeAtTime, age_s: float
) -> SnakeState:
    was = state.tissue
    if seen.t <= was.seen_t:
        return state
    tip_s = min(state.tip_s, seen.length_mm)
    found = _from_here([seen.goal.on(was.curve), *(shape.on(was.curve) for shape in plan.ahead)], tip_s)
    goal, ahead = was.goal, state.ahead
    if found:
        goal = found[0]
        ahead = Ahead(ahead.spacing_mm, goal, goal, plan.sign, _samples(found[1:]))
    tissue = was._replace(
        packed=_packed(plan, seen), length_mm=seen.length_mm,
        rim=np.append(seen.rim_mm_per_s, 0.0), seen_t=seen.t, due=state.t + max(state.settings.tissue_s, age_s),
        goal=goal,
    )  # fmt: skip
    return drive.measured(state._replace(tissue=tissue, tip_s=tip_s, ahead=ahead))


def _packed(plan: PlannerAnswer, seen: ShapeAtTime) -> PackedPathway:
    """The pathway seen; packed here where the planner's own was not kept, as in a recorded run: the same bit by bit."""
    if plan.packed is None:
        return pack(seen.centre, seen.tangent, seen.first, seen.radius)
    for array in plan.packed:
        array.setflags(write=False)  # lost on the way from another process
    return plan.packed


def _extended(state: SnakeState, plan: PlannerAnswer) -> Ahead:
    """With planned shapes that begin at the last known one or, if none is left, at the robot's shape."""
    ahead, here = state.ahead, state.pose.shape
    new = _samples([shape.on(state.tissue.curve) for shape in plan.ahead])
    if ahead.left(plan.sign):
        return ahead._replace(samples=ahead.samples + new) if plan.near.same(ahead.end) else ahead
    return Ahead(ahead.spacing_mm, here, here, plan.sign, new) if plan.near.same(here) else ahead


def _adopted_bends(drive: DriveConstants, state: SnakeState, plan: PlannerAnswer, wanted: BendsWanted) -> SnakeState:
    if state.settled or abs(wanted.tip_s - state.tip_s) > BENDS_MM:
        return state
    control = state.control.copy()
    if not isinstance(control, ParameterisedControl):
        return state
    here = distal_context(drive, state)
    then = DistalContext(
        drive.distal, drive.distal_query, wanted.base, wanted.rest, state.tissue.packed, here.window, wanted.bound
    )
    control.take(plan.bends, then)
    control.move_to(here)
    return state._replace(control=control, settled=True)


def _samples(shapes: list[ShapeSolution]) -> tuple[ShapeSample, ...]:
    return tuple(ShapeSample(shape.tip_s, shape) for shape in shapes)


def _from_here(shapes: list[ShapeSolution], tip_s: float) -> list[ShapeSolution]:
    """Planned shapes in order, the first at the tip's present position; none if the tip is at none of them."""
    if math.isclose(shapes[0].tip_s, tip_s, rel_tol=0.0, abs_tol=SAME_MM):
        return shapes
    for k in range(len(shapes) - 1):
        apart = shapes[k + 1].tip_s - shapes[k].tip_s
        share = (tip_s - shapes[k].tip_s) / apart
        if 0.0 <= share < 1.0:
            return [blended(shapes[k], shapes[k + 1], share), *shapes[k + 1 :]]
    return []


def with_settings(drive: DriveConstants, state: SnakeState, settings: DriveSettings) -> SnakeState:
    """Other speeds and bounds at the same pose.

    Raises:
        ControlError: a link would be beyond its new bound.
    """
    bounds, pose = settings.bounds(drive.snake.links), state.pose
    bound = bounds.at(drive.inscribed, pose.windows)
    over = np.where(pose.measured, pose.deviation.depth - bound, -np.inf)
    link = int(over.argmax())
    if state.certified and over[link] > 0.0:
        deep = beyond_text(float(pose.deviation.depth[link]), float(bound[link]))
        raise ControlError(
            f"link {link + 1} is {deep} mm outside of the pathway, more than the bound of {bound[link]:g} mm: "
            "straighten or draw back first"
        )
    return state._replace(settings=settings, bounds=bounds, pose=pose._replace(bound=bound))


def refused_link(drive: DriveConstants, state: SnakeState) -> int | None:
    """The link whose bound caused the last refusal of the certificate; None where there is none."""
    refused = state.refused
    return None if refused is None else refused.link + (drive.snake.links - refused.snake.links)


def bent_to(drive: DriveConstants, state: SnakeState, goal: Array) -> float:
    """Largest difference of a distal joint from a bend (2L',), rad."""
    return float(np.abs(bend_of(drive, state) - goal).max())
