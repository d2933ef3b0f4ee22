"""The studies of Kwok 2013: every printed cell, no figure of the paper in ours, equal for any number of workers."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from vfix_engine.errors import InputError
from vfix_engine.study.diathermy.task import LabelProgress, first_state
from vfix_engine.study.endoscopy.endoscopist import Endoscopist
from vfix_engine.study.endoscopy.label_run import LabelTrial
from vfix_engine.study.endoscopy.polyp_run import PolypTrial
from vfix_engine.study.experiment import kwok2013_1, kwok2013_2, kwok_figures, kwok_sweeps
from vfix_engine.study.experiment.arms import ArmKey, keys, place_of, seed_of, subject_of
from vfix_engine.study.experiment.cavity import cavity_of, stored_labels
from vfix_engine.study.experiment.colon import colon_of
from vfix_engine.study.experiment.kwok_figures import KWOK_III, KWOK_IV, PrintedRow
from vfix_engine.study.experiment.options import Options
from vfix_engine.study.experiment.paper_figures import Printed
from vfix_engine.study.farm import run_all
from vfix_engine.study.polyps.table import TableIII
from vfix_engine.worlds.snake.settings import ARMS

SMALL = Options(seed=4, quick=True, subjects=3)


def short(key: ArmKey) -> PolypTrial:
    """The first three tenths of a second of a trial, in the study's own colon."""
    return kwok2013_1.run_trial(colon_of(key.arm), subject_of(key), seed_of(key), 0.3)


def looking(key: ArmKey) -> LabelTrial:
    """The first seconds of a trial of study II, in which the person looks round by control bends."""
    return kwok2013_2.run_trial(cavity_of(key.arm), subject_of(key), seed_of(key), 4.0)


def made_up() -> dict[ArmKey, PolypTrial]:
    """Trials with known figures: manual 3, guided 2, certified 1 of everything, plus a little for each subject."""
    trials = {}
    for key in keys(SMALL):
        value = 3.0 - ARMS.index(key.arm) + 0.1 * key.subject * (1 + ARMS.index(key.arm))
        table = TableIII(value, value, 1, value, value, value, 2, value, value, value, value, value)
        trials[key] = PolypTrial(table, 0.5, 0, 0, 0)
    return trials


def changed(one: Printed) -> Printed:
    return one._replace(
        value=None if one.value is None else 1.2 * one.value + 0.01, sd=None if one.sd is None else 1.2 * one.sd
    )


def ours(report: dict[str, Any]) -> list[Any]:
    return [cell["ours"] for cell in report["cells"]]


def test_study_i_is_the_same_for_any_number_of_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kwok2013_1, "record", short)
    reports = [kwok2013_1.run(Options(seed=4, quick=True, subjects=2, workers=workers)) for workers in (1, 2)]
    assert json.dumps(reports[0], allow_nan=False) == json.dumps(reports[1], allow_nan=False)
    assert reports[0]["subjects"] == 2
    assert reports[0]["unfinished"] == dict.fromkeys(ARMS, 2)
    assert any(trial["travelled_mm"] > 0.0 for trial in reports[0]["trials"])


def test_a_trial_is_equal_after_others_and_alone_in_a_fresh_process() -> None:
    """To the last bit of where the camera has gone."""
    before, key = ArmKey(4, 1, "certified"), ArmKey(4, 0, "guided")
    after = [looking(one) for one in (before, key)][1]
    alone = run_all(looking, [key], workers=2)[key]
    assert repr(alone) == repr(after)
    assert after.task.travel_mm > 10.0


def test_study_i_has_every_printed_cell_and_what_follows_from_known_trials() -> None:
    found = kwok2013_1.evaluated(made_up(), SMALL)
    cells = {(cell["table"], cell["row"], cell["column"]): cell for cell in found["cells"]}
    for row in KWOK_III.values():
        for one in row:
            cell = cells[one.table, one.row, one.column]
            assert (cell["paper"], cell["paper_sd"], cell["n"]) == (one.value, one.sd, 3)
    time = [cells["III", "Complet. Time (s)", column] for column in ("w/o DAC", "with DAC", "certified")]
    assert [one["ours"] for one in time] == pytest.approx([3.1, 2.2, 1.3])
    gained = cells["III", "Complet. Time (s)", "improvement %"]
    assert gained["ours"] == pytest.approx(100.0 * (1.0 - 2.2 / 3.1))
    assert gained["note"] == "the same way, not reached"
    missed = cells["III", "No. of Polyps Missed", "p"]
    assert missed["ours"] is None  # nobody differs
    assert {cell["kind"] for cell in found["cells"]} == {"predicted"}
    assert found["fitted"] == {}
    assert set(found["pairs"]["travelled_mm"]) == {
        "manual - guided", "manual - certified", "guided - certified",
    }  # fmt: skip


def test_a_task_that_nobody_completes_has_no_time() -> None:
    trials = made_up()
    for key in trials:
        if key.arm == "manual":
            trials[key] = trials[key]._replace(table=TableIII(None, *list(trials[key].table.to_dict().values())[1:]))  # type: ignore[arg-type]
    found = kwok2013_1.evaluated(trials, SMALL)
    assert found["unfinished"] == {"manual": 3, "guided": 0, "certified": 0}
    assert set(found["pairs"]["completion_time_s"]) == {"guided - certified"}
    json.dumps(found, allow_nan=False)


def test_no_figure_of_the_paper_is_in_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each printed one is changed by a fifth, and no bit of ours changes."""
    before = kwok2013_1.evaluated(made_up(), SMALL), kwok2013_2.evaluated(lines(), SMALL)
    rows = {name: PrintedRow(*(changed(one) for one in row)) for name, row in KWOK_III.items()}
    labels = {name: tuple(changed(one) for one in row) for name, row in KWOK_IV.items()}
    for module in (kwok2013_1, kwok_figures):
        monkeypatch.setattr(module, "KWOK_III", rows)
    for module in (kwok2013_2, kwok_figures):
        monkeypatch.setattr(module, "KWOK_IV", labels)
    after = kwok2013_1.evaluated(made_up(), SMALL), kwok2013_2.evaluated(lines(), SMALL)
    for one, two in zip(before, after, strict=True):
        assert ours(one) == ours(two)
        assert one["pairs"] == two["pairs"]
        assert [cell["paper"] for cell in one["cells"]] != [cell["paper"] for cell in two["cells"]]


def lines() -> dict[ArmKey, LabelTrial]:
    """Trials of study II with known figures; a manual hand leaves the last label."""
    trials = {}
    for key in keys(SMALL):
        one = LabelProgress(10.0, 1.0, 6.0 + key.subject, 5.0, 5.0, 2.0, 80.0)
        labels = (one._replace(travel_mm=None), *[one] * 4, LabelProgress() if key.arm == "manual" else one)
        task = first_state(stored_labels().labels)._replace(labels=labels, t=90.0)
        trials[key] = LabelTrial(task, 0.0, 0, 0)
    return trials


def test_study_ii_has_every_printed_cell() -> None:
    found = kwok2013_2.evaluated(lines(), SMALL)
    cells = {(cell["table"], cell["row"], cell["column"]): cell for cell in found["cells"]}
    for row in KWOK_IV.values():
        for one in row:
            cell = cells[one.table, one.row, one.column]
            assert (cell["paper"], cell["paper_sd"]) == (one.value, one.sd)
    assert cells["IV", "Compl. Time (s)", "label 2"]["ours"] == pytest.approx(6.0)
    assert cells["IV", "Trav. Dist. (mm)", "label 1"]["ours"] is None
    assert cells["ours", "labels traced", "manual"]["ours"] == 5.0
    assert cells["ours", "whole task (s)", "manual"]["n"] == 0
    json.dumps(found, allow_nan=False)


def test_a_sweep_changes_one_assumption_of_the_first_subjects_and_quick_has_none() -> None:
    swept = kwok_sweeps.swept_keys(["content", "delay_s"], ["guided"], 4, 12)
    assert [(one.assumption, one.value, one.key.subject) for one in swept] == [
        ("content", 0.35, 0), ("content", 0.35, 1), ("content", 0.95, 0), ("content", 0.95, 1),
        ("delay_s", 0.1, 0), ("delay_s", 0.1, 1), ("delay_s", 0.4, 0), ("delay_s", 0.4, 1),
    ]  # fmt: skip
    key, who = kwok_sweeps.asked_of(swept[6])
    same = subject_of(key)
    assert who.person.delay_s == pytest.approx(2.0 * same.person.delay_s)
    assert replace(who, person=same.person) == same
    assert kwok_sweeps.asked_of(key) == (key, same)
    assert kwok2013_1.evaluated(made_up(), SMALL)["sweeps"] == []
    with pytest.raises(InputError, match="no_such"):
        kwok_sweeps.median_with("no_such", 1.0)


@pytest.mark.parametrize("module", [kwok2013_1, kwok2013_2])
def test_every_swept_assumption_has_other_values(module: Any) -> None:
    for name in module.SWEPT:
        own = Endoscopist().to_dict()[name]
        assert own not in kwok_sweeps.values_of(name), name


def test_a_sweep_has_the_mean_of_its_subjects_beside_that_of_the_study() -> None:
    main, options = made_up(), Options(seed=4, subjects=3)
    keys_ = kwok_sweeps.swept_keys(["content"], kwok2013_1.SWEPT_ARMS, 4, 3)
    none_done = {one: main[one.key]._replace(table=replace(main[one.key].table, polyps_missed=7)) for one in keys_}
    rows = kwok2013_1.evaluated(main, options, none_done)["sweeps"]
    assert [(row["assumption"], row["value"], row["subjects"]) for row in rows] == [
        ("as assumed", None, 2), ("content", 0.35, 2), ("content", 0.95, 2),
    ]  # fmt: skip
    assert [row["arms"]["manual"]["polyps_missed"] for row in rows] == [1.0, 7.0, 7.0]
    assert rows[0]["arms"]["guided"]["completion_time_s"] == pytest.approx(2.1)


def test_arms_are_met_in_all_orders_by_the_same_person() -> None:
    study = keys(Options(seed=1, subjects=6))
    assert len(study) == 18
    met = {tuple(sorted(ARMS, key=lambda arm, s=s: place_of(ArmKey(1, s, arm)))) for s in range(6)}  # type: ignore[misc]
    assert len(met) == 6
    first = [key for key in study if key.subject == 0]
    fastest = [subject_of(key).insert_mm_per_s for key in sorted(first, key=place_of)]
    assert fastest == sorted(fastest)
    assert len({seed_of(key).generate_state(1)[0] for key in study}) == 18


def test_the_papers_figures_agree_as_it_is_said() -> None:
    """Improvements follow from the means, and 0.33 ± 0.65 missed is one, one and two polyps of three people."""
    for row in KWOK_III.values():
        before, after, gained = row.without.value, row.with_dac.value, row.improved.value
        assert before is not None
        assert after is not None
        assert gained == pytest.approx(100.0 * (1.0 - after / before), abs=0.51)
    missed = np.array([1.0, 1.0, 2.0] + 9 * [0.0])
    assert (round(missed.mean(), 2), round(missed.std(ddof=1), 2)) == (0.33, 0.65)
    printed = KWOK_III["polyps_missed"].p.value
    assert round(stats.ttest_rel(missed, 0.0 * missed).pvalue, 3) == printed
    assert round(stats.ttest_ind(missed, 0.0 * missed, equal_var=False).pvalue, 3) == printed
    assert round(stats.ttest_ind(missed, 0.0 * missed).pvalue, 2) == 0.09
    assert min(row.improved.value or 0.0 for row in KWOK_III.values()) == 36.0
    assert sum((row.p.value or 0.0) < 0.05 for row in KWOK_III.values()) == 11
    assert max(mean or 0.0 for mean, _ in kwok_figures.TABLE_IV["angle_error_deg"][1]) == 1.68
    assert max(mean or 0.0 for mean, _ in kwok_figures.TABLE_IV["line_error_mm"][1]) == 0.41


def test_the_printed_p_of_the_times_needs_people_who_are_slow_in_one_arm_alone() -> None:
    """p of 'Complet. Time' by a paired t test of twelve people, for a correlation of their times in both arms."""
    row = KWOK_III["completion_time_s"]
    (a, s), (b, t) = ((one.value or 0.0, one.sd or 0.0) for one in (row.without, row.with_dac))

    def p(correlation: float) -> float:
        spread = math.sqrt(s * s + t * t - 2.0 * correlation * s * t)
        return float(2.0 * stats.t.sf((a - b) * math.sqrt(kwok_figures.SUBJECTS) / spread, kwok_figures.SUBJECTS - 1))

    assert p(-0.67) < 0.00005 < p(-0.68)
    assert stats.ttest_ind_from_stats(a, s, 12, b, t, 12, equal_var=False).pvalue < 0.00005
