"""A user's own study: what its file may say, its order, its results and their statistics."""

from __future__ import annotations

import itertools
from collections import Counter
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from vfix_engine.errors import InputError
from vfix_engine.study.own import plugins
from vfix_engine.study.own.evaluation import compared, evaluate
from vfix_engine.study.own.file import TrialName, checked_study, conditions, labels, read_study
from vfix_engine.study.own.order import order_of, rows_of
from vfix_engine.study.own.plugins import Metric, arm_named, metric_named, operator_named
from vfix_engine.study.own.questionnaire import AnsweredTlx
from vfix_engine.study.own.results import StudyResults, TrialRecord, done_of
from vfix_engine.study.statistics import least_subjects, power

SMALL: dict[str, Any] = {
    "name": "Small",
    "seed": 3,
    "trials": 2,
    "plans": [{"case": "head", "plan": "way"}],
    "subjects": {"simulated": 3, "codes": ["P01", "P02"]},
    "metrics": ["time_s", "contacts"],
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"metrcs": []}, "unknown key 'metrcs'; did you mean 'metrics'"),
        (
            {"plans": [{"case": "a", "plam": "b"}]},
            r"\[\[plans\]\] of the study has the unknown key 'plam'; did",
        ),
        ({"subjects": {"simulate": 3}}, "did you mean 'simulated'"),
        ({"person": {"tremor": 1.0}}, "did you mean 'tremor_mm'"),
        ({"person": {"tremor_mm": -1.0}}, "tremor_mm of a person is -1"),
        ({"plans": []}, "length >= 1"),
        ({"trials": 0}, "`int` >= 1"),
        ({"modes": ["flying"]}, "flying"),
        ({"modes": ["freehand", "freehand"]}, "'modes' of the study names something twice"),
        ({"order": "random"}, "random"),
        ({"subjects": {}}, "has no subjects"),
        ({"subjects": {"codes": ["Jane Doe"]}}, "code 'Jane Doe' cannot be used"),
        ({"subjects": {"codes": ["sim1"]}}, "cannot be used"),
        ({"subjects": {"codes": ["p1", "P1"]}}, "one code"),
        ({"subjects": {"simulated": 100_000}, "trials": 1000}, "more than 1,000,000 trials"),
        ({"seed": -1}, ">= 0"),
        ({"rate_hz": 10}, ">= 50"),
    ],
)
def test_what_a_file_cannot_say_is_refused_with_what_to_do(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        checked_study(SMALL | change)


def test_a_file_is_read_and_what_is_no_file_of_a_study_is_told(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text('name = "N"\nplans = [{case = "a", plan = "b"}]\nsubjects = {simulated = 2}\n', encoding="utf-8")
    assert read_study(file).codes == ("sim001", "sim002")
    for text, words in (("name = ", "no TOML"), ('name = "N"\n', "lacks field `plans`|lacks")):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_study(file)
    with pytest.raises(InputError, match="cannot be read"):
        read_study(tmp_path / "none.toml")


def test_conditions_cross_and_a_free_hand_has_no_arm() -> None:
    study = checked_study(SMALL | {"arms": ["plain", "li2007"], "modes": ["freehand", "hands-on"]})
    found = [(one.mode, one.arm) for one in conditions(study)]
    assert found == [("freehand", "none"), ("hands-on", "plain"), ("hands-on", "li2007")]
    assert list(labels(conditions(study)).values()) == ["freehand", "hands-on, plain", "hands-on, li2007"]
    assert list(labels(conditions(checked_study(SMALL))).values()) == ["freehand", "hands-on", "teleoperated"]


def test_pairs_differ_in_one_thing() -> None:
    study = checked_study(SMALL | {"arms": ["plain", "li2007"]})
    assert compared(labels(conditions(study))) == [
        ("freehand", "hands-on, plain"),
        ("freehand", "hands-on, li2007"),
        ("freehand", "teleoperated, plain"),
        ("freehand", "teleoperated, li2007"),
        ("hands-on, plain", "hands-on, li2007"),
        ("hands-on, plain", "teleoperated, plain"),
        ("hands-on, li2007", "teleoperated, li2007"),
        ("teleoperated, plain", "teleoperated, li2007"),
    ]


@pytest.mark.parametrize("count", range(1, 10))
def test_every_condition_follows_every_other_equally_often(count: int) -> None:
    """Williams 1949."""
    rows = rows_of(count, "williams")
    assert all(sorted(row) == list(range(count)) for row in rows)
    places = Counter((place, one) for row in rows for place, one in enumerate(row))
    assert len(set(places.values())) == 1
    assert len(places) == count**2
    follow = Counter(pair for row in rows for pair in itertools.pairwise(row))
    assert len(follow) == count * (count - 1)
    assert len(set(follow.values())) <= 1


def test_a_latin_square_has_each_condition_in_each_place_once() -> None:
    rows = np.array(rows_of(5, "latin"))
    assert all(sorted(column) == list(range(5)) for column in rows.T)


def test_the_order_is_of_the_seed_and_counterbalances_people_apart() -> None:
    study = checked_study(SMALL | {"subjects": {"simulated": 6, "codes": [f"P{n}" for n in range(6)]}})
    order = order_of(study)
    assert order == order_of(study)
    assert order != order_of(msgspec.structs.replace(study, seed=4))
    for people in ("sim", "P"):
        first = Counter(turns[0].name.condition for code, turns in order.items() if code.startswith(people))
        assert sorted(first.values()) == [2, 2, 2]
    turns = order["P3"]
    assert [turn.position for turn in turns] == list(range(1, 7))
    assert [turn.name.trial for turn in turns] == [0, 1] * 3
    assert turns[0].name.condition == turns[1].name.condition


def record(name: TrialName, value: float, fingerprint: str = "f") -> TrialRecord:
    condition = name.condition
    return TrialRecord(
        "vfix-study-trial/1", name.subject, *condition, name.trial + 1, True,
        {"time_s": value, "contacts": None}, fingerprint,
    )  # fmt: skip


def test_results_are_read_again_and_those_of_another_scene_are_not_of_the_study(tmp_path: Path) -> None:
    study = checked_study(SMALL)
    names = [turn.name for turns in order_of(study).values() for turn in turns]
    results = StudyResults(tmp_path / "results")
    for number, name in enumerate(names[:4]):
        results.write(record(name, float(number), "old" if number == 2 else "new"))
    found = StudyResults(tmp_path / "results").read(names)
    assert found == {name: record(name, float(n), "old" if n == 2 else "new") for n, name in enumerate(names[:4])}
    new = dict.fromkeys(conditions(study), "new")
    assert list(done_of(study, found, new)) == [names[0], names[1], names[3]]
    more = msgspec.structs.replace(study, metrics=("time_s", "held_s"))
    assert done_of(more, found) == {}  # lacks a metric
    assert not list((tmp_path / "results").rglob(".vfix-*"))
    next((tmp_path / "results" / "trials").iterdir()).write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="delete it to run the trial again"):
        results.read(names)


def test_subjects_are_averaged_and_paired_and_what_is_missing_is_told() -> None:
    study = checked_study(SMALL | {"modes": ["freehand", "hands-on"]})
    free, hands = conditions(study)
    done = {}
    for subject, code in enumerate(study.codes):
        for trial in range(2):
            for condition, base in ((free, 20.0 + 3.0 * subject), (hands, 10.0 + subject**2)):
                name = TrialName(code, condition, trial)
                done[name] = record(name, base + trial)
    del done[TrialName("P02", hands, 1)]
    missed = TrialName("P02", hands, 1)
    found = evaluate(study, done, reasons={missed: "ill"})
    simulated, people = found["groups"]["simulated people"], found["groups"]["people"]
    assert (simulated["done"], simulated["planned"], people["done"], people["planned"]) == (12, 12, 7, 8)
    assert people["missing"] == [{"subject": "P02", "condition": "hands-on", "trial": 2, "reason": "ill"}]
    time = simulated["metrics"]["time_s"]
    assert time["conditions"]["freehand"]["mean"] == pytest.approx(23.5)
    differences = np.array([20.5, 23.5, 26.5]) - np.array([10.5, 11.5, 14.5])
    test = time["pairs"]["freehand - hands-on"]
    assert (test["n"], test["mean"]) == (3, pytest.approx(differences.mean()))
    assert test["d_z"] == pytest.approx(differences.mean() / differences.std(ddof=1))
    assert people["metrics"]["time_s"]["subjects"]["hands-on"][1] == pytest.approx(10.0 + 16.0)
    assert simulated["metrics"]["contacts"]["pairs"] == {}
    assert simulated["metrics"]["contacts"]["conditions"]["freehand"]["n"] == 0
    assert msgspec.json.decode(msgspec.json.encode(found)) == found


def test_names_that_are_not_known_are_told_with_the_nearest() -> None:
    for named, words in ((metric_named, "time_s"), (operator_named, "person"), (arm_named, "li2007")):
        with pytest.raises(InputError, match=f"did you mean '{words}'"):
            named(words[:-1] + "x")
    with pytest.raises(InputError, match="there are "):
        metric_named("zzzzzzzz")


def test_an_entry_point_that_cannot_be_loaded_or_is_no_metric_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [EntryPoint(name, value, "vfix.metrics") for name, value in (
        ("gone", "no_such_module_here:of"), ("wrong", "math:pi"), ("mine", "tests.engine.study.test_own_study:MINE"),
    )]  # fmt: skip
    monkeypatch.setattr(plugins, "entry_points", lambda group: points if group == "vfix.metrics" else [])
    with pytest.raises(InputError, match="'gone' cannot be loaded: ModuleNotFoundError"):
        metric_named("gone")
    with pytest.raises(InputError, match="is no Metric"):
        metric_named("wrong")
    assert metric_named("mine").unit == "N"


MINE = Metric("N", lambda trial: 1.0)


def test_subjects_for_a_power_are_the_fewest() -> None:
    assert least_subjects(0.5, 0.8) == 34  # R: power.t.test(delta = 0.5, sd = 1, power = 0.8, type = "paired")
    for effect, wanted in ((1.0, 0.9), (0.2, 0.8), (-0.8, 0.95)):
        count = least_subjects(effect, wanted)
        assert power(effect, count) >= wanted > power(effect, count - 1)
    with pytest.raises(InputError, match="power between 0 and 1"):
        least_subjects(0.0, 0.8)


def test_answers_and_reasons_are_kept_by_subject_and_condition(tmp_path: Path) -> None:
    study = checked_study(SMALL | {"modes": ["freehand", "hands-on"], "questionnaire": "nasa-tlx"})
    free, hands = conditions(study)
    results = StudyResults(tmp_path)
    given = {("P01", free): 60, ("P01", hands): 20, ("P02", free): 50, ("P02", hands): 30}
    for (code, condition), rating in given.items():
        results.write_answer(AnsweredTlx.of(code, condition, (rating, rating, 0, 0, 0, 5)))
    name = TrialName("P02", hands, 1)
    results.write_skip(name, "ill")
    answers, reasons = results.read_answers(study.subjects.codes, conditions(study)), results.read_reasons([name])
    assert {(one.subject, one.condition): one.ratings[0] for one in answers} == given
    assert reasons == {name: "ill"}

    people = evaluate(study, {}, answers, reasons)["groups"]["people"]
    assert people["questionnaire"]["nasa_tlx_mental"]["subjects"] == {
        "freehand": [60.0, 50.0],
        "hands-on": [20.0, 30.0],
    }
    raw = people["questionnaire"]["nasa_tlx"]
    assert raw["subjects"]["freehand"] == [125 / 6, 105 / 6]
    pair = raw["pairs"]["freehand - hands-on"]
    assert (pair["n"], pair["mean"]) == (2, pytest.approx(10.0))
    assert [one["reason"] for one in people["missing"] if one["subject"] == "P02"] == ["", "", "", "ill"]
    assert "questionnaire" not in evaluate(study, {}, answers)["groups"]["simulated people"]

    results.forget(name)
    results.forget_answer("P01", free)
    assert results.read_reasons([name]) == {}
    assert len(results.read_answers(study.subjects.codes, conditions(study))) == 3
    (file,) = (tmp_path / "answers").glob("P01*")
    file.write_text(file.read_text().replace("20", "21"))
    with pytest.raises(InputError, match="cannot be read"):
        results.read_answers(["P01"], [hands])
