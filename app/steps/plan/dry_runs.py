"""What the tool makes of the path: the dry run of the controller, in the background, latest wins."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from app.scene import palette
from app.services import Services
from app.services.errors import JobCancelled
from app.services.planning import PlanEvaluation
from app.services.tissue_words import tissue_words
from app.steps.plan.lanes import Lanes
from app.steps.plan.sections import CorridorSection, CorridorStatus, ScaleView, SoftTissueView
from vfix_engine.errors import VfixError

Floats = npt.NDArray[np.float64]
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Corridor:
    """The state of the dry run of one plan.

    status: 'none', 'computing', 'done' or 'failed'. warning: what the margin does not cover; '' where it covers all.
    """

    status: CorridorStatus = "none"
    words: str = ""
    caution: bool = False
    completed: bool | None = None
    evaluation: PlanEvaluation | None = None
    margin_mm: float = 0.3
    warning: str = ""

    def samples(self) -> tuple[Floats, Floats] | None:
        """Places (n, 3) along the path and the bone clearance (n,) of the whole tool there, as an export has them."""
        return None if self.evaluation is None else (self.evaluation.positions, self.evaluation.clearance)

    def view(self) -> CorridorSection:
        """The page's section."""
        least, tissue = None, None
        if self.evaluation is not None:
            least, passed = round(self.evaluation.min_clearance_mm, 3), self.evaluation.soft_tissue
            tissue = SoftTissueView(length_mm=passed.length_mm, at_mm=passed.at_mm, complete=passed.complete)
        scale: ScaleView | None = None
        if self.status in ("computing", "done"):
            scale = {
                "lo": palette.CLEARANCE_LOW_MM,
                "hi": palette.CLEARANCE_HIGH_MM,
                "margin": self.margin_mm,
                "colours": palette.scale_colours(),
            }
        return {
            "status": self.status,
            "words": self.words,
            "caution": self.caution,
            "completed": self.completed,
            "min_clearance_mm": least,
            "soft_tissue": tissue,
            "warning": self.warning,
            "scale": scale,
        }


class DryRuns:
    """Runs the newest plan dry; an answer to an older plan is dropped."""

    def __init__(self, services: Services, executor: Executor, done: Callable[[int, Corridor], None]) -> None:
        """done: gets the ticket and the answer on another thread; hand both to :meth:`accept` on the owner's."""
        self._services, self._lanes, self._done = services, Lanes(executor), done
        self._ticket = 0
        self.current = Corridor()

    def clear(self) -> None:
        self._ticket += 1
        self.current = Corridor()

    def ask(self, plan: Any, margin_mm: float) -> None:
        """Start the dry run of a plan with two points or more; ``done`` is called from another thread."""
        self._ticket += 1
        ticket = self._ticket
        self.current = Corridor("computing", "The tool is driven along the path …", margin_mm=margin_mm)

        def work() -> None:
            if ticket != self._ticket:
                return  # this plan is not open any more
            answer = self._answer(plan, margin_mm)
            if ticket == self._ticket:
                self._done(ticket, answer)

        self._lanes.submit(plan.id, work)

    def accept(self, ticket: int, corridor: Corridor) -> None:
        """Show an answer, unless the plan has changed while it waited."""
        if ticket == self._ticket:
            self.current = corridor

    def _answer(self, plan: Any, margin_mm: float) -> Corridor:
        try:
            evaluation = self._services.dry_runs.evaluate(plan)
            uncertainty = self._services.cases.get(plan.case_id).uncertainty
        except JobCancelled:
            words = "The dry run was cancelled; the next change of the plan starts another one."
            return Corridor("failed", words, caution=True, completed=False, margin_mm=margin_mm)
        except VfixError as error:
            return Corridor("failed", str(error), caution=True, completed=False, margin_mm=margin_mm)
        except Exception:
            _LOG.exception("the dry run of a plan failed")
            return Corridor("failed", "The dry run failed; the planner's log says why.", caution=True, completed=False)
        least, at_mm = evaluation.min_clearance_mm, evaluation.tightest_mm
        doubtful = least <= uncertainty.off_mm
        if not evaluation.completed:
            words = f"The tool gets {evaluation.reached_mm:.0f} of {evaluation.length_mm:.0f} mm: {evaluation.reason}."
        elif doubtful:
            words = (
                f"Fits the surface only: bone clearance {least:.2f} mm at least, when the tip is at {at_mm:.0f} mm, "
                f"and bone may lie {uncertainty.off_mm:.2f} mm off its surface."
            )
        else:
            words = f"Fits: bone clearance {least:.2f} mm at least, when the tip is at {at_mm:.0f} mm."
        words = f"{words} {tissue_words(evaluation.soft_tissue)}"
        caution, warning = doubtful or not evaluation.completed, uncertainty.warning(margin_mm)
        return Corridor("done", words, caution, evaluation.completed, evaluation, margin_mm, warning)
