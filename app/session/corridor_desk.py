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
from vfix_engine.errors import VfixError
from vfix_engine.simulation.dry_run import DryRun

Floats = npt.NDArray[np.float64]
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Corridor:
    """The state of the dry run. status: 'none', 'computing', 'done' or 'failed'."""

    status: str = "none"
    words: str = ""
    caution: bool = False
    completed: bool | None = None
    run: DryRun | None = None
    margin_mm: float = 0.3

    def clearances(self, stations: Floats) -> Floats | None:
        """(n,) clearance of the whole tool [mm] at arc lengths (n,); NaN where the tool did not get."""
        if self.run is None or len(self.run.s) == 0:
            return None
        order = np.argsort(self.run.s, kind="stable")
        s, clearance = self.run.s[order], self.run.clearance[order]
        found: Floats = np.interp(stations, s, clearance)
        found[stations > s[-1] + 0.5] = np.nan
        return found

    def view(self) -> dict[str, Any]:
        """The page's section."""
        least = None if self.run is None or len(self.run.clearance) == 0 else round(float(self.run.clearance.min()), 3)
        scale = None
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
            "scale": scale,
        }


class CorridorDesk:
    """Runs the newest plan dry; an answer to an older plan is dropped."""

    def __init__(self, services: Services, executor: Executor, done: Callable[[Corridor], None]) -> None:
        self._services, self._executor, self._done = services, executor, done
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
                return  # a newer plan waits behind this one
            answer = self._answer(plan, margin_mm)
            if ticket == self._ticket:
                self._done(answer)

        self._executor.submit(work)

    def accept(self, corridor: Corridor) -> None:
        self.current = corridor

    def _answer(self, plan: Any, margin_mm: float) -> Corridor:
        try:
            run = self._services.planning.dry_run(plan)
        except VfixError as error:
            return Corridor("failed", str(error), caution=True, completed=False, margin_mm=margin_mm)
        except Exception:
            _LOG.exception("the dry run of a plan failed")
            return Corridor("failed", "The dry run failed; the planner's log says why.", caution=True, completed=False)
        if run.completed:
            words = f"The tool fits along the whole path; least clearance {run.clearance.min():.2f} mm."
        else:
            words = f"The tool gets {run.reached_mm:.0f} of {run.length_mm:.0f} mm: {run.reason}."
        return Corridor("done", words, not run.completed, run.completed, run, margin_mm)
