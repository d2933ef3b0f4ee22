"""The experiments of Li, Ishii & Taylor 2007, section V, with simulated people: Tables I and II, target inspection,
registration, and what the text says of the modes."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array
from ..error_chain.chain import FLE_MM
from ..farm import run_all
from ..statistics import PairedTest, pairs, share_interval
from .apparatus import apparatus
from .cells import Cell, Kind, by_subject, report
from .figures import Recorded, figures_of, means, table
from .fit import Fitted, with_servo
from .li2004 import bead_residual
from .measured import ErrorSizes
from .options import TRIALS, Options
from .paper_figures import CONTRADICTIONS, LI_2007
from .papers_program import THRESHOLD_MM, counted
from .traces import traces
from .trials import Mode, TrialKey, run_trial, subject_of

MODES: tuple[Mode, ...] = ("freehand", "hands-on", "teleoperated")
_APART = 1_000_003  # between the seeds of two laboratories
_NEVER_FITTED = "the engine's control law leaves less than any servo; unexplained without the servo's variant"

Rows = dict[tuple[int, int], dict[str, float]]


def record(key: TrialKey) -> Recorded:
    """Run one trial of a subject of the fitted people."""
    fitted = Fitted.stored()
    trial = run_trial(key, subject_of(key, fitted.person))
    return Recorded.of(trial, fitted.sizes)


def figures_in_own(key: TrialKey) -> dict[str, float]:
    """Run one trial, and return its figures in the laboratory with its study's seed."""
    return figures_of(record(key), Fitted.stored().sizes, key.study)


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
    found = _tables(recorded, options, functools.partial(figures_of, sizes=sizes, laboratory=options.seed))
    hands = [one.trial for key, one in recorded.items() if key.mode == "hands-on"]
    servo = with_servo(sizes, hands, options.seed)
    in_variant = _tables(recorded, options, functools.partial(figures_of, sizes=servo, laboratory=options.seed))
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
        "sweeps": {} if options.quick else _sweeps(recorded, sizes, options),
    }
    return report(
        "li2007", options.seed, cells, quick=options.quick, fitted=fitted.to_dict(), assumed=assumed,
        order_share=_laboratories(recorded, sizes, options), pairs=compared, apparatus=apparatus().version, more=more,
    )  # fmt: skip


def keys(seed: int, subjects: int, trials: int, modes: Sequence[Mode] = MODES) -> list[TrialKey]:
    """The trials of a study."""
    return [TrialKey(seed, *one) for one in itertools.product(range(subjects), range(trials), modes)]


def recorded_trials(options: Options) -> dict[TrialKey, Recorded]:
    """Run the trials of the study's own laboratory, with those of target inspection."""
    wanted = keys(options.seed, options.subjects, options.trials)
    wanted += [TrialKey(options.seed, 0, look, "inspection") for look in range(options.looks)]
    done = itertools.count(1)
    share = 1.0 if options.quick else 1.0 / options.laboratories

    def tell(key: TrialKey, value: Recorded) -> None:
        options.progress(share * next(done) / len(wanted))

    return run_all(record, wanted, options.workers, tell)


def _tables(
    recorded: Mapping[TrialKey, Recorded], options: Options, figures: Callable[[Recorded], dict[str, float]]
) -> dict[str, dict[str, Array]]:
    rows: dict[str, Rows] = {mode: {} for mode in MODES}
    for key, one in recorded.items():
        if key.mode in rows:
            rows[key.mode][key.subject, key.trial] = figures(one)
    return {mode: table(one, options.subjects, options.trials) for mode, one in rows.items()}


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


def _laboratories(recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, options: Options) -> dict[str, Any]:
    """In how many laboratories the paper's order of the modes came out, and significantly.

    Quick: the error chain is drawn anew on one set of trials; else every laboratory has its own people and trials.
    """
    orders, significant, wrong, fastest = 0, 0, 0, 0
    for number in range(options.laboratories):
        seed = options.seed + _APART * number
        if options.quick or number == 0:
            found = _tables(recorded, options, functools.partial(figures_of, sizes=sizes, laboratory=seed))
        else:
            wanted = keys(seed, options.subjects, options.trials)
            values = run_all(figures_in_own, wanted, options.workers)
            rows: dict[str, Rows] = {mode: {} for mode in MODES}
            for key, one in values.items():
                rows[key.mode][key.subject, key.trial] = one
            found = {mode: table(one, options.subjects, options.trials) for mode, one in rows.items()}
            options.progress((number + 1) / options.laboratories)
        true: dict[str, Array] = {mode: means(found[mode]["true_error_mm"]) for mode in MODES}
        free, hands, far = (float(true[mode].mean()) for mode in MODES)
        compared = pairs(true)["hands-on - teleoperated"]
        orders += free > hands > far
        significant += free > hands > far and compared.p_t_holm < 0.05
        wrong += hands < far and compared.p_t_holm < 0.05
        times = {mode: float(means(found[mode]["time_s"]).mean()) for mode in MODES}
        fastest += min(times, key=lambda mode: times[mode]) == "hands-on"
    of = options.laboratories

    def share(count: int) -> dict[str, Any]:
        return {"count": count, "of": of, "share": count / of, "ci95": list(share_interval(count, of))}

    return {
        "laboratories": "error chain drawn anew on one set of trials"
        if options.quick
        else "own people and trials each",
        "freehand > hands-on > teleoperated": share(orders),
        "the same, hands-on > teleoperated at 5 % (Holm)": share(significant),
        "hands-on < teleoperated at 5 % (Holm)": share(wrong),
    } | ({} if options.quick else {"hands-on fastest": share(fastest)})  # quick: one set of times for all


SWEEPS: Mapping[str, tuple[Any, ...]] = {
    "compliance_mm_per_n": (0.0, 0.05, 0.1, 0.2, 0.3),
    "weight_n": (0.0, 1.5, 3.0),
    "backlash_mm": (0.0, 0.2, 0.4),
    "tracker_mm": (0.0, 0.1, 0.2),
    "by_subject": (True, False),
}


def _sweeps(recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, options: Options) -> dict[str, Any]:
    """Table II's errors of the robot's modes, and the order's share, for other sizes of what is assumed.

    The fitted sizes stay: what a sweep shows is how much of a cell rests on an assumption.
    """
    swept: dict[str, Any] = {}
    quick = replace(options, quick=True)
    for name, values in SWEEPS.items():
        swept[name] = []
        for value in values:
            changed = replace(sizes, **{name: value})
            again = recorded
            if name.startswith("backlash"):
                again = {key: Recorded.of(one.trial, changed) for key, one in recorded.items()}
            found = _tables(again, options, functools.partial(figures_of, sizes=changed, laboratory=options.seed))
            shares = _laboratories(again, changed, quick)
            swept[name].append(
                {
                    "value": value,
                    "hands-on": by_subject(found["hands-on"]["true_error_mm"])[0],
                    "teleoperated": by_subject(found["teleoperated"]["true_error_mm"])[0],
                    "order_share": shares["freehand > hands-on > teleoperated"]["share"],
                }
            )
    return swept
