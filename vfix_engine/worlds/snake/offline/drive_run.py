"""A drive under way: it carries out what an operator does and notes what that comes to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ....arrays import Array
from ....runtime.operator import Act
from ..stepping.distal import needs_bends
from .between_vertices import BetweenVertices
from .drive_report import DeviationTally, Visit
from .look_round import Order, Retry
from .snake_drive import SnakeDrive
from .wall_depth import UNMEASURED, WallDepth

STALLED = 3000  # steps in a row that move no joint and bring the tip nowhere: nobody waits any longer
_REMEDY = "a larger bound, a thinner robot or other waypoints may get past"


class DriveRun:
    """The driven snake with the visits, retries and sums of its run.

    Args:
        drive: at its start. visits: landmarks in the order of their places, changed as they are reached.
        behind: measures how deep links are behind the wall; None: nobody asks.
        say: called with what happens, in words.
        between: measures how much deeper links are between their vertices; None: nobody asks.
    """

    def __init__(
        self,
        drive: SnakeDrive,
        visits: list[Visit],
        behind: WallDepth | None,
        say: Callable[[str], None],
        between: BetweenVertices | None = None,
    ) -> None:
        self.drive, self.visits = drive, visits
        self.tally = DeviationTally(drive.snake.q_max, drive.state.bounds.most)
        self.retries: list[Retry] = []
        self._behind, self._between, self._say = behind, between, say
        self._offsets: list[Array] = []
        self._still = 0  # steps in a row

    @property
    def offset_mm(self) -> tuple[float, float]:
        """Median and largest distance of a joint centre from the curve, over all steps."""
        offset = np.concatenate(self._offsets) if self._offsets else np.zeros(1)
        return float(np.median(offset)), float(offset.max())

    @property
    def behind_wall(self) -> dict[str, Any]:
        """Of the places of links measured against the surface the one deepest behind it, and of each link."""
        return UNMEASURED if self._behind is None else self._behind.to_dict()

    @property
    def stalled(self) -> str | None:
        """In words, that the drive gets nowhere any more, and why; None while it does."""
        if self._still < STALLED:
            return None
        why = self.drive.state.held_by or "nothing that is known holds it"
        return f"{self._still:,} steps in a row moved nothing: {why}"

    def go_on(self) -> None:
        """Something else is tried from here: steps that moved nothing so far no longer count."""
        self._still = 0

    def carry_out(self, act: Act) -> Visit | None:
        """One step of the drive; the landmark that the event of its order is about, if there is an event."""
        before, tip_s = self.drive.q.copy(), self.drive.tip_s
        order: Order = act.note
        self.drive.act(act)
        moved = self.drive.tip_s != tip_s or not np.array_equal(self.drive.q, before)
        self._still = 0 if moved or order.event is not None else self._still + 1
        self.tally.add(before, self.drive.state, order.dt, self.drive.step_s, self.drive.query_s)
        self._offsets.append(self.drive.offset_mm)
        for measured in (self._behind, self._between):
            if measured is not None:
                measured.look(self.drive, order.event is not None)
        if order.retry is not None:
            self.retries.append(order.retry)
            self._say(f"{order.retry.words}; {order.retry.outcome}")
        visit = None if order.stop is None else self._noted(order, order.stop.name)
        if visit is None or order.event is None:
            return None
        self._say(f"{order.event} {visit.name}, {self.drive.tip_s:.0f} mm in")
        return visit

    def finish(self, target: float) -> str | None:
        """Note landmarks that were not reached; in words, what ended the drive before ``target`` mm."""
        stopped = self.stalled or why_it_ended(self.drive, target, self.retries)
        for visit in self.visits:
            if not visit.reached and not visit.note:
                reason = f", {stopped}" if stopped else ""
                visit.note = f"not reached: the tip ended at {self.drive.tip_s:.0f} mm{reason}"
        if self._behind is not None:
            self._behind.look(self.drive, True)  # where it ends it may be deepest
        self._say(self.behind_wall["words"])
        return stopped

    def _noted(self, order: Order, name: str) -> Visit:
        """What an order about a landmark came to."""
        drive, state = self.drive, self.drive.state
        visit = next(one for one in self.visits if one.name == name)
        visit.reached = True
        visit.looked = visit.looked or order.event == "looked"
        if order.event == "arrived" and not drive.can_look:
            visit.note = "too near the entrance to look round: the links that bend are not inside yet"
        elif order.event == "gave up":
            visit.note = f"the look-round was not finished: {order.reason}"
        if order.looked is not None:
            visit.looked_from_mm, visit.sides = order.looked.s_mm, order.looked.sides
        if state.mode == "looking":
            visit.steps += 1
            rest, view = drive.snake.camera(state.q_nominal, state.base), drive.snake.camera(state.q, state.base)
            x, y, _ = rest[:3, :3].T @ view[:3, 2]
            steered = needs_bends(drive.state)
            visit.turned(state.steering if steered else None, (float(x), float(y)))
            visit.deviation_max_mm = max(visit.deviation_max_mm, float(state.deviation.depth.max()))
            visit.force_max_n = max(visit.force_max_n, float(np.linalg.norm(state.forces.total)))
        return visit


def why_it_ended(drive: SnakeDrive, target: float, retries: Sequence[Retry]) -> str | None:
    """What ended the drive before its target, in words; None where it is there."""
    if drive.lost or drive.tip_s >= target - 1e-6:
        return drive.lost
    if retries and not retries[-1].passed:  # the robot has drawn back since it was held
        last = retries[-1]
        failed = sum(one.at_mm == last.at_mm for one in retries)
        came = f", the last one {last.outcome}" if last.beyond_mm > 0.0 else ""
        return f"{last.words}; {failed} more attempts failed there{came}; {_REMEDY}"
    return drive.state.held_by or "steps that hardly move it"
