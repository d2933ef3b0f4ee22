"""Paired statistics: against scipy's own tests, published examples of R, and simulated studies without an effect."""

import itertools

import numpy as np
import pytest
from scipy import stats

from vfix_engine.errors import InputError
from vfix_engine.study.statistics import holm, mean_interval, pairs, power, share_interval

SLEEP = np.array(
    [
        [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0],
        [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4],
    ]
)


def test_the_example_of_student_in_r() -> None:
    """R: t.test(extra ~ group, data = sleep, paired = TRUE)."""
    found = pairs({"one": SLEEP[0], "two": SLEEP[1]})["one - two"]
    assert found.p_t == pytest.approx(0.002833, abs=5e-7)
    assert found.mean == pytest.approx(-1.58)
    assert found.ci95 == pytest.approx((-2.4598858, -0.7001142), abs=1e-7)


def test_the_depression_scores_in_r() -> None:
    """R: wilcox.test(x, y, paired = TRUE), the example of its help: V = 40, p = 0.0390625 two-sided."""
    x = np.array([1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30])
    y = np.array([0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29])
    assert pairs({"x": x, "y": y})["x - y"].p_wilcoxon == pytest.approx(0.0390625)


@pytest.mark.parametrize("d", [(1.0, 1.0, 2.0, 2.0, -1.0, 3.0), (1.0,) * 9 + (-1.0,), (0.5, -0.25, 0.0, 1.5)])
def test_signed_ranks_with_ties_are_counted_over_all_signs(d: tuple[float, ...]) -> None:
    found = pairs({"a": d, "b": np.zeros(len(d))})["a - b"].p_wilcoxon
    there = np.array([one for one in d if one])
    ranks = stats.rankdata(np.abs(there))
    sums = [ranks @ signs for signs in itertools.product((0, 1), repeat=len(there))]
    plus = float(ranks @ (there > 0))
    tails = np.mean(np.array(sums) <= plus), np.mean(np.array(sums) >= plus)
    assert found == pytest.approx(min(1.0, 2.0 * min(tails)))


def test_the_correction_of_holm_in_r() -> None:
    """R: p.adjust(c(0.01, 0.02, 0.03, 0.04, 0.05), "holm") and one that is not sorted."""
    np.testing.assert_allclose(holm([0.01, 0.02, 0.03, 0.04, 0.05]), [0.05, 0.08, 0.09, 0.09, 0.09])
    np.testing.assert_allclose(holm([0.04, np.nan, 0.001, 0.6]), [0.08, np.nan, 0.003, 0.6])


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_intervals_of_shares_that_are_published(count: int, of: int, low: float, high: float) -> None:
    """Newcombe 1998, Table I, method 3; R: prop.test(count, of, correct = FALSE)."""
    assert share_interval(count, of) == pytest.approx((low, high), abs=5e-5)


def test_signed_ranks_without_ties_are_those_of_scipy() -> None:
    random = np.random.default_rng(11)
    for n in (6, 10, 25):
        d = random.normal(0.4, 1.0, n)
        assert pairs({"a": d, "b": np.zeros(n)})["a - b"].p_wilcoxon == pytest.approx(
            float(stats.wilcoxon(d, method="exact").pvalue)
        )


def test_the_power_in_r() -> None:
    """R: power.t.test(n = 20, delta = 1, sd = 2, type = "paired", strict = TRUE) is 0.5644."""
    assert power(0.5, 20) == pytest.approx(0.5645, abs=2e-4)
    assert power(0.0, 10) == pytest.approx(0.05)
    with pytest.raises(InputError, match="two subjects"):
        power(1.0, 1)


def test_three_conditions_are_three_pairs_corrected_together() -> None:
    random = np.random.default_rng(1)
    values = {name: random.normal(mean, 1.0, 12) for name, mean in (("a", 0.0), ("b", 1.0), ("c", 3.0))}
    found = pairs(values)
    assert list(found) == ["a - b", "a - c", "b - c"]
    plain = [stats.ttest_rel(values[a], values[b]).pvalue for a, b in (("a", "b"), ("a", "c"), ("b", "c"))]
    np.testing.assert_allclose([one.p_t for one in found.values()], plain)
    np.testing.assert_allclose([one.p_t_holm for one in found.values()], holm(plain))
    assert found["a - c"].d_z == pytest.approx(found["a - c"].mean / (values["a"] - values["c"]).std(ddof=1))


def test_who_is_missing_in_one_condition_is_left_out_of_its_pairs() -> None:
    found = pairs({"a": [1.0, 2.0, 4.0, np.nan], "b": [0.0, 0.5, 1.0, 7.0], "c": [1.0, 1.0, 2.0, 2.0]})
    assert [found[name].n for name in ("a - b", "a - c", "b - c")] == [3, 3, 4]
    with pytest.raises(InputError, match="two subjects"):
        pairs({"a": [1.0, np.nan], "b": [0.0, 0.5]})
    with pytest.raises(InputError, match="same order"):
        pairs({"a": [1.0, 2.0], "b": [0.0]})


def test_equal_conditions_have_no_test_and_no_infinity_in_json() -> None:
    found = pairs({"a": [1.0, 2.0, 3.0], "b": [0.0, 1.0, 2.0]})["a - b"].to_dict()
    assert found["mean"] == 1.0
    assert found["d_z"] is None
    apart = pairs({"a": [0.3, 1.3, 2.3], "b": [0.1, 1.1, 2.1]})["a - b"].to_dict()
    assert (apart["p_t"], apart["d_z"]) == (None, None)  # the same but for rounding
    same = pairs({"a": [1.0, 2.0, 3.0], "b": [1.0, 2.0, 3.0]})["a - b"].to_dict()
    assert same["p_wilcoxon"] is None


def test_intervals_cover_what_they_should() -> None:
    random, inside = np.random.default_rng(3), 0
    for _ in range(2000):
        low, high = mean_interval(random.normal(5.0, 2.0, 10))
        inside += low <= 5.0 <= high
    assert 0.935 < inside / 2000 < 0.965
    low, high = share_interval(30, 30)
    assert (round(low, 3), high) == (0.886, 1.0)


def test_means_of_subjects_keep_the_level_where_trials_do_not() -> None:
    """Without an effect five trials of ten subjects are significant at 5 % in about 5 %, taken as fifty in far more."""
    random, by_subject, by_trial, studies = np.random.default_rng(5), 0, 0, 400
    for _ in range(studies):
        a, b = random.normal(0.0, 1.0, (2, 10, 1)) + random.normal(0.0, 0.7, (2, 10, 5))
        by_subject += pairs({"a": a.mean(axis=1), "b": b.mean(axis=1)})["a - b"].p_t < 0.05
        by_trial += stats.ttest_rel(a.ravel(), b.ravel()).pvalue < 0.05
    assert by_subject / studies < 0.08
    assert by_trial / studies > 0.2
