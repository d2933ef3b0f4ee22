"""Simulated trials of a user's study: each is its name and the study's seed, whoever runs it in whatever order.

A trial is a run as any other, and scored as the recorded run of a real person is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...runtime.versions import versions
from .file import StudyCondition, StudyFile, TrialName
from .kinds import kind_of
from .results import TrialRecord


class SimulatedTrials:
    """``TrialName → TrialRecord``, to be sent to other processes with the settings of all conditions.

    study: the file; settings: by condition, how it is driven: in a head its spec, in a lumen a ``LumenSetting``;
    fingerprints: by condition, see ``TrialRecord``.
    """

    def __init__(self, study: StudyFile, settings: Mapping[StudyCondition, Any]):
        self.study, self.settings = study, dict(settings)
        self.fingerprints = {condition: self._fingerprint(condition) for condition in self.settings}
        self._benches: dict[StudyCondition, Any] = {}

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_benches": {}}

    def __call__(self, name: TrialName) -> TrialRecord:
        """Run one trial. Raises VfixError, such as where the tool cannot start."""
        study, condition, kind = self.study, name.condition, kind_of(self.study)
        bench = self._benches.get(condition)
        if bench is None:
            bench = self._benches[condition] = kind.bench(self.settings[condition])
        trial = kind.drive(study, name, bench)
        return TrialRecord.of(name, self.fingerprints[condition], trial.completed, measured(study, trial))

    def _fingerprint(self, condition: StudyCondition) -> str:
        """What the results of a condition rest on besides its name and the subject's number, as a hash."""
        study = self.study
        told = [study.seed, study.operator, versions()["vfix"], *kind_of(study).told(study, self.settings[condition])]
        return hashlib.sha256(repr(told).encode()).hexdigest()[:16]


def measured(study: StudyFile, trial: Any) -> dict[str, float | None]:
    """The study's metrics of a scored trial; None where it has none, or one that is not finite."""
    found, metric = {}, kind_of(study).metric
    for name in study.metrics:
        value = metric(name).of(trial)
        found[name] = None if value is None or not np.isfinite(value) else float(value)
    return found
