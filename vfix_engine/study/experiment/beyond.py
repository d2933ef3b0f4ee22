"""The study of Li 2007 beyond the paper: the same people at our own parameters, on other anatomies.

Controls: the paper's at 30 Hz; ours, with the margin and the certificate of the product, at ``RATE_HZ``; ours that
compensates the robot's deflection; ours that keeps away from protected structures. Anatomies: the phantom, a mirrored
variant of it with another septum, and the real head where its files are. Fitted parameters and errors stay.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array
from ..farm import run_all
from ..statistics import PairedTest, pairs
from .apparatus import ANATOMIES, COMPENSATED_MM_PER_N, HEAD_BONE, HEAD_PATH, OURS, RATE_HZ, apparatus, missing_files
from .cells import Cell, by_subject, report
from .figures import Recorded, figures_of, table
from .fit import Fitted
from .options import Options
from .trials import Mode, TrialKey, run_trial, subject_of

CONTROLS = ("li2007", *OURS)
ROBOT_MODES: tuple[Mode, ...] = ("hands-on", "teleoperated")
FREE = "free hand"  # the control of a free hand
COLUMNS: Mapping[str, str] = {
    "true_error_mm": "true error mm", "robot_error_mm": "robot error mm", "time_s": "time s",
    "clearance_mm": "least distance to bone mm", "structures_mm": "least distance to structures mm",
    "contacts": "contacts", "finished": "share finished",
}  # fmt: skip
LEAST = ("clearance_mm", "structures_mm")  # of which the least over all trials is told, not the mean


class BeyondKey(NamedTuple):
    """Names one trial."""

    trial: TrialKey
    control: str
    anatomy: str


def keys(options: Options, anatomies: tuple[str, ...]) -> list[BeyondKey]:
    """The trials. A free hand is the same in every control, so it is driven once in each anatomy."""
    people = list(itertools.product(range(options.subjects), range(options.trials)))
    kinds: list[tuple[str, Mode]] = [(FREE, "freehand"), *itertools.product(CONTROLS, ROBOT_MODES)]
    return [
        BeyondKey(TrialKey(options.seed, *person, mode), control, anatomy)
        for anatomy, (control, mode), person in itertools.product(anatomies, kinds, people)
    ]


def measured(key: BeyondKey, head: str) -> dict[str, float]:
    """Run one trial, and return its figures in the laboratory with its study's seed."""
    fitted, variant = Fitted.stored(), "ours" if key.control == FREE else key.control
    person = subject_of(key.trial, fitted.person)
    trial = run_trial(key.trial, person, variant, key.anatomy, head)
    found = figures_of(Recorded.of(trial, fitted.sizes), fitted.sizes, key.trial.study)
    return found | {"clearance_mm": trial.clearance_mm, "structures_mm": trial.structures_mm}


def run(options: Options) -> dict[str, Any]:
    """Run the study, and return its report; an anatomy that is left out is named in ``skipped``, with the reason.

    Raises:
        InputError: the real head's files are not those of the study.
        ControlError: a trial could not be run.
    """
    anatomies, skipped = _anatomies(options)
    for name in anatomies:  # before anything is computed
        apparatus("ours", name, str(options.head or ""))
    wanted, done = keys(options, anatomies), itertools.count(1)

    def tell(key: BeyondKey, value: Mapping[str, float]) -> None:
        options.progress(next(done) / len(wanted))

    values = run_all(
        functools.partial(measured, head=str(options.head or "")), wanted, options.workers, tell, kept=options.kept
    )
    by_kind: dict[tuple[str, str, Mode], dict[tuple[int, int], Mapping[str, float]]] = {}
    for key, one in values.items():
        kind = key.anatomy, key.control, key.trial.mode
        by_kind.setdefault(kind, {})[key.trial.subject, key.trial.trial] = one
    found = {kind: table(one, options.subjects, options.trials, [*COLUMNS]) for kind, one in by_kind.items()}
    cells = [cell for kind, one in found.items() for cell in _cells(kind, one)]
    sizes = Fitted.stored().sizes
    assumed = {name: value for name, value in vars(sizes).items() if name not in ("shift_mm", "turn_rad")}
    assumed |= {"rate_hz": RATE_HZ, "compensated_mm_per_n": COMPENSATED_MM_PER_N}
    margins = {zone.name: zone.margin_mm for zone in apparatus("ours").structures}
    more = {
        "subjects": options.subjects,
        "trials": options.trials,
        "skipped": skipped,
        "margins_mm": {"bone": apparatus("ours").settings.kept_mm, **margins},
    }
    return report(
        "li2007-beyond", options.seed, cells, quick=options.quick, fitted=Fitted.stored().to_dict(), assumed=assumed,
        order_share={}, pairs=_compared(found), apparatus=apparatus().version, more=more,
    )  # fmt: skip


def _anatomies(options: Options) -> tuple[tuple[str, ...], dict[str, str]]:
    if options.head is None:
        return ANATOMIES[:-1], {"head": f"no folder with {HEAD_BONE} and {HEAD_PATH} was named (--head)"}
    missing = missing_files(options.head)
    if missing:
        return ANATOMIES[:-1], {"head": f"the folder that was named has no {' and no '.join(missing)}"}
    return ANATOMIES, {}


def _cells(kind: tuple[str, str, Mode], found: Mapping[str, Array]) -> list[Cell]:
    anatomy, control, mode = kind
    row = mode if control == FREE else f"{control}, {mode}"
    cells = []
    for name, column in COLUMNS.items():
        values = found[name]
        n = int((~np.isnan(values).all(axis=1)).sum())
        if not n:
            continue  # a free hand has no encoders
        mean, sd = (float(np.nanmin(values)), None) if name in LEAST else by_subject(values)
        cells.append(Cell(anatomy, row, column, None, None, mean, sd, "predicted", n))
    return cells


def _compared(found: Mapping[tuple[str, str, Mode], Mapping[str, Array]]) -> dict[str, dict[str, PairedTest]]:
    """By anatomy and robot mode, the true error with each of our controls against the paper's, and compensated."""
    which = [("li2007", "ours"), ("ours", "compensated"), ("ours", "protected")]
    out = {}
    for anatomy, mode in itertools.product(dict.fromkeys(kind[0] for kind in found), ROBOT_MODES):
        values = {control: np.nanmean(found[anatomy, control, mode]["true_error_mm"], axis=1) for control in CONTROLS}
        out[f"{anatomy}, {mode}, true error mm"] = pairs(values, which)
    return out
