"""Trials of a user's study in heads: a plan driven by a simulated person, and the scores of recorded runs."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...geometry.mesh import TriangleMesh
from ...runtime.command import COMMAND_COLUMNS
from ...runtime.control_mode import FREEHAND, TELEOPERATED, Control
from ...runtime.run import Run, digest
from ...runtime.versions import versions
from ...worlds.freehand.spec import FreehandSpec, of_free_hand
from ...worlds.freehand.system import FreehandSystem
from ...worlds.rigid.dry_run import dry_run
from ...worlds.rigid.row import PHASES
from ...worlds.rigid.scene import Scene
from ...worlds.rigid.scene_parts import tool_parts
from ...worlds.rigid.spec import RigidSpec, SceneSpec
from ...worlds.rigid.system import RigidSystem
from ..drive import drive
from ..experiment.trials import MODES
from ..metrics.score import score_run
from ..operator import Guide
from .file import StudyCondition, StudyFile, TrialName
from .kinds import TrialKind
from .plugins import HandAtWork, ScoredTrial, metric_named, operator_named
from .seeding import subject_random, trial_seed

Spec = RigidSpec | FreehandSpec


@dataclass(frozen=True, eq=False)
class _BuiltRigid(RigidSpec):
    """A spec whose system was built before: scoring a run would build its tree of the anatomy anew."""

    system: RigidSystem

    def build(self) -> RigidSystem:
        return self.system


@dataclass(frozen=True, eq=False)
class Bench:
    """A condition as it is driven: the system, and what the plan shows to a person."""

    system: RigidSystem | FreehandSystem
    spec: Spec
    guide: Guide

    @classmethod
    def of(cls, spec: Spec) -> Bench:
        """Build the system. Raises VfixError."""
        system = spec.build()
        scene, settings = system.scene, spec.control
        assert scene.path is not None  # every plan of a study has one
        guide = Guide.of(scene.path, dry_run(scene, settings))
        built = _BuiltRigid(spec.scene, settings, system) if isinstance(system, RigidSystem) else spec
        return cls(system, built, guide)


def _check(study: StudyFile) -> None:
    for name in study.metrics:
        metric_named(name)


def _drive(study: StudyFile, name: TrialName, bench: Bench) -> ScoredTrial:
    operator, log = operator_named(study.operator)(_hand(study, name, bench)), MemoryLog()
    done = drive(bench.system, operator, log=log)
    return _scored(log.run(bench, name.condition), bench.spec, done.finished)


def _hand(study: StudyFile, name: TrialName, bench: Bench) -> HandAtWork:
    condition, settings = name.condition, bench.spec.control
    person = study.median.drawn(subject_random(study, name)).practised(name.trial)
    words = condition.case, condition.plan, condition.arm, condition.tool
    seed = trial_seed(study, name, MODES.index(condition.mode), words)
    axes = bench.system.scene.base[:3, :3] if condition.mode == TELEOPERATED else None
    return HandAtWork(bench.guide, person, bench.system.scene.tool, settings, seed, axes)


def _told(study: StudyFile, spec: Spec) -> list[Any]:
    values, arrays = replace(spec, scene=replace(spec.scene, fixtures=())).to_parts()
    fixtures = pickle.dumps(spec.scene.fixtures)  # of a user's own class, too
    told = [(name, digest(array)) for name, array in sorted(arrays.items())]
    return [study.median, spec.world, values, fixtures, *told]


def spec_of_condition(scene: Scene, settings: ControlSettings, mode: str) -> Spec:
    """How a scene is driven in a mode."""
    kept = SceneSpec.of(scene)
    return FreehandSpec(kept, of_free_hand(settings)) if mode == FREEHAND else RigidSpec(kept, settings)


class MemoryLog:
    """A driver's log that keeps the run in memory."""

    def __init__(self) -> None:
        self._ticks: list[Array] = []

    def tick(self, line: Array) -> None:
        """Keep one step; the array is reused by the driver."""
        self._ticks.append(line.copy())

    def event(self, kind: str, content: Any) -> None:
        """Nothing is asked for in a trial but its steps."""
        raise NotImplementedError(f"a trial has no events, but a {kind} came")

    def run(self, bench: Bench, condition: StudyCondition) -> Run:
        """The run, with the fields of a manifest that a score reads; its spec is given beside it."""
        columns = [*COMMAND_COLUMNS, *bench.system.row_layout]
        manifest = {
            "world": bench.spec.world, "columns": columns, "spec": {}, "spec_not_written": "it is in memory",
            "versions": versions(), "seed": None, "clock": "driven", "preset": None,
        } | Control(condition.mode, "rate").labels()  # type: ignore[arg-type]  # fmt: skip
        return Run(manifest, {}, np.array(self._ticks).reshape(len(self._ticks), len(columns)), (), True, 0)


def _scored(run: Run, spec: Spec, completed: bool) -> ScoredTrial:
    return ScoredTrial(run, spec, score_run(run, spec), completed)


def _scored_recorded(run: Run, spec: Any, wall: TriangleMesh | None) -> ScoredTrial:
    score = score_run(run, spec)
    completed = bool((run.column("phase")[-score.samples :] == PHASES.index("done")).any())
    return ScoredTrial(run, spec, score, completed)


def _unlike(run: Run, spec: Any, condition: StudyCondition, expected: Spec) -> list[str]:
    wrong = []
    if run.mode != condition.mode:
        wrong.append(f"it was driven {run.mode}, not {condition.mode}")
    scene = getattr(spec, "scene", None)
    if scene is None or scene.path_points is None or not _same(scene.path_points, expected.scene.path_points):
        wrong.append(f"its path is not that of the plan {condition.plan}")
    elif tool_parts(scene.tool_itself()) != tool_parts(expected.scene.tool_itself()):
        wrong.append(f"its tool is {scene.tool_itself().name}, another one than the trial's")
    elif scene.printed != expected.scene.printed:
        wrong.append(f"its program is not that of the arm {condition.arm}")
    return wrong


def _same(one: Any, other: Any) -> bool:
    return one.shape == other.shape and bool(abs(one - other).max() < 1e-6)


HEADS = TrialKind(_check, metric_named, operator_named, Bench.of, _drive, _told, _scored_recorded, _unlike)
