"""Trials of a user's study in lumens: the tasks of Kwok 2013 done by simulated people, and the scores of recorded runs.

A simulated person's trial is recorded as any run is and read again, so it is scored as that of a real person.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...runtime.command import BUTTON_CUT
from ...runtime.driver import Driver
from ...runtime.run import Run, RunWriter, digest
from ...worlds.registry import arm_of
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.settings import ARMS
from ...worlds.snake.spec import SnakeSystemSpec
from ...worlds.snake.stepping.state import SnakeState
from ..diathermy.placing import PlacedLabels
from ..endoscopy.endoscopist import Endoscopist
from ..endoscopy.own_hand import hand_named
from ..lumen.score import LumenScore, score_lumen_run
from ..lumen.task_rows import task_figures
from ..person import Person
from ..polyps.task import PolypTask, surface_hash
from .file import StudyCondition, StudyFile, TrialName
from .kinds import TrialKind
from .lumen_work import Hand, LabelWork, LumenMoment, PolypWork, Work
from .plugins import METRICS, Metric, metric_in
from .seeding import subject_random, trial_seed
from .told_task import ToldTask


@dataclass(frozen=True, eq=False)
class LumenSetting:
    """How a condition is driven.

    mesh: the wall of the lumen at rest, LPS mm; spec: the drive in the condition's arm; task: polyps, or labels with
    the bends that trace them; told: the same in few words.
    """

    mesh: TriangleMesh
    spec: DriveSpec
    task: PolypTask | PlacedLabels
    told: ToldTask

    def work(self) -> Work[Any]:
        """The task in the lumen, for simulated people. Raises InputError where the tissue moves."""
        if self.spec.tissue is not None:
            raise InputError("simulated people know still tissue alone: take breathing and waves from the route")
        wall = Wall(self.mesh)
        if isinstance(self.task, PolypTask):
            return PolypWork(self.mesh, wall, self.task)
        return LabelWork(wall, self.task, surface_hash(self.mesh))


@dataclass(frozen=True, eq=False)
class LumenBench:
    """A setting whose work was made."""

    setting: LumenSetting
    work: Work[Any]

    @classmethod
    def of(cls, setting: LumenSetting) -> LumenBench:
        """Make it."""
        return cls(setting, setting.work())


@dataclass(frozen=True, eq=False)
class EndoscopeAtWork:
    """What an operator of a trial is made of.

    setting, work: of the condition; person: the simulated subject in this trial; seed: of every random number.
    """

    setting: LumenSetting
    work: Work[Any]
    person: Endoscopist
    seed: np.random.SeedSequence


LumenOperatorMaker = Callable[[EndoscopeAtWork], Hand]


@dataclass(frozen=True, eq=False)
class ScoredLumenTrial:
    """What a metric sees of a trial.

    figures: of its task by name, of Table III or IV of Kwok 2013. completed: the task was done to its end.
    """

    run: Run
    spec: Any
    score: LumenScore
    completed: bool
    figures: Mapping[str, float | None] = field(default_factory=dict)


def lumen_operator_named(name: str) -> LumenOperatorMaker:
    """An operator of vfix, or the hand of an installed package. Raises InputError for a name that is not known."""
    if name in _OPERATORS:
        return _OPERATORS[name]
    maker = hand_named(name, _OPERATORS)
    return lambda at: at.work.own(at.setting.spec, name, maker, int(at.seed.generate_state(1)[0]))


def lumen_metric_named(name: str) -> Metric:
    """A metric. Raises InputError for a name that is not known, and for an entry point that is no ``Metric``."""
    return metric_in(METRICS, _METRICS, name)


def _person(at: EndoscopeAtWork) -> Hand:
    return at.work.person(at.setting.spec, at.person, at.seed)


_OPERATORS: Mapping[str, LumenOperatorMaker] = {
    "person": _person,
    "steady": lambda at: _person(
        replace(at, person=replace(at.person, person=Person.exact(), see_deg=0.0, see_distance=0.0))
    ),
    "oracle": lambda at: at.work.oracle(at.setting.spec),
}


def _figure(name: str) -> Callable[[ScoredLumenTrial], float | None]:
    return lambda trial: trial.figures.get(name)


_III = {
    "completion_time_s": "s", "travelled_mm": "mm", "polyps_missed": "", "distance_error_mm": "mm",
    "angle_error_deg": "°", "times_missed": "", "deviations": "", "deviation_max_mm": "mm", "deviation_mean_mm": "mm",
    "deviation_time_mean_s": "s", "deviation_time_max_s": "s", "deviation_length_mm": "mm",
}  # fmt: skip
_IV = {
    "labels_traced": "", "labels_missed": "", "label_time_s": "s", "label_angle_error_deg": "°",
    "label_line_error_mm": "mm", "label_distance_mm": "mm",
}  # fmt: skip
_OF_TASK = {"kwok1": _III, "kwok2": _IV}
_METRICS: Mapping[str, Metric] = {name: Metric(unit, _figure(name)) for name, unit in (_III | _IV).items()} | {
    "time_s": Metric("s", lambda trial: trial.score.time_s),
    "path_length_mm": Metric("mm", lambda trial: trial.score.path_length_mm),
    "depth_mm": Metric("mm", lambda trial: trial.score.depth_mm),
    "beyond_bound_mm": Metric("mm", lambda trial: trial.score.beyond_bound_mm),
    "beyond_bound_s": Metric("s", lambda trial: trial.score.beyond_bound_s),
    "force_n": Metric("N", lambda trial: trial.score.force_n.mean),
    "max_force_n": Metric("N", lambda trial: trial.score.force_n.max),
    "held_s": Metric("s", lambda trial: trial.score.held_s),
    "completed": Metric("", lambda trial: float(trial.completed)),
}


def _check(study: StudyFile) -> None:
    """Raises InputError for a metric that is not known, or that no task of the study has."""
    tasks = {route.task for route in study.routes}
    for name in study.metrics:
        lumen_metric_named(name)
        of = [task for task, names in _OF_TASK.items() if name in names]
        if of and not tasks.intersection(of):
            raise InputError(f"the metric '{name}' is of {of[0]}, a task that no route of the study has")


def _drive(study: StudyFile, name: TrialName, bench: LumenBench) -> ScoredLumenTrial:
    condition, setting = name.condition, bench.setting
    person = study.median_endoscopist.drawn(subject_random(study, name)).practised(name.trial)
    words = condition.case, condition.plan, condition.mode, condition.tool
    seed = trial_seed(study, name, ARMS.index(condition.arm), words)
    hand = lumen_operator_named(study.operator)(EndoscopeAtWork(setting, bench.work, person, seed))
    with tempfile.TemporaryDirectory(prefix="vfix-study-") as folder:
        _record(Path(folder) / "run", setting.spec, bench.work, hand)
        run = Run.read(Path(folder) / "run")
    return _scored(run, setting.spec, setting.mesh)


def _record(place: Path, spec: DriveSpec, work: Work[Any], hand: Hand) -> None:
    """Drive a trial to the end of its task, until nothing is left to do, or until its time is over."""
    system = spec.build()
    writer = RunWriter(place, spec, spec.columns, 0)
    driver: Driver[SnakeState] = Driver(system, log=writer)
    try:
        for request in work.requests:
            driver.apply(request)
        progress, snapshot = work.begin(), system.snapshot(driver.state)
        while not work.done(progress) and driver.state.t < work.longest_s:
            act = hand(LumenMoment(system, driver.state, snapshot, progress))
            if act is None:
                break
            snapshot = system.snapshot(driver.act(act))
            progress = work.after(progress, snapshot, bool(act.command.buttons & BUTTON_CUT))
    except BaseException:
        writer.abandon()
        raise
    writer.close()


def _told(study: StudyFile, setting: LumenSetting) -> list[Any]:
    values, arrays = setting.spec.to_parts()
    told = [(name, digest(array)) for name, array in sorted(arrays.items())]
    requests = [repr(getattr(request, "content", request)) for request in setting.work().requests]
    return [study.median_endoscopist, values, requests, surface_hash(setting.mesh), *told]


def _scored(run: Run, spec: Any, wall: TriangleMesh | None) -> ScoredLumenTrial:
    score = score_lumen_run(run, spec, wall)
    return ScoredLumenTrial(run, spec, score, score.completed, task_figures(run, wall))


def _unlike(run: Run, spec: Any, condition: StudyCondition, expected: LumenSetting) -> list[str]:
    wrong = []
    if (arm := arm_of(run.manifest)) != condition.arm:
        wrong.append(f"it was driven {arm or 'outside a lumen'}, not {condition.arm}")
    centre: Array | None = getattr(getattr(spec, "lumen", None), "centre", None)
    other = expected.spec.lumen.centre  # type: ignore[union-attr]  # made of contours
    if centre is None or centre.shape != other.shape or abs(centre - other).max() > 1e-6:
        wrong.append(f"its way is not the route {condition.plan}")
    elif _robot(spec) != _robot(expected.spec):
        wrong.append("its robot, or its bounds, or what bends it are others than the trial's")
    if ToldTask.in_events(run.events) != expected.told:
        wrong.append("its task is another one than the trial's")
    return wrong


def _robot(spec: SnakeSystemSpec) -> tuple[Any, ...]:
    """What a spec has beside the lumen that differs where other parameters were chosen."""
    bounds = spec.drive.bounds(spec.snake.links)
    return spec.snake, spec.drive.control, bounds.most.tolist(), bounds.share.tolist()


LUMENS = TrialKind(_check, lumen_metric_named, lumen_operator_named, LumenBench.of, _drive, _told, _scored, _unlike)
