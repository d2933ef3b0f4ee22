"""What the tool makes of a path while a hand drags a point of it: judged in the background, the newest place next."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

from app.planning.placement import StoredPlacement
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.previews import Dragged
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.plans.model import Plan
from app.services import Services
from app.tabs.plan.dry_runs import FAILED, ShownEvaluation, answered, failed_run
from app.workspace.latest import Act, Latest

MOVED_WORTH_SAYING_MM = 0.2  # by a release, whose hand is less exact than a click


class LivePreviews:
    """Judges the place where a hand is; nothing is stored.

    While a hand moves without a pause, each run ends and its answer is shown greyed, of the place where the hand was,
    and the newest place is judged next; all other places are left out. A run ends early once another point is dragged.
    Owned by the session's thread, but for the runs themselves.
    """

    def __init__(self, services: Services, executor: Executor, post: Callable[[Act], Any]) -> None:
        """post: queues an act onto the owner's thread."""
        self._services, self._latest = services, Latest(executor, post)
        self._asked: tuple[Any, ...] | None = None
        self.current = ShownEvaluation()

    def clear(self) -> None:
        """No hand drags anything; a run that goes on ends."""
        if self._asked is not None:
            self._latest.drop()
            self._asked, self.current = None, ShownEvaluation()

    def ask(
        self,
        plan: Plan,
        dragged: Dragged,
        stored: ShownEvaluation,
        placement: StoredPlacement | None,
        options: RehearsalOptions,
    ) -> None:
        """Judge a plan with a point under a hand, unless that is what was asked for last.

        stored: the answer to the stored path, which is shown greyed at first. placement: of the robot along the stored
        path or the one before, None where it had no place yet.
        """
        asked = (plan.id, plan.revision, dragged, options)
        if asked == self._asked:
            return
        before = self.current.pictured or stored.pictured
        goes_on = self._is_same_drag(asked)
        self._asked = asked
        kept_mm = stored.margin_mm
        if placement is None:
            self._latest.drop()
            words = "Let go to check the fit."
            self.current = ShownEvaluation("computing", words, margin_mm=kept_mm, provisional=True, before=before)
            return
        words = "Checking …"
        self.current = ShownEvaluation("computing", words, margin_mm=kept_mm, provisional=True, before=before)
        self._latest.ask(
            FAILED,
            lambda run: self._answer(plan, dragged, kept_mm, placement, run.check, options),
            self._show,
            lambda words: self._show(failed_run(words, kept_mm, True)),
            older=self._show_greyed,
            goes_on=goes_on,
        )

    def _show(self, shown: ShownEvaluation) -> None:
        """What is so where the hand is."""
        self.current = shown

    def _show_greyed(self, shown: ShownEvaluation) -> None:
        """What was so where the hand was, while the newest place is judged."""
        if self.current.status == "computing" and shown.evaluation is not None:
            self.current = replace(self.current, before=shown)

    def _is_same_drag(self, asked: tuple[Any, ...]) -> bool:
        """Whether the hand holds the same point of the same path as before, in another place."""
        if self._asked is None:
            return False
        (*path, dragged, options), (*path_before, dragged_before, options_before) = asked, self._asked
        return (path, dragged.point_id, options) == (path_before, dragged_before.point_id, options_before)

    def _answer(
        self,
        plan: Plan,
        dragged: Dragged,
        kept_mm: float,
        placement: StoredPlacement,
        go_on: Callable[[str, float], None],
        options: RehearsalOptions = NO_OPTIONS,
    ) -> ShownEvaluation:
        moved = 0.0

        def evaluate() -> PlanEvaluation:
            nonlocal moved
            found = self._services.previews.of(plan, dragged, placement, go_on, options)
            moved = found.moved_mm
            return found.evaluation

        shown = answered(self._services, plan, kept_mm, evaluate)
        words = f" On release the point moves {moved:.1f} mm, clear of bone." if moved > MOVED_WORTH_SAYING_MM else ""
        return replace(shown, provisional=True, words=shown.words + words, remark=words.strip())
