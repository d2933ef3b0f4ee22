"""The experiment of Li & Taylor 2004, section V, with a simulated user: Table I and the registration's residual.

The robot's row was measured by its encoders, mapped to the CT, so neither the hand's deflection nor backlash is in it;
the freehand row by the optical tracker.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ...registration.expected_error import sigma_per_axis
from ...registration.rigid_fit import residual_lengths, rigid_fits
from ..error_chain.chain import FLE_MM
from ..farm import run_all
from .apparatus import apparatus
from .cells import Cell, Kind, report
from .figures import Recorded, figures_of
from .fit import Fitted
from .options import Options
from .paper_figures import CONTRADICTIONS, LI_2004
from .traces import traces
from .trials import Mode, TrialKey, run_trial, seeds

TRIALS = 5  # as printed
MODES: tuple[Mode, ...] = ("freehand", "hands-on")


def record(key: TrialKey) -> Recorded:
    """Run one trial of the user, who is the median person."""
    fitted = Fitted.stored()
    return Recorded.of(run_trial(key, fitted.person.practised(key.trial), "li2004"), fitted.sizes)


def run(options: Options) -> dict[str, Any]:
    """Run the study, and return its report."""
    fitted, done = Fitted.stored(), itertools.count(1)
    wanted = [TrialKey(options.seed, 0, trial, mode) for mode in MODES for trial in range(options.trials)]

    def tell(key: TrialKey, value: Recorded) -> None:
        options.progress(next(done) / len(wanted))

    recorded = run_all(record, wanted, options.workers, tell, kept=options.kept)
    cells: list[Cell] = []
    shown: dict[str, Any] = {}
    for mode, row in (("freehand", "freehand"), ("hands-on", "robot")):
        sizes = fitted.sizes if mode == "freehand" else fitted.sizes.by_encoders()
        trials = {key: Recorded.of(one.trial, sizes) for key, one in recorded.items() if key.mode == mode}
        found = [figures_of(one, sizes, options.seed + number) for number, one in enumerate(trials.values())]
        drawn = traces(trials, sizes, options.seed)
        shown = drawn | {"trials": shown.get("trials", {}) | drawn["trials"]}
        cells += [
            _cell(f"{row} error", float(np.mean([one["true_error_mm"] for one in found])), "fitted", len(found)),
            _cell(f"{row} time", float(np.mean([one["time_s"] for one in found])), "fitted", len(found)),
        ]
    residual = float(np.mean([bead_residual(options.seed, trial) for trial in range(options.trials)]))
    cells.append(_cell("registration", residual, "predicted", options.trials))
    assumed = {name: value for name, value in vars(fitted.sizes).items() if name not in ("shift_mm", "turn_rad")}
    return report(
        "li2004", options.seed, cells, quick=options.quick, fitted=fitted.to_dict(), assumed=assumed, order_share={},
        pairs={}, apparatus=apparatus().version,
        more={"trials": options.trials, "contradictions": list(CONTRADICTIONS), "traces": shown},
    )  # fmt: skip


def bead_residual(seed: int, fit: int) -> float:
    """Mean residual in mm of one fit of the five beads with the assumed localisation error."""
    beads, random = apparatus().beads, np.random.default_rng(seeds(seed, 0, 0, 9, fit))
    off = beads + random.normal(0.0, sigma_per_axis(FLE_MM), beads.shape)
    turns, moves = rigid_fits(off[None], beads[None], np.ones(len(beads)))
    return float(residual_lengths(off, beads, turns, moves).mean())


def _cell(name: str, ours: float, kind: Kind, n: int) -> Cell:
    paper = LI_2004[name]
    return Cell(paper.table, paper.row, paper.column, paper.value, paper.sd, ours, None, kind, n, paper.note)
