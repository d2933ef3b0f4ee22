"""The distal links of the driven snake: bent by camera commands or by their joints, and straightened again."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ...arrays import Array, IntArray
from ...pathway.limits.backtracking import largest_fraction
from ...pathway.limits.limits import Configuration, HardLimits
from ...pathway.packed import PackedPathway
from ...pathway.query.query import Deviations, Query
from ...robots.snake import SnakeModel
from ...snake.conform.conformance import ShapeSolution
from ...snake.control.tip_control import DistalContext, TipControl, outwards, stops
from .drive_state import Command, DriveSettings, Observer, Outcome
from .refusal import Refusal
from .trail import Trail

SAME = 1e-9  # share by which a step may be longer than it is allowed to be, by rounding


class DistalSteps:
    """What ``SnakeDrive`` does with its last links; the attributes are its own."""

    snake: SnakeModel
    distal: SnakeModel
    settings: DriveSettings
    control: TipControl
    q: Array
    _first: int
    _conformed: ShapeSolution
    _distal_limits: HardLimits
    _distal_query: Query
    _packed: PackedPathway
    _windows: IntArray
    _refused: Refusal | None
    _trail: Trail
    _settled: bool
    _by_joints: bool
    observer: Observer | None

    @property
    def straight(self) -> bool:
        """Whether the distal links lie as the conforming shape has them."""
        raise NotImplementedError

    def _bounds(self) -> Array:
        raise NotImplementedError

    def _keep(self, found: Deviations, first: int = 0) -> None:
        raise NotImplementedError

    def ready_to_look(self) -> None:
        """Let the control of the distal links get ready here, if it is not; a camera command does it by itself."""
        if self.observer is not None:
            self.observer.made_ready()
        self._get_ready()

    def _get_ready(self) -> None:
        if not self._settled:
            self.control.prepare(self.distal_context(), self.q[2 * self._first :].copy())
            self._settled = True

    def distal_context(self) -> DistalContext:
        """Where the distal links are now, for a control of them."""
        frames = self.snake.frames(self._conformed.q, self._conformed.base)
        window = np.ascontiguousarray(self._windows[self._first :])
        rest = np.array(self._conformed.q[2 * self._first :])
        bound = self._bounds()[self._first :]
        return DistalContext(self.distal, self._distal_query, frames[self._first], rest, self._packed, window, bound)

    def _bend(self, command: Command, dt: float, left: float) -> Outcome:
        """The distal links, by the camera command or back to the conforming shape, with ``left`` s of joint travel."""
        q, rest = self.q[2 * self._first :].copy(), self._conformed.q[2 * self._first :]
        most = self.settings.speed_max * left
        by_joints = self._by_joints or (command.bend is not None and not command.straighten)
        if not by_joints:
            self._get_ready()
        if command.straighten:
            return self._straighten(q, rest, most, by_joints)
        if command.bend is not None:
            return self._go(q, self.distal.clamp(rest + command.bend), most, True)
        if by_joints:
            return Outcome("held", "the tip is bent by its joints: straighten it before the camera is steered", "bent")
        target = self.control.wanted(q, command.camera * dt, most)
        if np.array_equal(target, q):
            return Outcome("held", self._no_bend(q), "bends")
        cut = self.control.speed_limited or float(np.abs(target - q).max()) > (1.0 + SAME) * most
        outcome = self._go(q, target, most, False)
        return self._fast() if cut and outcome.name == "moved" else outcome

    def _straighten(self, q: Array, rest: Array, most: float, by_joints: bool) -> Outcome:
        """Straight to the conforming shape; where that is refused, back by the bends that led here."""
        if not self._trail.back:
            self.control.lead((0.0, 0.0))
            outcome = self._go(q, rest, most, by_joints)
            self._trail.back = outcome.name == "held" and len(self._trail) > 0
            if not self._trail.back:
                return outcome
        bend, steering = self._trail.next(q - rest)
        self.control.lead(steering)
        outcome = self._go(q, self.distal.clamp(rest + bend), most, by_joints)
        self._trail.back = outcome.name != "held"
        return outcome

    def _go(self, q: Array, target: Array, most: float, by_joints: bool) -> Outcome:
        """The distal joints from q (2L',) towards others, none by more than ``most`` rad, as far as the limits let."""
        fastest = float(np.abs(target - q).max()) / most
        if fastest == 0.0:
            return Outcome("rest")
        within = min(1.0, 1.0 / fastest)
        context = self.distal_context()
        here = Configuration(context.base, q)

        def is_admissible(share: float) -> bool:
            end = Configuration(context.base, q + within * share * (target - q))
            verdict = self._distal_limits.certify(self._packed, context.window, here, end, context.bound)
            if verdict.taken:
                self.q = np.concatenate([self.q[: 2 * self._first], end.q])  # a copy: see SnakeDrive.copy
                self._keep(verdict.deviation, self._first)
            else:
                self._refused = Refusal(verdict, end, context.bound, self.distal, self._distal_query)
            return verdict.taken

        share = largest_fraction(is_admissible, self._part)
        if share > 0.0 and by_joints:
            self._by_joints, self.control.steering = not self.straight, (0.0, 0.0)
        elif share > 0.0:
            self.control.accept(within * share)
        return self._backtracked(share)

    def _part(self) -> float:
        """Of the motion that was refused last, the part that was certified, if parting it more often was the end."""
        refused = self._refused
        return refused.verdict.part if refused is not None and refused.verdict.exhausted else 1.0

    def _backtracked(self, share: float) -> Outcome:
        """Of a motion of which ``share`` was admissible, 0 where none was."""
        if share == 1.0:
            return Outcome("moved")
        return self._stopped("shrunk" if share > 0.0 else "held")

    def _stopped(self, name: Literal["shrunk", "held"]) -> Outcome:
        """By what the certificate refused last."""
        return self._refused.outcome(name) if self._refused is not None else Outcome(name)

    def _fast(self) -> Outcome:
        """A step that is cut by the joints' speed."""
        fastest = np.degrees(self.settings.speed_max)
        return Outcome("shrunk", f"the joints are as fast as they may be, {fastest:.3g}°/s", "speed")

    def _no_bend(self, q: Array) -> str:
        """No joint moves the camera as commanded: what is at its end."""
        here = ", ".join(stops(self.distal_context(), q, self._first))
        known = self.control.ends(self._first)
        ends = [words for words in (here, f"the bends known here end with {known}" if known else "") if words]
        return "no bend moves the camera farther in that direction" + (f": {'; '.join(ends)}" if ends else "")

    def _outwards(self, q: Array) -> Array:
        """(2,) where the camera goes in its plane as the distal links bend more, mm."""
        if self._settled and not self._by_joints:
            return self.control.outwards(q)
        return outwards(self.distal, q, self._conformed.q[2 * self._first :])
