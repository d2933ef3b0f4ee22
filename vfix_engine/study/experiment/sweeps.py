"""How much of Table II of Li 2007 rests on an assumption: the study again with other values of what is assumed.

The fitted parameters stay. Sizes of the error chain are put on the recorded trials again; a parameter of people
needs the trials again, of the same people, in the modes in which it plays a part.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from ..farm import run_all
from ..person import SPREADS
from .cells import by_subject
from .figures import Recorded, figures_of
from .fit import Fitted
from .laboratories import MODES, ORDER, keys, order_shares, tables
from .measured import ErrorSizes
from .options import Options
from .trials import Mode, TrialKey, run_trial, subject_of

LABORATORIES = 10  # of each value, for the order's share: the error chain anew on one set of trials
TRIALS = 2  # of each subject, the first ones, where people do a mode again and it is not of practice
_DEGREE = float(np.radians(1.0))


@dataclass(frozen=True)
class Sweep:
    """Values of one assumption.

    what: what it is, with its unit; values: in that unit. of: 'chain', a field of ``ErrorSizes``; 'people', one of
    ``Person``; 'factor', of every size in ``FACTORS``. modes: in which people do the trials again. unit: of a value, in
    that of the field. practice: it acts from trial to trial, so all trials are done again.
    """

    what: str
    of: Literal["chain", "people", "factor"]
    values: tuple[Any, ...]
    modes: tuple[Mode, ...] = ()
    unit: float = 1.0
    practice: bool = False


FACTORS: Mapping[str, tuple[str, ...]] = {"registration": ("shift_mm", "turn_rad"), "spreads": ()}
_HANDS: tuple[Mode, ...] = ("hands-on",)
_FAR: tuple[Mode, ...] = ("teleoperated",)
_FREE: tuple[Mode, ...] = ("freehand",)

SWEEPS: Mapping[str, Sweep] = {
    "compliance_mm_per_n": Sweep("compliance of the robot, mm/N", "chain", (0.0, 0.05, 0.1, 0.2, 0.3)),
    "weight_n": Sweep("weight of the hand, N", "chain", (0.0, 1.5, 3.0)),
    "backlash_mm": Sweep("backlash of prismatic joints, mm", "chain", (0.0, 0.2, 0.4)),
    "backlash_rad": Sweep("backlash of revolute joints, mrad", "chain", (0.0, 1.0, 2.0), unit=1e-3),
    "tracker_mm": Sweep("noise of the tracker on an axis, mm", "chain", (0.0, 0.1, 0.2)),
    "registration": Sweep("noise of calibration and registration, by the fitted", "factor", (0.0, 0.5, 1.0, 1.5, 2.0)),
    "by_subject": Sweep("registration anew for each subject", "chain", (True, False)),
    "device_n": Sweep("speed of teleoperation: lead of the device, N", "people", (1.5, 2.45, 3.5), _FAR),
    "device_aim_rad": Sweep("aim of the device, degrees", "people", (15.0, 30.0, 45.0), _FAR, _DEGREE),
    "dead_band": Sweep("dead band of the device", "people", (0.0, 0.15, 0.3), _FAR),
    "aim_rad": Sweep("aim of the hand on the handle, degrees", "people", (6.0, 12.0, 24.0), _HANDS, _DEGREE),
    "tiring": Sweep("without rest pauses: slower by each trial", "people", (0.0, 0.03, 0.06), MODES, practice=True),
    "learning": Sweep("exponent of practice", "people", (0.0, 0.06, 0.12), MODES, practice=True),
    "spreads": Sweep("differences between people, by the assumed", "factor", (0.5, 1.0, 2.0), MODES),
    "see_across_mm": Sweep("error of what is seen across, mm", "people", (0.175, 0.35, 0.7), MODES),
    "drift_s": Sweep("drift of what is seen, s", "people", (0.75, 1.5, 3.0), MODES),
    "look_ahead_mm": Sweep("pursued point ahead, mm", "people", (2.0, 4.0, 8.0), MODES),
    "hand_lag_s": Sweep("lag of the free hand, s", "people", (0.075, 0.15, 0.3), _FREE),
    "motion_noise": Sweep("noise of its speed", "people", (0.075, 0.15, 0.3), _FREE),
    "turn_s": Sweep("time in which it turns the tool, s", "people", (0.15, 0.3, 0.6), _FREE),
}  # fmt: skip


class SweepJob(NamedTuple):
    """One value of a sweep, by its place."""

    name: str
    place: int


def swept(recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, options: Options) -> dict[str, Any]:
    """By assumption: ``what`` it is, ``trials`` of each subject, and ``rows``, one of each value."""
    jobs = [SweepJob(name, place) for name, one in SWEEPS.items() for place in range(len(one.values))]
    rows = run_all(functools.partial(row, recorded=dict(recorded), sizes=sizes, options=_plain(options)), jobs,
                   options.workers, kept=options.kept)  # fmt: skip
    return {
        name: {
            "what": one.what,
            "trials": _trials(one, options),
            "rows": [rows[SweepJob(name, place)] for place in range(len(one.values))],
        }
        for name, one in SWEEPS.items()
    }


def row(
    job: SweepJob, recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, options: Options
) -> dict[str, float | bool | None]:
    """Errors and times with one value: ``value``, whether it ``is_assumed``, by mode ``… error_mm`` and ``… time_s``,
    ``inspection_mm`` by the tracker, and ``order_share`` of ``LABORATORIES``."""
    sweep = SWEEPS[job.name]
    value = sweep.values[job.place]
    options = replace(options, quick=True, trials=_trials(sweep, options), laboratories=LABORATORIES)
    used, changed = dict(recorded), sizes
    assumed = bool(np.isclose(value, _assumed(job.name, sizes) / sweep.unit))
    if sweep.modes:
        used = {key: one for key, one in recorded.items() if key.trial < options.trials or key.mode == "inspection"}
        if not assumed:
            again = keys(options.seed, options.subjects, options.trials, sweep.modes)
            used |= {key: _again(key, job.name, value * sweep.unit, sizes) for key in again}
    elif sweep.of == "factor":
        changed = replace(sizes, **{name: value * getattr(sizes, name) for name in FACTORS[job.name]})
    else:
        changed = replace(sizes, **{job.name: value if isinstance(value, bool) else value * sweep.unit})
        if job.name.startswith("backlash"):
            used = {key: Recorded.of(one.trial, changed) for key, one in recorded.items()}
    figures = functools.partial(figures_of, sizes=changed, laboratory=options.seed)
    found = tables(used, options, figures)
    looks = [figures(one)["true_error_mm"] for key, one in used.items() if key.mode == "inspection"]
    shares = order_shares(used, changed, options)
    return {
        "value": value,
        "is_assumed": assumed,
        **{f"{mode} error_mm": by_subject(found[mode]["true_error_mm"])[0] for mode in MODES},
        **{f"{mode} time_s": by_subject(found[mode]["time_s"])[0] for mode in MODES},
        "inspection_mm": float(np.mean(looks)) if looks else None,
        "order_share": shares[ORDER]["share"],
    }


def _trials(sweep: Sweep, options: Options) -> int:
    return min(options.trials, TRIALS) if sweep.modes and not sweep.practice else options.trials


def _assumed(name: str, sizes: ErrorSizes) -> float:
    """The value that the study has, in the unit of its field."""
    if name in FACTORS:
        return 1.0
    return float(getattr(sizes, name) if hasattr(sizes, name) else getattr(Fitted.stored().person, name))


def _again(key: TrialKey, name: str, value: float, sizes: ErrorSizes) -> Recorded:
    """A trial of the same subject with another value."""
    median, spreads = Fitted.stored().person, SPREADS
    if name == "spreads":
        spreads = {one: value * size for one, size in SPREADS.items()}
    else:
        median = replace(median, **{name: value})
    return Recorded.of(run_trial(key, subject_of(key, median, spreads)), sizes)


def _plain(options: Options) -> Options:
    """Without what tells of progress and keeps results, which is not for other processes."""
    return replace(options, progress=bool, kept=None)
