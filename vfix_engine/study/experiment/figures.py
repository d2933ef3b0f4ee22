"""What is taken from one trial, and from all of them by subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ..metrics.smoothness import spectral_arc_length
from .measured import ErrorSizes, played, robot_frame_error, true_frame_error
from .trials import Trial

QUANTITIES = (
    "robot_error_mm", "true_error_mm", "true_max_mm", "robot_max_mm", "time_s", "contacts", "max_depth_mm",
    "joint_smoothness", "second_half", "finished",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Recorded:
    """A trial with its tip behind the play of the joints (n, 3), which no laboratory changes."""

    trial: Trial
    behind_play: Array

    @classmethod
    def of(cls, trial: Trial, sizes: ErrorSizes) -> Recorded:
        return cls(trial, played(trial, sizes))


def figures_of(recorded: Recorded, sizes: ErrorSizes, laboratory: int) -> dict[str, float]:
    """The quantities of one trial in one laboratory; NaN where a mode has none.

    second_half: mean error of the second half of the path over that of the first.
    joint_smoothness: spectral arc length of the joints' speeds, the mean over joints that move; 0 is smoothest.
    """
    trial = recorded.trial
    true = true_frame_error(trial, sizes, laboratory, recorded.behind_play)
    free = not trial.q.shape[1]
    own = np.full(1, np.nan) if free else robot_frame_error(trial, sizes, laboratory)
    late = trial.progress_mm > 0.5 * trial.progress_mm.max()
    halves = true[late].mean() / true[~late].mean() if late.any() and not late.all() else np.nan
    return {
        "robot_error_mm": float(own.mean()),
        "robot_max_mm": float(own.max()),
        "true_error_mm": float(true.mean()),
        "true_max_mm": float(true.max()),
        "time_s": trial.time_s,
        "contacts": float(trial.contacts),
        "max_depth_mm": trial.max_depth_mm,
        "joint_smoothness": np.nan if free else _smoothness(trial),
        "second_half": float(halves),
        "finished": float(trial.finished),
    }


def table(
    rows: Mapping[tuple[int, int], Mapping[str, float]], subjects: int, trials: int, names: Sequence[str] = QUANTITIES
) -> dict[str, Array]:
    """By quantity, the values (subjects, trials); NaN where a trial is missing."""
    out = {name: np.full((subjects, trials), np.nan) for name in names}
    for (subject, trial), values in rows.items():
        for name in names:
            out[name][subject, trial] = values[name]
    return out


def means(values: Array) -> Array:
    """Means (subjects,) over the trials of each subject."""
    return np.asarray(np.nanmean(values, axis=1))


def _smoothness(trial: Trial) -> float:
    speeds = np.abs(np.diff(trial.q, axis=0)) / trial.dt_s
    found = [spectral_arc_length(one, 1.0 / trial.dt_s) for one in speeds.T if one.max() > 0.0]
    return float(np.nanmean(found)) if found else np.nan
