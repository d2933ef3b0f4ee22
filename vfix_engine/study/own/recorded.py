"""Trials of real people: their recorded runs, scored as those of simulated people are."""

from __future__ import annotations

from typing import Any

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from .file import StudyFile, TrialName
from .kinds import kind_of
from .results import TrialRecord
from .simulated import measured


def recorded_trial(
    study: StudyFile, name: TrialName, run: Run, spec: Any, known_as: str, wall: TriangleMesh | None = None
) -> TrialRecord:
    """The record of a run of a trial. spec: of the run; known_as: its id, or a hash; wall: of the lumen, if it is one.

    Raises InputError for a run that cannot be scored.
    """
    trial = kind_of(study).scored(run, spec, wall)
    return TrialRecord.of(name, "", trial.completed, measured(study, trial), known_as)
