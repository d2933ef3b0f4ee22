"""What the tool makes of a path while a hand drags a point of it: judged in the background, the newest place next."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

from app.kit.errors import JobCancelled
from app.planning.placement import StoredPlacing
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.previews import Dragged
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.services import Services
from app.tabs.plan.dry_runs import FAILED, Corridor, answered, failed_run
from app.tabs.plan.latest import LatestQueue

MOVED_WORTH_SAYING_MM = 0.2  # by a release, whose hand is less exact than a click
_LANE = "live"


class LivePreviews:
    """Judges the place where a hand is; nothing is stored.

    While a hand moves without a pause, each run ends and its answer is shown greyed, of the place where the hand was,
    and the newest place is judged next; all other places are left out. A run ends early once another point is dragged.
    Owned by the session's thread, but for the runs themselves.
    """

    def __init__(self, services: Services, executor: Executor, done: Callable[[int, Corridor], None]) -> None:
        """done: gets the ticket and the answer on another thread; hand both to :meth:`accept` on the owner's."""
        self._services, self._lanes, self._done = services, LatestQueue(executor), done
        self._ticket = self._first = 0  # the newest run and the first one of this drag
        self._asked: tuple[Any, ...] | None = None
        self.current = Corridor()

    def clear(self) -> None:
        """No hand drags anything; a run that goes on ends."""
        if self._asked is not None:
            self._first = self._ticket = self._ticket + 1
            self._asked, self.current = None, Corridor()

    def ask(
        self, plan: Any, dragged: Dragged, stored: Corridor, placing: StoredPlacing | None, options: RehearsalOptions
    ) -> None:
        """Judge a plan with a point under a hand, unless that is what was asked for last.

        stored: the answer to the stored path, which is shown greyed at first. placing: of the robot along the stored
        path or the one before, None where it had no place yet.
        """
        asked = (plan.id, plan.revision, dragged, options)
        if asked == self._asked:
            return
        before = self.current.pictured or stored.pictured
        self._ticket += 1
        if not self._is_same_drag(asked):
            self._first = self._ticket
        self._asked = asked
        ticket, kept_mm = self._ticket, stored.margin_mm
        if placing is None:
            words = "Let go of the point to see whether the tool fits: the robot has no place yet."
            self.current = Corridor("computing", words, margin_mm=kept_mm, provisional=True, before=before)
            return
        words = "The path as it would be is judged …"
        self.current = Corridor("computing", words, margin_mm=kept_mm, provisional=True, before=before)

        def go_on(stage: str = "", share: float = 0.0) -> None:
            if ticket < self._first:
                raise JobCancelled

        def work() -> None:
            if ticket >= self._first and (answer := self._answer(plan, dragged, kept_mm, placing, go_on, options)):
                self._done(ticket, answer)

        self._lanes.submit(_LANE, FAILED, work, lambda words: self._done(ticket, failed_run(words, kept_mm, True)))

    def accept(self, ticket: int, corridor: Corridor) -> None:
        """Show an answer: as what is so where the hand is, or greyed where the hand has moved on since."""
        if ticket == self._ticket:
            self.current = corridor
        elif ticket >= self._first and self.current.status == "computing" and corridor.evaluation is not None:
            self.current = replace(self.current, before=corridor.evaluation)

    def _is_same_drag(self, asked: tuple[Any, ...]) -> bool:
        """Whether the hand holds the same point of the same path as before, in another place."""
        if self._asked is None:
            return False
        (*path, dragged, options), (*path_before, dragged_before, options_before) = asked, self._asked
        return (path, dragged.point_id, options) == (path_before, dragged_before.point_id, options_before)

    def _answer(
        self,
        plan: Any,
        dragged: Dragged,
        kept_mm: float,
        placing: StoredPlacing,
        go_on: Callable[[str, float], None],
        options: RehearsalOptions = NO_OPTIONS,
    ) -> Corridor | None:
        """None where the hand has let go or holds another point."""
        moved = 0.0

        def evaluate() -> PlanEvaluation:
            nonlocal moved
            found = self._services.previews.of(plan, dragged, placing, go_on, options)
            moved = found.moved_mm
            return found.evaluation

        try:
            corridor = answered(self._services, plan, kept_mm, evaluate)
        except JobCancelled:
            return None
        words = f" On release the point moves {moved:.1f} mm, clear of bone." if moved > MOVED_WORTH_SAYING_MM else ""
        return replace(corridor, provisional=True, words=corridor.words + words, remark=words.strip())
