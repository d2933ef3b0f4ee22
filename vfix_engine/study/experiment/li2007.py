"""The experiments of Li, Ishii & Taylor 2007, section V, with simulated people: Tables I and II, target inspection,
registration, and what the text says of the modes."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arrays import Array
from ..error_chain.chain import FLE_MM
from ..farm import run_all
from ..statistics import PairedTest, pairs
from .apparatus import apparatus
from .cells import Cell, Kind, by_subject, report
from .figures import Recorded, figures_of, means
from .fit import Fitted, with_servo
from .laboratories import MODES, keys, order_shares, record, tables
from .li2004 import bead_residual
from .measured import ErrorSizes
from .options import TRIALS, Options
from .paper_figures import CONTRADICTIONS, LI_2007
from .papers_program import THRESHOLD_MM, counted
from .sweeps import swept
from .traces import traces
from .trials import TrialKey

_NEVER_FITTED = "the engine's control law leaves less than any servo; unexplained without the servo's variant"


def run(options: Options) -> dict[str, Any]:
    """Run the study, and return its report.

    Raises:
        ControlError: a trial could not be run.
    """
    return evaluated(recorded_trials(options), options)


def evaluated(recorded: Mapping[TrialKey, Recorded], options: Options) -> dict[str, Any]:
    """The report on recorded trials."""
    fitted = Fitted.stored()
    sizes = fitted.sizes
    found = tables(recorded, options, functools.partial(figures_of, sizes=sizes, laboratory=options.seed))
    hands = [one.trial for key, one in recorded.items() if key.mode == "hands-on"]
    servo = with_servo(sizes, hands, options.seed)
    in_variant = tables(recorded, options, functools.partial(figures_of, sizes=servo, laboratory=options.seed))
    compared = {
        "true_error_mm": pairs({mode: means(found[mode]["true_error_mm"]) for mode in MODES}),
        "robot_error_mm": pairs({mode: means(found[mode]["robot_error_mm"]) for mode in MODES[1:]}),
        "time_s": pairs({mode: means(found[mode]["time_s"]) for mode in MODES}),
    }
    cells = [*_table_1(found, in_variant, compared), *_table_2(found, compared), *_inspection(recorded, sizes, options)]
    cells += [*_registration(options.seed), *program_cells(recorded), *_said(found)]
    assumed = {name: value for name, value in vars(sizes).items() if name not in ("shift_mm", "turn_rad")}
    more = {
        "subjects": options.subjects,
        "trials": options.trials,
        "unfinished": int(sum((1.0 - found[mode]["finished"]).sum() for mode in MODES)),
        "servo_variant_mm": servo.servo_mm,
        "contradictions": list(CONTRADICTIONS),
        "traces": traces(recorded, sizes, options.seed),
        "sweeps": {} if options.quick else swept(recorded, sizes, options),
    }
    return report(
        "li2007", options.seed, cells, quick=options.quick, fitted=fitted.to_dict(), assumed=assumed,
        order_share=order_shares(recorded, sizes, options), pairs=compared, apparatus=apparatus().version, more=more,
    )  # fmt: skip


def recorded_trials(options: Options) -> dict[TrialKey, Recorded]:
    """Run the trials of the study's own laboratory, with those of target inspection."""
    wanted = keys(options.seed, options.subjects, options.trials)
    wanted += [TrialKey(options.seed, 0, look, "inspection") for look in range(options.looks)]
    done = itertools.count(1)
    share = 1.0 if options.quick else 1.0 / options.laboratories

    def tell(key: TrialKey, value: Recorded) -> None:
        options.progress(share * next(done) / len(wanted))

    return run_all(record, wanted, options.workers, tell, kept=options.kept)


def _cell(name: str, ours: float, sd: float | None, kind: Kind, n: int | None, note: str = "") -> Cell:
    """A cell of the printed one with this name."""
    printed = LI_2007[name]
    return Cell(
        printed.table, printed.row, printed.column, printed.value, printed.sd, ours, sd, kind, n, note or printed.note
    )


def _of(name: str, values: Array, kind: Kind = "predicted", note: str = "") -> Cell:
    mean, sd = by_subject(values)
    return _cell(name, mean, sd, kind, int((~np.isnan(values).all(axis=1)).sum()), note)


def _table_1(
    found: Mapping[str, Mapping[str, Array]],
    in_variant: Mapping[str, Mapping[str, Array]],
    compared: Mapping[str, Mapping[str, PairedTest]],
) -> list[Cell]:
    hands, far = found["hands-on"], found["teleoperated"]
    error, time = compared["robot_error_mm"], compared["time_s"]
    pair = "hands-on - teleoperated"
    cells = [
        _of("I hands-on error", hands["robot_error_mm"], note=_NEVER_FITTED),
        _of("I remote error", far["robot_error_mm"], note=_NEVER_FITTED),
        _cell("I error p", error[pair].p_t, None, "predicted", error[pair].n),
        _of("I hands-on time", hands["time_s"]),
        _of("I remote time", far["time_s"], note="the device's scale and dead band are assumed"),
        _cell("I time p", time[pair].p_t, None, "predicted", time[pair].n),
    ]
    variant = "variant with a servo error, fitted to hands-on"
    return [
        *cells,
        _of("I hands-on error", in_variant["hands-on"]["robot_error_mm"], "fitted", variant),
        _of("I remote error", in_variant["teleoperated"]["robot_error_mm"], note=variant),
    ]


def _table_2(found: Mapping[str, Mapping[str, Array]], compared: Mapping[str, Mapping[str, PairedTest]]) -> list[Cell]:
    pair = compared["true_error_mm"]["hands-on - teleoperated"]
    cells = [_cell("II hands-on remote p", pair.p_t, None, "predicted", pair.n)]
    for mode, name in (("hands-on", "II hands-on"), ("teleoperated", "II remote"), ("freehand", "II freehand")):
        cells += [_of(f"{name} error", found[mode]["true_error_mm"]), _of(f"{name} time", found[mode]["time_s"])]
    return cells


def _inspection(recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, options: Options) -> list[Cell]:
    looks = [figures_of(one, sizes, options.seed) for key, one in recorded.items() if key.mode == "inspection"]
    own, seen = ([one[name] for one in looks] for name in ("robot_error_mm", "true_error_mm"))
    n, note = len(looks), "fitted in the mean over laboratories; this is one of them"
    own_sd, seen_sd = float(np.std(own, ddof=1)), float(np.std(seen, ddof=1))
    return [
        _cell("inspection encoders mean", float(np.mean(own)), own_sd, "predicted", n),
        _cell("inspection encoders max", max(one["robot_max_mm"] for one in looks), None, "predicted", n),
        _cell("inspection tracker mean", float(np.mean(seen)), seen_sd, "fitted", n, note),
        _cell("inspection tracker max", max(one["true_max_mm"] for one in looks), None, "predicted", n),
    ]


def _registration(seed: int) -> list[Cell]:
    """Residuals of five fits of five beads with the assumed localisation error."""
    residuals = [bead_residual(seed, fit) for fit in range(TRIALS)]
    note = f"the localisation error of {FLE_MM} mm rms was chosen by this figure"
    return [_cell("registration", float(np.mean(residuals)), float(np.std(residuals, ddof=1)), "assumed", TRIALS, note)]


def program_cells(recorded: Mapping[TrialKey, Recorded]) -> list[Cell]:
    """The papers' program in the first hands-on trial of each subject."""
    chosen = [one.trial for key, one in recorded.items() if (key.mode, key.trial) == ("hands-on", 0)]
    counts = counted(chosen)
    note = f"pairs nearer than {THRESHOLD_MM} mm: not printed, chosen by the largest number of rows"
    rows = {"A·J": counts.constraint_rows, "W·J": counts.objective_rows}
    cells = [
        _cell(f"rows of {name} {which}", float(of(count)), None, "assumed", len(chosen), note)
        for name, count in rows.items()
        for which, of in (("fewest", min), ("most", max))
    ]
    return [*cells, _cell("NNLS iterations", float(max(counts.iterations)), None, "predicted", len(chosen))]


def _said(found: Mapping[str, Mapping[str, Array]]) -> list[Cell]:
    """What the text says of the modes, as shares of subjects."""
    hands, far, free = (found[mode] for mode in ("hands-on", "teleoperated", "freehand"))
    faster = means(hands["time_s"]) < means(far["time_s"])
    smoother = means(hands["joint_smoothness"]) > means(far["joint_smoothness"])
    later = means(free["second_half"]) > 1.0
    robots = np.concatenate([hands["contacts"], far["contacts"]])
    return [
        _cell("said faster", float(faster.mean()), None, "predicted", len(faster)),
        _cell("said smoother", float(smoother.mean()), None, "predicted", len(smoother)),
        _cell("said second half", float(later.mean()), None, "predicted", len(later)),
        _cell("said contacts", float(np.nansum(robots)), None, "predicted", len(faster)),
    ]
