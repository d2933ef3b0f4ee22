"""Simulated trials of a user's study: each is its name and the study's seed, whoever runs it in whatever order.

A trial is a run as any other, recorded in memory and scored as the recorded run of a real person is.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...runtime.command import COMMAND_COLUMNS
from ...runtime.control_mode import FREEHAND, TELEOPERATED, Control
from ...runtime.run import Run, digest
from ...runtime.versions import versions
from ...worlds.freehand.spec import FreehandSpec, of_free_hand
from ...worlds.freehand.system import FreehandSystem
from ...worlds.rigid.dry_run import dry_run
from ...worlds.rigid.scene import Scene
from ...worlds.rigid.spec import RigidSpec, SceneSpec
from ...worlds.rigid.system import RigidSystem
from ..drive import drive
from ..experiment.trials import MODES, seeds
from ..metrics.score import score_run
from ..operator import Guide
from .file import StudyCondition, StudyFile, TrialName
from .plugins import HandAtWork, ScoredTrial, metric_named, operator_named
from .results import TrialRecord

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


class SimulatedTrials:
    """``TrialName → TrialRecord``, to be sent to other processes with the scenes of all conditions.

    study: the file; specs: by condition, how it is driven; fingerprints: by condition, see ``TrialRecord``.
    """

    def __init__(self, study: StudyFile, specs: Mapping[StudyCondition, Spec]):
        self.study, self.specs = study, dict(specs)
        self.fingerprints = {condition: self._fingerprint(condition) for condition in self.specs}
        self._benches: dict[StudyCondition, Bench] = {}

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_benches": {}}

    def __call__(self, name: TrialName) -> TrialRecord:
        """Run one trial. Raises VfixError, such as where the tool cannot start."""
        study, condition = self.study, name.condition
        bench = self._benches.get(condition)
        if bench is None:
            bench = self._benches[condition] = Bench.of(self.specs[condition])
        operator, log = operator_named(study.operator)(self._hand(name, bench)), MemoryLog()
        done = drive(bench.system, operator, log=log)
        trial = _scored(log.run(bench, condition), bench.spec, done.finished)
        return TrialRecord.of(name, self.fingerprints[condition], trial, measured(study, trial))

    def _hand(self, name: TrialName, bench: Bench) -> HandAtWork:
        study, condition, settings = self.study, name.condition, self.specs[name.condition].control
        subject = study.codes.index(name.subject)
        drawn = study.median.drawn(np.random.default_rng(seeds(study.seed, subject)))
        others = "\0".join((condition.case, condition.plan, condition.arm, condition.tool))
        words = np.frombuffer(hashlib.sha256(others.encode()).digest()[:8], dtype="<u4").tolist()
        seed = seeds(study.seed, subject, name.trial + 1, MODES.index(condition.mode), *words)
        axes = bench.system.scene.base[:3, :3] if condition.mode == TELEOPERATED else None
        return HandAtWork(bench.guide, drawn.practised(name.trial), bench.system.scene.tool, settings, seed, axes)

    def _fingerprint(self, condition: StudyCondition) -> str:
        """What the results of a condition rest on besides its name and the subject's number, as a hash."""
        study, spec = self.study, self.specs[condition]
        values, arrays = replace(spec, scene=replace(spec.scene, fixtures=())).to_parts()
        fixtures = pickle.dumps(spec.scene.fixtures)  # of a user's own class, too
        told: list[Any] = [study.seed, study.operator, study.median, spec.world, values, fixtures, versions()["vfix"]]
        told += [(name, digest(array)) for name, array in sorted(arrays.items())]
        return hashlib.sha256(repr(told).encode()).hexdigest()[:16]


def spec_of_condition(scene: Scene, settings: ControlSettings, mode: str) -> Spec:
    """How a scene is driven in a mode."""
    kept = SceneSpec.of(scene)
    return FreehandSpec(kept, of_free_hand(settings)) if mode == FREEHAND else RigidSpec(kept, settings)


def measured(study: StudyFile, trial: ScoredTrial) -> dict[str, float | None]:
    """The study's metrics of a trial; None where it has none, or one that is not finite."""
    found = {}
    for name in study.metrics:
        value = metric_named(name).of(trial)
        found[name] = None if value is None or not np.isfinite(value) else float(value)
    return found


def _scored(run: Run, spec: Spec, completed: bool) -> ScoredTrial:
    return ScoredTrial(run, spec, score_run(run, spec), completed)


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
        } | Control(condition.mode, "rate").labels()  # fmt: skip
        return Run(manifest, {}, np.array(self._ticks).reshape(len(self._ticks), len(columns)), (), True, 0)
