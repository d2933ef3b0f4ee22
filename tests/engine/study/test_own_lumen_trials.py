"""Trials of a user's study in a lumen: a short tube with two polyps, and the file that says them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.tissue_motion import breathing
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.study.diathermy.placing import LABELS
from vfix_engine.study.endoscopy.own_hand import LumenHand, LumenHandAtWork, LumenMotion
from vfix_engine.study.farm import run_all
from vfix_engine.study.own import plugins
from vfix_engine.study.own.evaluation import compared, evaluate
from vfix_engine.study.own.file import MOST_LABELS, StudyFile, TrialName, checked_study, conditions, labels
from vfix_engine.study.own.kinds import kind_of
from vfix_engine.study.own.lumen_trials import LumenSetting
from vfix_engine.study.own.order import order_of
from vfix_engine.study.own.simulated import SimulatedTrials
from vfix_engine.study.own.told_task import ToldTask
from vfix_engine.study.polyps.by_hand import polyps_at
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.offline.script import DriveSpec
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.spec import LumenContours

TUBE: dict[str, Any] = {
    "name": "Tube",
    "seed": 5,
    "trials": 1,
    "routes": [{"case": "tube", "route": "along", "task": "kwok1", "places": "route", "hold_s": 0.5}],
    "subjects": {"simulated": 2},
    "metrics": ["time_s", "completed", "polyps_missed", "travelled_mm", "beyond_bound_mm"],
}


def tube() -> tuple[TriangleMesh, Any, SnakeModel]:
    """A closed cylinder of 160 mm, the lumen in it, and a robot that reaches its end."""
    solid = trimesh.creation.cylinder(15.0, segment=[[0, 0, 0], [0, 0, 160]], sections=24).subdivide_to_size(12.0)
    mesh, snake = TriangleMesh(np.asarray(solid.vertices), np.asarray(solid.faces)), SnakeModel(10, length_mm=14.0)
    return mesh, lumen_between(mesh, (0, 0, 10), (0, 0, 150), snake, DriveSettings(control="view")), snake


def trials_of(**change: Any) -> SimulatedTrials:
    study = checked_study(TUBE | change)
    mesh, lumen, snake = tube()
    at = np.array([[0.0, 0.0, 160.0], [1.0, 0.0, 160.0]])  # at the end: looked at without a bend
    task = replace(polyps_at(at, mesh, lumen.curve, {}, 140.0), hold_s=0.5)
    settings = {
        one: LumenSetting(
            mesh,
            DriveSpec(
                LumenContours.of(lumen),
                snake,
                drive=DriveSettings(control="view", arm=one.arm, step_s=0.01, yield_mm_per_s_per_n=0.0),  # type: ignore[arg-type]
            ),
            task,
            ToldTask.of_route(study.route_of(one)),
        )
        for one in conditions(study)
    }
    return SimulatedTrials(study, settings)


def names_of(study: StudyFile) -> list[TrialName]:
    return [turn.name for turns in order_of(study).values() for turn in turns]


def test_trials_are_the_same_for_the_same_seed_and_are_evaluated_by_arm() -> None:
    trials = trials_of(arms=["manual", "certified"], subjects={"simulated": 1})
    names = names_of(trials.study)
    found = run_all(trials, names)
    assert trials_of()(names[0]) == found[names[0]], "more arms and subjects change no trial"
    assert all(one.name == name for name, one in found.items())
    assert {one.metrics["completed"] for one in found.values()} == {1.0}
    assert {one.metrics["polyps_missed"] for one in found.values()} <= {0.0, 1.0, 2.0}
    assert len({one.metrics["time_s"] for one in found.values()}) == 2
    told = evaluate(trials.study, found)["groups"]["simulated people"]
    assert (told["done"], told["metrics"]["travelled_mm"]["unit"]) == (2, "mm")
    assert set(told["metrics"]["polyps_missed"]["conditions"]) == {"manual", "certified"}


def test_an_oracle_and_an_operator_of_ones_own_do_the_task(monkeypatch: pytest.MonkeyPatch) -> None:
    oracle = trials_of(operator="oracle", arms=["guided"])
    name = names_of(oracle.study)[0]
    assert oracle(name).metrics["polyps_missed"] == 0.0

    def pusher(at: LumenHandAtWork) -> LumenHand:
        return lambda seen: LumenMotion(insert_mm_per_s=20.0)

    class Point:
        name = "pusher"

        def load(self) -> Any:
            return pusher

    monkeypatch.setattr(plugins, "entry_points", lambda group: [Point()] if group == "vfix.lumen_operators" else [])
    found = trials_of(operator="pusher", arms=["guided"])(name).metrics
    assert found["completed"] == 1.0
    assert found["polyps_missed"] > 0.0, "it never stands still"  # type: ignore[operator]


def test_simulated_people_know_still_tissue_alone() -> None:
    trials = trials_of(arms=["guided"])
    condition, setting = next(iter(trials.settings.items()))
    spec = setting.spec
    moving = DriveSpec(spec.lumen, spec.snake, drive=spec.drive, tissue=breathing((0.0, 0.0, 1.0), 5.0, 4.0, 100.0))
    with pytest.raises(InputError, match="still tissue alone"):
        SimulatedTrials(trials.study, {condition: LumenSetting(setting.mesh, moving, setting.task, setting.told)})


def test_a_fingerprint_is_of_lumen_task_people_and_seed() -> None:
    one = trials_of(arms=["guided"]).fingerprints
    assert trials_of(arms=["guided"], subjects={"simulated": 9}, metrics=["time_s"]).fingerprints == one
    for change in ({"seed": 6}, {"person": {"see_deg": 1.0}}, {"operator": "steady"}):
        assert not set(trials_of(arms=["guided"], **change).fingerprints.values()) & set(one.values())


CAVITY = {"case": "cavity", "route": "base", "task": "kwok2"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"plans": [{"case": "head", "plan": "way"}]}, "a study compares one or the other: make two files"),
        ({"modes": ["freehand"]}, "'modes', which is of heads, and 'routes', which is of lumens"),
        ({"routes": [{"case": "tube", "route": "along", "task": "kwok3"}]}, "kwok3"),
        ({"routes": [{"case": "tube", "route": "along", "tusk": "kwok1"}]}, "did you mean 'task'"),
        ({"routes": TUBE["routes"] * 2}, "has a route and its task twice"),
        ({"routes": [CAVITY | {"hold_s": 2.0}]}, "are of polyps, and kwok2 has labels"),
        ({"routes": [CAVITY | {"count": 7}]}, "kwok2 has 6 labels at most"),
        ({"arms": ["guide"]}, "a lumen has no arm 'guide'; did you mean 'guided'"),
        ({"arms": ["plain"]}, "a lumen has no arm 'plain'"),
        ({"views": {"freehand": "outside"}}, "'views' of the study has 'freehand'"),
        ({"person": {"force_n": 1.0}}, "unknown key 'force_n'"),
        ({"person": {"see_deg": -1.0}}, "see_deg of an endoscopist"),
        ({"parameters": "li2007"}, "li2007"),
    ],
)
def test_what_a_file_cannot_say_of_a_lumen_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        checked_study(TUBE | change)


@pytest.mark.parametrize(
    ("metric", "words"),
    [("path_error_mm", "there is no metric 'path_error_mm'"), ("labels_traced", "is of kwok2, a task that no route")],
)
def test_a_metric_of_another_kind_of_study_is_refused(metric: str, words: str) -> None:
    study = checked_study(TUBE | {"metrics": [metric]})
    with pytest.raises(InputError, match=words):
        kind_of(study).check(study)


def test_the_most_labels_are_those_of_the_study() -> None:
    assert MOST_LABELS == LABELS


def test_conditions_are_routes_by_arms_and_the_view_is_the_endoscope() -> None:
    study = checked_study(TUBE | {"routes": [*TUBE["routes"], CAVITY], "views": {"manual": "outside"}})
    found = conditions(study)
    assert [(one.plan, one.mode, one.arm) for one in found[:2]] == [
        ("along", "kwok1", "manual"), ("along", "kwok1", "guided"),
    ]  # fmt: skip
    assert [study.view_of(one) for one in found[:2]] == ["outside", "endoscope"]
    pairs = compared(labels(found))
    assert len(pairs) == 6, "arms of one route; tasks are compared with nothing"
    assert ToldTask.of_route(study.route_of(found[-1])) == ("kwok2", 0, 6, None)
