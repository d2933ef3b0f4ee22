"""Study I of Kwok 2013, section IV.C.1, with simulated people: Table III, in the paper's two arms and in ours."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from ...arrays import Array
from ...worlds.snake.settings import ARMS, Arm
from ..endoscopy.endoscopist import SPREADS, Endoscopist
from ..endoscopy.polyp_run import LONGEST_S, PolypTrial, run_trial
from ..endoscopy.search import rules
from ..farm import run_all
from ..polyps.figures import ASSUMED
from .arms import (
    ArmKey,
    by_arm,
    compared,
    figure_cell,
    keys,
    mean_cell,
    place_of,
    seed_of,
    subjects_of,
)
from .cells import Cell, report
from .colon import CONTROL, STEP_S, colon_of, stored_colon
from .kwok_figures import AGREES_III, CONTRADICTIONS_III, KWOK_III, PrintedRow
from .kwok_sweeps import SweptKey, asked_of, swept_keys, swept_rows
from .options import Options
from .paper_figures import Printed

OURS = "certified"
SWEPT = (
    "camera_mm_per_s", "approach_s", "insert_mm_per_s", "see_deg", "see_distance", "yield_mm_per_s_per_n", "careful_n",
    "content", "patience_s", "whole_s", "gap_mm", "flexure_mm", "round_mm", "free_n", "hand_turn_deg", "delay_s",
    "tremor_mm", "drift_s", "hand_lag_s", "motion_noise", "learning",
)  # fmt: skip
SWEPT_ARMS: tuple[Arm, ...] = ("manual", "guided")
SWEPT_FIGURES = (
    "completion_time_s", "travelled_mm", "polyps_missed", "angle_error_deg", "times_missed", "deviations",
    "deviation_max_mm", "deviation_length_mm",
)  # fmt: skip
_FEW = "no p: fewer than two subjects have both, or no difference varies"


def record(key: ArmKey | SweptKey) -> PolypTrial:
    """Run one trial of a subject."""
    key, who = asked_of(key)
    return run_trial(colon_of(key.arm), who, seed_of(key), LONGEST_S)


def run(options: Options) -> dict[str, Any]:
    """Run the study with its sweeps, and return its report. Raises ControlError: a trial could not be run."""
    main = keys(options)
    swept = [] if options.quick else swept_keys(SWEPT, SWEPT_ARMS, options.seed, subjects_of(options))
    wanted: list[ArmKey | SweptKey] = [*main, *swept]
    done = itertools.count(1)

    def tell(key: ArmKey | SweptKey, value: PolypTrial) -> None:
        options.progress(next(done) / len(wanted))

    found = run_all(record, wanted, options.workers, tell, options.scheduler, options.kept)
    return evaluated({key: found[key] for key in main}, options, {key: found[key] for key in swept})


def evaluated(
    recorded: Mapping[ArmKey, PolypTrial], options: Options, swept: Mapping[SweptKey, PolypTrial] = MappingProxyType({})
) -> dict[str, Any]:
    """The report on recorded trials, and on those of the sweeps."""
    subjects = subjects_of(options)
    values = {
        name: by_arm({key: one.table.to_dict()[name] for key, one in recorded.items()}, subjects) for name in KWOK_III
    }
    tests = {name: compared(one) for name, one in values.items()}
    cells = [cell for name, row in KWOK_III.items() for cell in _row(row, values[name], tests[name])]
    beyond = by_arm({key: one.beyond_bound_mm for key, one in recorded.items()}, subjects)
    cells += [_own("most beyond a bound (mm)", arm, beyond[arm]) for arm in ARMS]
    return report(
        "kwok2013-1", options.seed, cells, quick=options.quick, fitted={}, assumed=assumed(), order_share={},
        pairs=tests, apparatus=int(stored_colon()[1]["version"]), more=_more(recorded, values, subjects)
        | {"sweeps": swept_rows({key: _swept(one) for key, one in swept.items()},
                                {key: _swept(one) for key, one in recorded.items()})},
    )  # fmt: skip


def assumed() -> dict[str, Any]:
    """Each assumed size, of the people and of the task."""
    people = {f"people: {name}": value for name, value in Endoscopist().to_dict().items()}
    people |= {f"rule: {name}": words for name, words in rules(Endoscopist()).items()}
    task = {f"task: {number + 1}": words for number, words in enumerate(ASSUMED)}
    return people | {f"spread: {name}": value for name, value in SPREADS.items()} | task | {
        "control": CONTROL,
        "step_s": STEP_S, "longest_s": LONGEST_S, "order": "the six orders of the arms in turn",
    }  # fmt: skip


def _more(
    recorded: Mapping[ArmKey, PolypTrial], values: Mapping[str, Mapping[Arm, Array]], subjects: int
) -> dict[str, Any]:
    trials = [
        {"subject": key.subject, "arm": key.arm, "place": place_of(key), "given_up": one.given_up, "led": one.led,
         "joint_choices": one.joint_choices, "beyond_bound_mm": one.beyond_bound_mm, **one.table.to_dict()}
        for key, one in recorded.items()
    ]  # fmt: skip
    return {
        "subjects": subjects,
        "unfinished": {arm: int(np.isnan(values["completion_time_s"][arm]).sum()) for arm in ARMS},
        "improvements": {name: improvement(values[name]) for name in values},
        "trials": trials,
        "agrees": list(AGREES_III),
        "contradictions": list(CONTRADICTIONS_III),
    }


def improvement(values: Mapping[Arm, Array], to: Arm = "guided") -> float | None:
    """In %, of the mean from 'manual' to another arm, over the subjects that have both; None where there is none."""
    both = ~np.isnan(values["manual"] - values[to])
    before = float(values["manual"][both].mean()) if both.any() else 0.0
    return None if before == 0.0 else 100.0 * (1.0 - float(values[to][both].mean()) / before)


def _row(row: PrintedRow, values: Mapping[Arm, Array], tests: Mapping[str, Any]) -> list[Cell]:
    """The cells of a row of Table III, and those of ours beside it."""
    gained, test = improvement(values), tests.get("manual - guided")
    p = None if test is None or np.isnan(test.p_t) else float(test.p_t)
    both = int((~np.isnan(values["manual"] - values["guided"])).sum())
    return [
        mean_cell(row.without, values["manual"]),
        mean_cell(row.with_dac, values["guided"]),
        figure_cell(row.improved, gained, None, both, _verdict(row.improved.value, gained)),
        figure_cell(row.p, p, None, both, row.p.note or ("" if p is not None else _FEW)),
        mean_cell(Printed("III", row.without.row, OURS, None), values["certified"]),
    ]


def _verdict(paper: float | None, ours: float | None) -> str:
    if ours is None or paper is None:
        return "none missed in the manual arm" if ours is None else ""
    if ours == 0.0:
        return "not reached: no difference"
    return "reached" if ours >= paper else "the same way, not reached" if ours > 0.0 else "not reached: the other way"


def _swept(trial: PolypTrial) -> dict[str, float | None]:
    figures = trial.table.to_dict()
    return {name: figures[name] for name in SWEPT_FIGURES}


def _own(row: str, arm: str, values: Array) -> Cell:
    return mean_cell(Printed("ours", row, arm, None), values)
