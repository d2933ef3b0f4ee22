"""The trials of the modes in a laboratory, and in how many simulated laboratories the paper's order of them came out.

A laboratory is a draw of the error chain, and of people and trials where it has its own.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...arrays import Array
from ..farm import run_all
from ..statistics import pairs, share_interval
from .figures import Recorded, figures_of, means, table
from .fit import Fitted
from .measured import ErrorSizes
from .options import Options
from .trials import Mode, TrialKey, run_trial, subject_of

MODES: tuple[Mode, ...] = ("freehand", "hands-on", "teleoperated")
ORDER = "freehand > hands-on > teleoperated"
LEVEL = 0.05
_APART = 1_000_003  # between the seeds of two laboratories

Figures = Callable[[Recorded], dict[str, float]]
Tables = dict[str, dict[str, Array]]  # by mode and quantity, the values (subjects, trials)


def record(key: TrialKey) -> Recorded:
    """Run one trial of a subject of the fitted people."""
    fitted = Fitted.stored()
    trial = run_trial(key, subject_of(key, fitted.person))
    return Recorded.of(trial, fitted.sizes)


def figures_in_own(key: TrialKey) -> dict[str, float]:
    """Run one trial, and return its figures in the laboratory with its study's seed."""
    return figures_of(record(key), Fitted.stored().sizes, key.study)


def keys(seed: int, subjects: int, trials: int, modes: Sequence[Mode] = MODES) -> list[TrialKey]:
    """The trials of a study."""
    return [TrialKey(seed, *one) for one in itertools.product(range(subjects), range(trials), modes)]


def tables(recorded: Mapping[TrialKey, Recorded], options: Options, figures: Figures) -> Tables:
    """Figures of recorded trials of the modes; what is not of one, as inspection, is left out."""
    return of_figures({key: figures(one) for key, one in recorded.items() if key.mode in MODES}, options)


def of_figures(figures: Mapping[TrialKey, Mapping[str, float]], options: Options) -> Tables:
    """Figures of trials of the modes."""
    rows: dict[str, dict[tuple[int, int], Mapping[str, float]]] = {mode: {} for mode in MODES}
    for key, one in figures.items():
        rows[key.mode][key.subject, key.trial] = one
    return {mode: table(one, options.subjects, options.trials) for mode, one in rows.items()}


def order_shares(recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, options: Options) -> dict[str, Any]:
    """In how many laboratories the paper's order of the modes came out, and significantly, or another one did.

    Quick: the error chain is drawn anew on one set of trials; else every laboratory has its own people and trials.
    """
    counts: dict[str, int] = {}
    for number in range(options.laboratories):
        seed = options.seed + _APART * number
        if options.quick or number == 0:
            found = tables(recorded, options, functools.partial(figures_of, sizes=sizes, laboratory=seed))
        else:
            own = keys(seed, options.subjects, options.trials)
            values = run_all(figures_in_own, own, options.workers, kept=options.kept)
            found = of_figures(values, options)
            options.progress((number + 1) / options.laboratories)
        outcome = _of_errors(found) | ({} if options.quick else _of_times(found))  # quick: one set of times for all
        for name, came in outcome.items():
            counts[name] = counts.get(name, 0) + came
    of = options.laboratories
    how = "error chain drawn anew on one set of trials" if options.quick else "own people and trials each"
    return {"laboratories": how} | {
        name: {"count": count, "of": of, "share": count / of, "ci95": list(share_interval(count, of))}
        for name, count in counts.items()
    }


def _of_errors(found: Tables) -> dict[str, bool]:
    """What came out in one laboratory in the true frame; every p after Holm."""
    true: dict[str, Array] = {mode: means(found[mode]["true_error_mm"]) for mode in MODES}
    free, hands, far = (float(true[mode].mean()) for mode in MODES)
    compared = pairs(true)  # each is the mode of the larger error, by the paper, less the other one
    order, sure = free > hands > far, compared["hands-on - teleoperated"].p_t_holm < LEVEL
    return {
        ORDER: order,
        "the same, hands-on > teleoperated at 5 % (Holm)": order and sure,
        "the same, every pair at 5 % (Holm)": order and all(one.p_t_holm < LEVEL for one in compared.values()),
        "hands-on < teleoperated at 5 % (Holm)": hands < far and sure,
        "freehand < a robot's mode at 5 % (Holm)": any(
            one.mean < 0.0 and one.p_t_holm < LEVEL for name, one in compared.items() if name.startswith("freehand")
        ),
    }


def _of_times(found: Tables) -> dict[str, bool]:
    """The same of the times."""
    times: dict[str, Array] = {mode: means(found[mode]["time_s"]) for mode in MODES}
    compared = pairs(times)
    saved = [compared["freehand - hands-on"].mean, -compared["hands-on - teleoperated"].mean]  # by hands-on
    sure = [compared[name].p_t_holm < LEVEL for name in ("freehand - hands-on", "hands-on - teleoperated")]
    fastest = min(saved) > 0.0
    return {
        "hands-on fastest": fastest,
        "the same, faster than both at 5 % (Holm)": fastest and all(sure),
        "hands-on slower than another mode at 5 % (Holm)": any(
            less < 0.0 and one for less, one in zip(saved, sure, strict=True)
        ),
        f"{ORDER}, and hands-on fastest": fastest and _of_errors(found)[ORDER],
    }
