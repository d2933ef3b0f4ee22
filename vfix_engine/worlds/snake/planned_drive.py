"""A driven snake whose long computations are made elsewhere: it asks for plans and goes by those it has adopted."""

from __future__ import annotations

import math
from copy import copy

import numpy as np

from ...arrays import Array
from ...errors import ControlError
from ...geometry.curve import Curve
from ...pathway.limits.limits import beyond_text
from ...pathway.packed import pack
from ...pathway.pathway import Pathway
from ...robots.snake import SnakeModel
from ...snake.conform.conformance import ShapeSolution
from ...snake.conform.conforming import blended
from ...snake.control.parameterised import ParameterisedControl
from ...snake.control.tip_control import DistalContext
from .drive_state import Command, DriveSettings, DriveState, Outcome
from .planning import BendsWanted, LookWanted, PlanInputs, PlannedShape, PlannerAnswer, ShapeAtTime
from .shape_steps import TISSUE_SHARE
from .snake_drive import SnakeDrive

OLDEST_S = 0.06  # [s] a pathway that was seen longer ago moves nothing any more
RIM_SHARE = 1.25  # of the wall's speed at the last look: how fast it may have become since
RIM_LEAST_MM_PER_S = 2.0  # where the tissue was at rest at the last look, as at the end of a breath
SAME_MM = 1e-9  # [mm] of insertion that is none: a shape that near is where the robot is
BENDS_MM = 1e-6  # [mm] of insertion since bends were asked for: with more they are for another place


class AdoptedLook:
    """In the place of ``LivePathway``: the tissue is looked at elsewhere.

    lost: in words, why there is no pathway; due: time in s at which the next one is expected.
    """

    def __init__(self) -> None:
        self.lost: str | None = None
        self.due = 0.0

    def share(self, t: float, dt: float) -> float:
        """Of what is to be done until the next look, how much is to be done in the ``dt`` s that end at the time t."""
        return min(dt / max(self.due - t + dt, dt), 1.0)


class PlannedShapes:
    """In the place of ``Waypoints``: shapes ahead are planned elsewhere.

    curve: what they conform to, as it was at the start; length_mm: of what it has become.
    """

    def __init__(self, first: ShapeSolution, curve: Curve, spacing_mm: float) -> None:
        self.curve, self.length_mm, self.spacing_mm = curve, curve.length, spacing_mm
        self._last, self._sign, self._ahead = first, 0, tuple[ShapeSolution, ...]()

    @property
    def end(self) -> ShapeSolution:
        """The last shape that is known."""
        return self._ahead[-1] if self._ahead else self._last

    def left(self, sign: float) -> int:
        """How many shapes are known in that direction."""
        return len(self._ahead) if self._sign == sign else 0

    def at_end(self, tip_s: float, sign: float) -> str | None:
        """In words, why there is nowhere to go in that direction; None where there is."""
        if sign > 0.0:
            return "the end of the path" if tip_s >= self.length_mm else None
        return "the robot is out" if tip_s <= 0.0 else None

    def next(self) -> ShapeSolution:
        """The next shape, where ``left`` says that there is one."""
        return self._ahead[0]

    def extend(self, near: PlannedShape, sign: int, ahead: tuple[PlannedShape, ...], here: ShapeSolution) -> None:
        """Take planned shapes that begin at the last one known, or, where none is left, where the robot is."""
        new = tuple(shape.on(self.curve) for shape in ahead)
        if self.left(sign):
            self._ahead += new if near.same(self.end) else ()
        elif near.same(here):
            self._last, self._sign, self._ahead = here, sign, new

    def passed(self) -> None:
        """The next shape has been taken."""
        self._last, self._ahead = self._ahead[0], self._ahead[1:]

    def restart(self, shape: ShapeSolution, sign: int = 0, ahead: tuple[ShapeSolution, ...] = ()) -> None:
        """Go on from another shape."""
        self._last, self._sign, self._ahead = shape, sign, ahead

    def copy(self) -> PlannedShapes:
        """One that goes on by itself."""
        return copy(self)


class PlannedDrive(SnakeDrive):
    """``SnakeDrive`` without anything that is longer than a tick; the arguments are its own.

    Where a plan is missing, a step holds and says so ('planning'); where the pathway that it has was seen too long
    ago, nothing moves ('tissue').
    """

    projects_within_step = False
    times_queries = False

    def __init__(
        self,
        snake: SnakeModel,
        pathway: Pathway,
        settings: DriveSettings,
        curve: Curve | None = None,
        slack: Array | None = None,
        tip_s: float = 0.0,
        *,
        beyond_allowed: bool = False,
        longer_allowed: bool = False,
    ) -> None:
        self.seen_t, self.following = 0.0, True
        self._rim = np.zeros(len(pathway.packed(0.0).rows) + 1)
        self._inserting, self._toward = False, 1  # by the last command; the direction of the last insertion
        super().__init__(
            snake, pathway, settings, curve, slack, tip_s, beyond_allowed=beyond_allowed, longer_allowed=longer_allowed
        )
        self._live: AdoptedLook = AdoptedLook()  # type: ignore[assignment]
        self._waypoints: PlannedShapes = PlannedShapes(
            self._conformed, self._waypoints.curve, self.settings.waypoint_mm
        )  # type: ignore[assignment]

    @property
    def moves(self) -> bool:
        """Whether the tissue does."""
        return self.pathway.motion is not None

    @property
    def length_mm(self) -> float:
        """Of the curve that the robot conforms to, as it was seen last."""
        return self._waypoints.length_mm

    @property
    def tissue_age_s(self) -> float:
        """Since the pathway in use was seen; 0 where nothing moves."""
        return self.t - self.seen_t if self.moves else 0.0

    @property
    def lost(self) -> str | None:
        """In words, why there is no pathway that anything may move by."""
        if self._live.lost is None and self.tissue_age_s > OLDEST_S + 1e-9:
            return f"the tissue was seen {1e3 * self.tissue_age_s:.0f} ms ago; {1e3 * OLDEST_S:.0f} ms is the most"
        return self._live.lost

    @property
    def wants_plan(self) -> bool:
        """Whether something is missing that a planner is to compute."""
        return self.wanted() is not None

    @property
    def refused(self) -> tuple[int, str] | None:
        """The link that the certificate refused last to go beyond its bound, and its name; None where there is none."""
        if self._refused is None:
            return None
        link = self._refused.link + (self.snake.links - self._refused.snake.links)
        return link, f"link {link + 1}"

    def set_settings(self, settings: DriveSettings) -> None:
        """Other speeds and bounds at the same pose.

        Raises:
            ControlError: a link would be beyond its new bound.
        """
        bounds = settings.bounds(self.snake.links)
        bound = bounds.at(self._inscribed, self._windows)
        over = np.where(self._measured, self._deviation.depth - bound, -np.inf)
        link = int(over.argmax())
        if over[link] > 0.0:
            deep = beyond_text(float(self._deviation.depth[link]), float(bound[link]))
            raise ControlError(
                f"link {link + 1} is {deep} mm outside of the pathway, more than the bound of {bound[link]:g} mm: "
                "straighten or draw back first"
            )
        self.settings, self.bounds, self.bound = settings, bounds, bound

    # What a step may do

    def step(self, command: Command, dt: float | None = None) -> DriveState:
        """As ``SnakeDrive.step``; what the hand wants now says what is to be planned next."""
        speed = command.insert_mm_per_s
        self._inserting = speed != 0.0
        if self._inserting:
            self._toward = 1 if speed > 0.0 else -1
        return super().step(command, dt)

    def _insert(self, wanted_mm: float, dt: float) -> Outcome:
        sign = 1.0 if wanted_mm > 0.0 else -1.0
        end = self._waypoints.at_end(self.tip_s, sign)
        if end is not None:
            return Outcome("held", end, "end")
        while self._waypoints.left(sign) and (self._waypoints.next().tip_s - self.tip_s) * sign <= SAME_MM:
            self._waypoints.passed()
        if not self._waypoints.left(sign):
            return Outcome("held", "the shapes ahead are being planned", "planning")
        return super()._insert(wanted_mm, dt)

    def _waypoint(self, sign: float) -> tuple[float, ShapeSolution]:
        shape = self._waypoints.next()
        return shape.tip_s, shape

    def _bend(self, command: Command, dt: float, left: float) -> Outcome:
        steered = command.bend is None and not command.straighten and not self._by_joints
        if steered and not self._settled and self._needs_bends:
            return Outcome("held", "the bends of the tip are being found", "planning")
        return super()._bend(command, dt, left)

    def _get_ready(self) -> None:
        """Bends are adopted, not found here; a control that needs none gets ready at once."""
        if not self._needs_bends:
            super()._get_ready()

    @property
    def _needs_bends(self) -> bool:
        return isinstance(self.control, ParameterisedControl)

    def _see(self, dt: float) -> None:
        """Nothing: the tissue is seen by ``adopt``."""

    def _to_goal(self, dt: float) -> Outcome:
        return super()._to_goal(dt) if self.following else Outcome("rest")

    def _bounds(self) -> Array:
        """b_i of the links that are inside, less how far the wall may have come since it was seen."""
        if not self.moves:
            return np.where(self._measured, self.bound, np.inf)
        kept = np.maximum(self.bound - self._reserve(self.tissue_age_s), 0.0)
        return np.where(self._measured, kept, np.inf)

    def _reserve(self, age_s: float) -> Array:
        """(L,) mm that the wall in each link's window moves at most in so many s, by the speed that it was seen at."""
        fastest: Array = np.maximum.reduceat(self._rim, self._windows.ravel())[::2]
        return np.maximum(RIM_SHARE * fastest, RIM_LEAST_MM_PER_S) * age_s

    def _retreat_beyond(self) -> Array:
        """The bounds themselves: a link that only uses up its reserve waits for the next plan."""
        return np.where(self._measured, self.bound, np.inf)

    # What is asked of a planner, and what it answers

    def wanted(self, view: LookWanted | None = None) -> PlanInputs | None:
        """What a planner is to compute now, or None; ``view``: from where a look-round is to go on."""
        look = self.t if self.moves and self.tissue_age_s >= self.settings.tissue_s - 1e-9 else None
        sign, near = self._toward, self._conformed
        bends = self._bends_wanted() if view is None else None
        if look is not None:
            near = self._goal or self._conformed
        elif self._waypoints.left(sign):
            near = self._waypoints.end
        if look is None and (self._waypoints.left(sign) > 1 or self._waypoints.at_end(near.tip_s, sign)):
            sign = 0
        if look is None and not sign and bends is None and view is None:
            return None
        most = TISSUE_SHARE * self.settings.speed_max * self.settings.tissue_s
        reserve = np.zeros(self.snake.links)
        if self.moves:  # until the plan after this one is adopted, as it seems
            reserve = self._reserve(self.tissue_age_s + self.settings.tissue_s)
        bend = self.q - self._conformed.q
        return PlanInputs(
            look,
            PlannedShape.of(near),
            near.tip_s,
            most,
            sign,
            self._waypoints.spacing_mm,
            bend,
            self.bounds,
            reserve,
            bends,
            view,
        )

    def _bends_wanted(self) -> BendsWanted | None:
        """Where control bends are missing and may soon be needed: all links inside, and no insertion going on."""
        if self._settled or self._by_joints or self._inserting or not (self._needs_bends and self.can_look):
            return None
        return self.bends_place()

    def bends_place(self) -> BendsWanted:
        """Where the distal links are, as a planner asks for it."""
        place = self.distal_context()
        return BendsWanted(self.seen_t, place.base, place.rest, place.window, place.bound, self.tip_s)

    def adopt(self, plan: PlannerAnswer, age_s: float) -> None:
        """Go by a plan that was asked for ``age_s`` s ago; what of it no longer fits is left out."""
        if plan.seen is not None or plan.lost is not None:
            self._live.lost = plan.lost
        if plan.seen is not None:
            self._adopt_look(plan, plan.seen, age_s)
        elif plan.ahead:
            self._waypoints.extend(plan.near, plan.sign, plan.ahead, self._conformed)
        if plan.bends and plan.wanted is not None:
            self._adopt_bends(plan, plan.wanted)

    def _adopt_look(self, plan: PlannerAnswer, seen: ShapeAtTime, age_s: float) -> None:
        if seen.t <= self.seen_t:
            return
        self.seen_t, self._waypoints.length_mm = seen.t, seen.length_mm
        self._packed = pack(seen.centre, seen.tangent, seen.first, seen.radius)
        self._rim = np.append(seen.rim_mm_per_s, 0.0)
        self._live.due = self.t + max(self.settings.tissue_s, age_s)
        self.tip_s = min(self.tip_s, seen.length_mm)
        curve = self._waypoints.curve
        found = _from_here([seen.goal.on(curve), *(shape.on(curve) for shape in plan.ahead)], self.tip_s)
        if found:
            self._goal = found[0]
            self._waypoints.restart(self._goal, plan.sign, tuple(found[1:]))
        self._measure()

    def _adopt_bends(self, plan: PlannerAnswer, wanted: BendsWanted) -> None:
        if (
            self._settled
            or abs(wanted.tip_s - self.tip_s) > BENDS_MM
            or not isinstance(self.control, ParameterisedControl)
        ):
            return
        here = self.distal_context()
        then = DistalContext(
            self.distal, self._distal_query, wanted.base, wanted.rest, self._packed, here.window, wanted.bound
        )
        self.control.take(plan.bends, then)
        self.control.move_to(here)
        self._settled = True


def _from_here(shapes: list[ShapeSolution], tip_s: float) -> list[ShapeSolution]:
    """Planned shapes, one after the other, with the first where the tip is by now; none where it is at none of them."""
    if math.isclose(shapes[0].tip_s, tip_s, rel_tol=0.0, abs_tol=SAME_MM):
        return shapes
    for k in range(len(shapes) - 1):
        apart = shapes[k + 1].tip_s - shapes[k].tip_s
        share = (tip_s - shapes[k].tip_s) / apart
        if 0.0 <= share < 1.0:
            return [blended(shapes[k], shapes[k + 1], share), *shapes[k + 1 :]]
    return []
