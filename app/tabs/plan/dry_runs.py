"""What the tool makes of the path: the dry run of the controller, in the background, latest wins."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

from app.cases.settings import settings_in_case
from app.cases.structures import within_a_sentence
from app.kit.errors import JobCancelled
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.planning.verdict import WORDS, Level, Verdict, refused
from app.plans.model import Plan
from app.scene import palette
from app.services import Services
from app.tabs.plan.clearance import verdict_view
from app.tabs.plan.sections import (
    EvaluationSection,
    EvaluationState,
    EvaluationStatus,
    ScaleView,
    VerdictView,
)
from app.workspace.latest import Act, BackgroundTask, Latest
from vfix_engine.arrays import Array
from vfix_engine.errors import StartRefused, VfixError

FAILED = "The simulation failed"
_UNKNOWN, _BLOCKED = palette.hex_colour(palette.UNKNOWN), palette.hex_colour(palette.PIERCED)

STATE_WORDS: dict[EvaluationState, str] = {
    "none": "",
    "current": "",
    "waits": "Updating: earlier figures.",
    "drag": "While you drag: the robot’s base is kept.",
    "drag_waits": "While you drag: updating …",
}


@dataclass(frozen=True)
class ShownEvaluation:
    """The state of the dry run of one plan.

    status: 'none', 'computing', 'done' or 'failed'. refusal: the verdict of one that has failed since the tool does not
    fit at the entry; else the verdict is that of the evaluation.
    job: id of the one that computes it; '' before it has one.
    cancelled: it failed because somebody cancelled it. warning: what the margin does not cover; '' where it covers all.
    margin_mm: kept from bone, with what the case's surface may be off.
    provisional: of a path that is not stored, while a hand drags it, with the robot's base kept.
    before: the answer to an earlier place, which is shown greyed while this one is computed. remark: what a release
    would do besides.
    """

    status: EvaluationStatus = "none"
    words: str = ""
    completed: bool | None = None
    evaluation: PlanEvaluation | None = None
    margin_mm: float = 0.3
    warning: str = ""
    job: str = ""
    cancelled: bool = False
    provisional: bool = False
    before: ShownEvaluation | None = None
    remark: str = ""
    refusal: Verdict | None = None

    @property
    def verdict(self) -> Verdict | None:
        """The verdict on the path as it is shown; None while it is not known."""
        return self.refusal if self.evaluation is None else self.evaluation.verdict

    @property
    def level(self) -> Level | None:
        """The level of the verdict, 'unknown' where the dry run has failed; None while the path is judged."""
        if self.verdict is not None:
            return self.verdict.level
        return "unknown" if self.status == "failed" else None

    @property
    def word(self) -> str:
        """The word of the level, of the pictured answer while there is no other; '' without either."""
        pictured = self.pictured
        level = self.level or (None if pictured is None or pictured.evaluation is None else pictured.level)
        return "" if level is None else WORDS[level]

    @property
    def short(self) -> str:
        """The verdict in a few words, as the card has it behind '?'; '' while the path is judged."""
        if self.verdict is None:
            return f"{WORDS['unknown']}: {within_a_sentence(self.words).rstrip('.')}" if self.status == "failed" else ""
        return f"{self.verdict.short} (provisional)" if self.provisional else self.verdict.short

    @property
    def pictured(self) -> ShownEvaluation | None:
        """The answer, or while there is none the earlier one."""
        return self.before if self.evaluation is None else self

    @cached_property
    def picture(self) -> VerdictView | None:
        """The page's view of the answer, which stays the same when it is an earlier one."""
        return None if self.evaluation is None else verdict_view(self.evaluation)

    def samples(self) -> tuple[Array, Array] | None:
        """Places (n, 3) along the path and the bone clearance (n,) of the whole tool there, as an export has them."""
        return None if self.evaluation is None else (self.evaluation.positions, self.evaluation.clearance)

    def view(self) -> EvaluationSection:
        """The page's section."""
        scale: ScaleView | None = None
        if self.status in ("computing", "done"):
            scale = {
                "lo": palette.CLEARANCE_LOW_MM,
                "hi": palette.CLEARANCE_HIGH_MM,
                "margin": self.margin_mm,
                "colours": list(palette.SCALE_COLOURS),
                "unknown": _UNKNOWN if self.completed is False else None,
                "blocked": _BLOCKED,
            }
        return {
            "status": self.status,
            "words": self.words,
            "level": self.level,
            "word": self.word,
            "short": self.short,
            "completed": self.completed,
            "warning": self.warning,
            "scale": scale,
            "job": self.job or None,
            "cancelled": self.cancelled,
            "verdict": None if self.pictured is None else self.pictured.picture,
            "shown_mm": None,
            "state": self._state(),
            "state_words": f"{self._state_words()} {self.remark}".strip(),
        }

    def _state_words(self) -> str:
        found, state = self.evaluation, self._state()
        if found is None or state != "current":
            return STATE_WORDS[state]
        if found.completed:
            return "Simulated from entry to the end of the path."
        return f"Simulated from the entry to {found.reached_mm:.0f} of {found.length_mm:.0f} mm."

    def _state(self) -> EvaluationState:
        """What the shown verdict and plot are of."""
        if self.status == "computing":
            return "drag_waits" if self.provisional else "waits"
        if self.evaluation is None:
            return "drag" if self.provisional else "none"
        return "drag" if self.provisional else "current"


class DryRuns:
    """Runs the newest plan dry; an answer to an older plan is dropped."""

    def __init__(self, services: Services, executor: Executor, post: Callable[[Act], Any]) -> None:
        """post: queues an act onto the owner's thread."""
        self._services, self._latest = services, Latest(executor, post)
        self.current = ShownEvaluation()

    def clear(self) -> None:
        self._latest.drop()
        self.current = ShownEvaluation()

    def ask(
        self, plan: Plan, kept_mm: float, options: RehearsalOptions = NO_OPTIONS, before: ShownEvaluation | None = None
    ) -> None:
        """Start the dry run of a plan with two points or more.

        kept_mm: from bone, in this case. options: of the rehearsal, which hold the tool as they do in it.
        before: what is shown greyed until the answer is there.
        """
        waiting = ShownEvaluation("computing", "Simulating the tool along the path …", margin_mm=kept_mm, before=before)
        self.current = waiting

        def find(run: BackgroundTask) -> ShownEvaluation:
            began = partial(replace, waiting)
            return self._answer(plan, kept_mm, options, lambda job: run.tell(lambda: self._show(began(job=job))))

        self._latest.ask(FAILED, find, self._show, lambda words: self._show(failed_run(words, kept_mm)), lane=plan.id)

    def _show(self, shown: ShownEvaluation) -> None:
        self.current = shown

    def _answer(
        self, plan: Plan, kept_mm: float, options: RehearsalOptions = NO_OPTIONS, began: Callable[[str], object] = bool
    ) -> ShownEvaluation:
        try:
            return answered(
                self._services, plan, kept_mm, lambda: self._services.dry_runs.evaluate(plan, options, began)
            )
        except JobCancelled:
            words = "Simulation cancelled: fit unknown."
            return ShownEvaluation("failed", words, completed=False, margin_mm=kept_mm, cancelled=True)


def failed_run(words: str, kept_mm: float, provisional: bool = False) -> ShownEvaluation:
    """No answer, and why."""
    return ShownEvaluation("failed", words, completed=False, margin_mm=kept_mm, provisional=provisional)


def answered(services: Services, plan: Plan, kept_mm: float, evaluate: Callable[[], PlanEvaluation]) -> ShownEvaluation:
    """The evaluation of a plan with its words, or why there is none. Lets JobCancelled pass, and what is unexpected.

    kept_mm: of an answer that has failed; one that has not says itself what was kept.
    """
    try:
        evaluation = evaluate()
        uncertainty = services.cases.get(plan.case_id).uncertainty
        settings = settings_in_case(plan.content.settings, uncertainty)
    except JobCancelled:
        raise
    except StartRefused as error:
        midplane = services.planning.midplane(plan)
        verdict = refused(error).with_remarks(plan, midplane)
        return ShownEvaluation("failed", verdict.words, completed=False, margin_mm=kept_mm, refusal=verdict)
    except VfixError as error:
        return failed_run(str(error), kept_mm)
    words, warning = evaluation.verdict.words, uncertainty.warning(settings.margin_mm)
    return ShownEvaluation("done", words, evaluation.completed, evaluation, settings.kept_mm, warning)
