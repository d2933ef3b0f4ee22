"""Study II of Kwok 2013, section IV.C.2, with simulated people: Table IV, and two arms more than the paper has."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from ...arrays import Array
from ...worlds.snake.settings import ARMS, Arm
from ..diathermy.task import table_iv
from ..endoscopy.endoscopist import SPREADS, Endoscopist
from ..endoscopy.label_person import SEARCH
from ..endoscopy.label_run import LONGEST_S, LabelTrial, run_trial
from ..farm import run_all
from .arms import ArmKey, by_arm, compared, keys, mean_cell, place_of, seed_of, subjects_of
from .cavity import STEP_S, cavity_of, stored_labels
from .cells import Cell, report
from .kwok_figures import AGREES_IV, CONTRADICTIONS_IV, KWOK_IV
from .kwok_sweeps import SweptKey, asked_of, swept_keys, swept_rows
from .options import Options
from .paper_figures import Printed

SWEPT = (
    "camera_mm_per_s", "approach_s", "cut_mm_per_s", "see_deg", "yield_mm_per_s_per_n", "delay_s", "tremor_mm",
    "drift_s", "hand_lag_s", "motion_noise", "learning",
)  # fmt: skip
PAPERS: Arm = "guided"  # the paper has no other arm in this study
SWEPT_ARMS: tuple[Arm, ...] = (PAPERS,)


def record(key: ArmKey | SweptKey) -> LabelTrial:
    """Run one trial of a subject."""
    key, who = asked_of(key)
    return run_trial(cavity_of(key.arm), who, seed_of(key), LONGEST_S)


def run(options: Options) -> dict[str, Any]:
    """Run the study with its sweeps, and return its report. Raises ControlError: a trial could not be run."""
    main = keys(options)
    swept = [] if options.quick else swept_keys(SWEPT, SWEPT_ARMS, options.seed, subjects_of(options))
    wanted: list[ArmKey | SweptKey] = [*main, *swept]
    done = itertools.count(1)

    def tell(key: ArmKey | SweptKey, value: LabelTrial) -> None:
        options.progress(next(done) / len(wanted))

    found = run_all(record, wanted, options.workers, tell, options.scheduler, options.kept)
    return evaluated({key: found[key] for key in main}, options, {key: found[key] for key in swept})


def evaluated(
    recorded: Mapping[ArmKey, LabelTrial], options: Options, swept: Mapping[SweptKey, LabelTrial] = MappingProxyType({})
) -> dict[str, Any]:
    """The report on recorded trials, and on those of the sweeps."""
    subjects = subjects_of(options)
    rows = {key: table_iv(one.task) for key, one in recorded.items()}
    cells = [cell for name in KWOK_IV for cell in _table_iv(name, rows, subjects)]
    tests = {}
    for name, printed in KWOK_IV.items():
        means = by_arm({key: mean_of(row, name) for key, row in rows.items()}, subjects)
        tests[name] = compared(means)
        cells += [_own(f"{printed[0].row}, mean over labels", arm, means[arm]) for arm in ARMS]
    figures: dict[str, dict[ArmKey, float | None]] = {
        "labels traced": {key: float(one.task.traced) for key, one in recorded.items()},
        "most beyond a bound (mm)": {key: one.beyond_bound_mm for key, one in recorded.items()},
        "whole task (s)": {key: one.task.t if one.task.done else None for key, one in recorded.items()},
    }
    for name, values in figures.items():
        each = by_arm(values, subjects)
        tests[name] = compared(each)
        cells += [_own(name, arm, each[arm]) for arm in ARMS]
    trials = [
        {"subject": key.subject, "arm": key.arm, "place": place_of(key), "traced": one.task.traced,
         "given_up": one.given_up, "joint_choices": one.joint_choices, "beyond_bound_mm": one.beyond_bound_mm,
         "labels": rows[key]}
        for key, one in recorded.items()
    ]  # fmt: skip
    more = {
        "subjects": subjects, "unfinished": {arm: sum(not one.task.done for key, one in recorded.items()
                                                      if key.arm == arm) for arm in ARMS},
        "trials": trials,
        "sweeps": swept_rows({key: _swept(one) for key, one in swept.items()},
                             {key: _swept(one) for key, one in recorded.items()}),
        "agrees": list(AGREES_IV), "contradictions": list(CONTRADICTIONS_IV),
    }  # fmt: skip
    return report(
        "kwok2013-2", options.seed, cells, quick=options.quick, fitted={}, assumed=assumed(), order_share={},
        pairs=tests, apparatus=stored_labels().version, more=more,
    )  # fmt: skip


def assumed() -> dict[str, Any]:
    """Each assumed size, of the people and of the task."""
    people = {f"people: {name}": value for name, value in Endoscopist().to_dict().items()}
    return people | {f"spread: {name}": value for name, value in SPREADS.items()} | {
        "rule: next label": SEARCH, "step_s": STEP_S, "longest_s": LONGEST_S,
        "order": "the six orders of the arms in turn",
    }  # fmt: skip


def mean_of(labels: list[dict[str, Any]], name: str) -> float | None:
    """The mean of a row of Table IV over the labels that have one; None where none has."""
    known = [float(one[name]) for one in labels if one[name] is not None]
    return float(np.mean(known)) if known else None


def _swept(trial: LabelTrial) -> dict[str, float | None]:
    rows = table_iv(trial.task)
    return {"labels_traced": float(trial.task.traced)} | {name: mean_of(rows, name) for name in KWOK_IV}


def _table_iv(name: str, rows: Mapping[ArmKey, list[dict[str, Any]]], subjects: int) -> list[Cell]:
    """The printed row of six labels beside ours, in the paper's arm."""
    cells = []
    for label, printed in enumerate(KWOK_IV[name]):
        values = by_arm({key: labels[label][name] for key, labels in rows.items()}, subjects)[PAPERS]
        note = "N/A: the paper's first label" if printed.value is None else ""
        cells.append(mean_cell(printed._replace(note=note), values))
    return cells


def _own(row: str, arm: str, values: Array) -> Cell:
    return mean_cell(Printed("ours", row, arm, None), values)
