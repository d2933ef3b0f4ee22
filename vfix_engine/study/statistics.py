"""Paired statistics of subjects' means: t, exact Wilcoxon, effect size, interval, Holm's correction and power.

Trials of one subject are not independent, so they are averaged first: taken as independent, a test at 5 % is
significant in about a quarter of the studies without an effect.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from ..arrays import Array
from ..errors import InputError

LEAST_SUBJECTS = 2
LEAST_EFFECT = 0.01  # d_z for which subjects are counted: they are 80,000 then
MOST_EXACT = 40  # differences whose signed ranks are counted exactly
SAME = 1e-12  # relative size in which differences are the same


@dataclass(frozen=True)
class PairedTest:
    """One condition minus another, by subject.

    mean, ci95: of the differences, the interval by Student's t; d_z: mean / standard deviation of the differences.
    p_t: of the paired t test, p_wilcoxon: of the exact signed-rank test; ``…_holm``: corrected for all pairs (Holm).
    n: subjects.
    """

    n: int
    mean: float
    ci95: tuple[float, float]
    d_z: float
    p_t: float
    p_wilcoxon: float
    p_t_holm: float
    p_wilcoxon_holm: float

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is not finite is None."""
        low, high = self.ci95
        values = asdict(self) | {"ci95": [low, high]}
        return {name: _finite(value) for name, value in values.items()}


def pairs(values: Mapping[str, ArrayLike], which: Iterable[tuple[str, str]] | None = None) -> dict[str, PairedTest]:
    """Compare every two conditions, ``'a - b'``.

    values: by condition, the means (n,) of the same subjects in the same order; NaN where a subject has none, who is
    left out of the pairs of that condition. which: the pairs that are compared, and corrected together; None: all.

    Raises:
        InputError: other numbers of subjects, or fewer than two in a pair.
    """
    arrays = {name: np.asarray(array, dtype=float) for name, array in values.items()}
    if len({array.shape for array in arrays.values()}) != 1 or next(iter(arrays.values())).ndim != 1:
        raise InputError("every condition has one mean of each subject, in the same order")
    found = {f"{a} - {b}": _difference(arrays[a], arrays[b]) for a, b in which or itertools.combinations(arrays, 2)}
    tests = [(_student(d), _signed_rank(d)) for d in found.values()]
    corrected_t, corrected_w = holm([p for p, _ in tests]), holm([p for _, p in tests])
    out = {}
    for number, (name, d) in enumerate(found.items()):
        mean, spread = float(d.mean()), float(d.std(ddof=1))
        out[name] = PairedTest(
            len(d), mean, mean_interval(d), mean / spread if _varies(d) else math.copysign(math.inf, mean),
            *tests[number], float(corrected_t[number]), float(corrected_w[number]),
        )  # fmt: skip
    return out


def holm(p: ArrayLike) -> Array:
    """Step-down corrected p values (n,), Holm 1979; NaN is no test and stays."""
    values = np.asarray(p, dtype=float)
    out = values.copy()
    tested = np.flatnonzero(~np.isnan(values))
    order = tested[np.argsort(values[tested], kind="stable")]
    steps = values[order] * np.arange(len(order), 0, -1)
    out[order] = np.minimum(1.0, np.maximum.accumulate(steps)) if len(order) else steps
    return out


def mean_interval(values: ArrayLike, level: float = 0.95) -> tuple[float, float]:
    """Interval of a mean by Student's t."""
    array = np.asarray(values, dtype=float)
    half = float(stats.t.ppf(0.5 + level / 2.0, len(array) - 1)) * float(stats.sem(array))
    return float(array.mean()) - half, float(array.mean()) + half


def share_interval(count: int, of: int, level: float = 0.95) -> tuple[float, float]:
    """Interval of a share ``count / of`` (Wilson 1927)."""
    found = stats.binomtest(count, of).proportion_ci(level, method="wilson")
    return float(found.low), float(found.high)


def power(d_z: float, n: int, level: float = 0.05) -> float:
    """Probability that a two-sided paired t test of n subjects is significant at a true effect d_z.

    Raises:
        InputError: fewer than two subjects, or a level outside 0 … 1.
    """
    if n < LEAST_SUBJECTS or not 0.0 < level < 1.0:
        raise InputError(f"power is of two subjects at least at a level between 0 and 1, not of {n} at {level}")
    bound, shift = float(stats.t.ppf(1.0 - level / 2.0, n - 1)), d_z * math.sqrt(n)
    return float(stats.nct.sf(bound, n - 1, shift) + stats.nct.cdf(-bound, n - 1, shift))


def least_subjects(d_z: float, wanted: float, level: float = 0.05) -> int:
    """Fewest subjects with whom the power at a true effect d_z is at least ``wanted``.

    Raises:
        InputError: no power between 0 and 1, an effect of 0, or a level outside 0 … 1.
    """
    if not 0.0 < wanted < 1.0 or not (math.isfinite(d_z) and abs(d_z) > LEAST_EFFECT):
        raise InputError(
            f"subjects are counted for a power between 0 and 1 at an effect of {LEAST_EFFECT} at least, not for "
            f"{wanted} at {d_z}"
        )
    low, high = LEAST_SUBJECTS - 1, LEAST_SUBJECTS
    while power(d_z, high, level) < wanted:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if power(d_z, middle, level) >= wanted else (middle, high)
    return high


def _difference(a: Array, b: Array) -> Array:
    difference = (a - b)[~np.isnan(a - b)]
    if len(difference) < LEAST_SUBJECTS:
        raise InputError("a comparison needs two subjects at least that have both conditions")
    return difference


def _student(d: Array) -> float:
    """Two-sided p value of the t test; NaN where every difference is the same, so that nothing varies."""
    return float(stats.ttest_1samp(d, 0.0).pvalue) if _varies(d) else math.nan


def _varies(d: Array) -> bool:
    return bool(np.ptp(d) > SAME * np.abs(d).max())


def _signed_rank(d: Array) -> float:
    """Two-sided p value, NaN where every difference is 0; zeros are left out, and ties have mean ranks (Wilcoxon 1945).

    Exact up to ``MOST_EXACT`` differences, by the distribution over all signs of their ranks; beyond by the normal
    approximation.
    """
    d = d[np.abs(d) > 0.0]
    if not len(d):
        return math.nan
    if len(d) > MOST_EXACT:
        return float(stats.wilcoxon(d, method="approx").pvalue)
    doubled = np.rint(2.0 * stats.rankdata(np.round(np.abs(d) / np.abs(d).max() / SAME) * SAME)).astype(np.intp)
    counts = np.zeros(int(doubled.sum()) + 1)
    counts[0] = 1.0
    for rank in doubled:
        shifted = np.zeros_like(counts)
        shifted[rank:] = counts[: len(counts) - rank]
        counts = counts + shifted
    plus = int(doubled[d > 0.0].sum())
    less, more = counts[: plus + 1].sum(), counts[plus:].sum()
    return float(min(1.0, 2.0 * min(less, more) / counts.sum()))


def _finite(value: Any) -> Any:
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return value if not isinstance(value, float) or math.isfinite(value) else None
