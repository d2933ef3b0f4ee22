"""Simulated trials of a user's study: the same for the same seed, whoever runs them, with parts of one's own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.study.farm import run_all
from vfix_engine.study.own.file import TrialName, checked_study, conditions
from vfix_engine.study.own.head_trials import spec_of_condition
from vfix_engine.study.own.order import order_of
from vfix_engine.study.own.plugins import arm_named
from vfix_engine.study.own.results import TrialRecord
from vfix_engine.study.own.simulated import SimulatedTrials

PATH = np.array([[0.0, 0, 0], [0, 12, 0], [2, 24, 0]])
OWN = '''
import os, signal
from dataclasses import replace
from pathlib import Path
import numpy as np
from vfix_engine.runtime.command import Command
from vfix_engine.study.own.plugins import Metric

class Puller:
    """Pulls along the path as the plan shows it, with a force of its own, until the end is reached."""
    def __init__(self, at):
        self.path, self.force = at.guide.path, at.person.force_n
    def __call__(self, snapshot):
        if snapshot.length_mm - snapshot.progress_mm <= 0.6:
            return None
        s = snapshot.progress_mm
        ahead = self.path.position(min(s + 2.0, self.path.length)) - self.path.position(s)
        return Command(self.force * ahead / np.linalg.norm(ahead))

class KilledOnce(Puller):
    """As above, but the first process that begins is killed."""
    def __init__(self, at):
        super().__init__(at)
        mark = Path(os.environ["MARK_OF_A_TEST"])
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)

def stiff(scene, settings):
    return scene, replace(settings, gain_mm_per_s_per_n=0.5 * settings.gain_mm_per_s_per_n)

mean_force = Metric("N", lambda trial: float(np.linalg.norm(
    np.column_stack([trial.run.column(f"force_{axis}") for axis in "xyz"]), axis=1).mean()))
'''
POINTS = """
[vfix.operators]
puller = own_parts_of_a_test:Puller
killed = own_parts_of_a_test:KilledOnce
[vfix.arms]
stiff = own_parts_of_a_test:stiff
[vfix.metrics]
mean_force = own_parts_of_a_test:mean_force
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with an operator, an arm and a metric, as pip would install it."""
    (tmp_path / "own_parts_of_a_test.py").write_text(OWN, encoding="utf-8")
    info = tmp_path / "own_parts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own-parts\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(POINTS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    sys.modules.pop("own_parts_of_a_test", None)


def trials_of(**change: Any) -> SimulatedTrials:
    """A study before a wall, at 50 Hz."""
    told = {"name": "Wall", "seed": 5, "trials": 1, "plans": [{"case": "wall", "plan": "bend"}]}
    told |= {"subjects": {"simulated": 2}, "metrics": ["time_s", "path_error_mm", "completed"]} | change
    study = checked_study(told)
    scene, settings = straight_scene(wall(90.0), PATH), ControlSettings(dt_s=0.02)
    specs = {}
    for one in conditions(study):
        driven = (scene, settings) if one.mode == "freehand" else arm_named(one.arm)(scene, settings)
        specs[one] = spec_of_condition(*driven, one.mode)
    return SimulatedTrials(study, specs)


def names_of(trials: SimulatedTrials) -> list[TrialName]:
    return [turn.name for turns in order_of(trials.study).values() for turn in turns]


def test_trials_are_the_same_for_the_same_seed_whatever_the_workers(installed: Path) -> None:
    trials = trials_of()
    names = names_of(trials)
    alone = run_all(trials, names)
    assert run_all(trials_of(), names[::-1], 2) == alone
    assert all(record.name == name for name, record in alone.items())
    assert {one.metrics["completed"] for one in alone.values()} == {1.0}
    times = [one.metrics["time_s"] for one in alone.values()]
    assert len(set(times)) == len(times)
    other = trials_of(seed=6)
    assert other(names[0]).metrics != alone[names[0]].metrics
    # More subjects, trials and conditions leave a trial what it is.
    more = trials_of(subjects={"simulated": 5}, trials=3, arms=["plain", "li2007"])
    assert more(names[0]) == alone[names[0]]


def test_an_operator_an_arm_and_a_metric_of_ones_own(installed: Path) -> None:
    trials = trials_of(
        operator="puller", arms=["plain", "stiff"], modes=["hands-on"], metrics=["mean_force", "time_s"],
        subjects={"simulated": 2},
    )  # fmt: skip
    found = run_all(trials, names_of(trials), 2)
    by_arm: dict[tuple[str, str], TrialRecord] = {(one.subject, one.arm): one for one in found.values()}
    for subject in trials.study.codes:
        plain, stiff = (by_arm[subject, arm].metrics for arm in ("plain", "stiff"))
        assert plain["mean_force"] == pytest.approx(stiff["mean_force"])  # the person's own
        assert stiff["time_s"] == pytest.approx(2.0 * plain["time_s"], rel=0.1)
    assert by_arm["sim001", "plain"].metrics != by_arm["sim002", "plain"].metrics


def test_trials_of_a_killed_worker_run_again(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MARK_OF_A_TEST", str(installed / "killed"))
    trials = trials_of(operator="killed", modes=["hands-on"])
    found = run_all(trials, names_of(trials), 2)
    assert (installed / "killed").exists()
    assert run_all(trials_of(operator="puller", modes=["hands-on"]), names_of(trials)).keys() == found.keys()
    assert all(one.completed for one in found.values())


def test_a_fingerprint_is_of_scene_people_and_seed_and_not_of_their_numbers() -> None:
    one = trials_of().fingerprints
    assert trials_of(subjects={"simulated": 9}, trials=4, metrics=["time_s"]).fingerprints == one
    for change in ({"seed": 6}, {"person": {"force_n": 3.0}}, {"operator": "steady"}):
        assert not set(trials_of(**change).fingerprints.values()) & set(one.values())
    trials = trials_of()
    condition, spec = next(iter(trials.settings.items()))
    moved = replace(spec, scene=replace(spec.scene, base=spec.scene.base + 1e-9))
    assert SimulatedTrials(trials.study, trials.settings | {condition: moved}).fingerprints[condition] != one[condition]
