"""Trials of real people: their recorded runs, scored as those of simulated people are."""

from __future__ import annotations

from typing import Any

from ...runtime.run import Run
from ...worlds.rigid.row import PHASES
from ..metrics import score_run
from .file import StudyFile, TrialName
from .plugins import ScoredTrial
from .results import TrialRecord
from .simulated import measured


def recorded_trial(study: StudyFile, name: TrialName, run: Run, spec: Any, known_as: str) -> TrialRecord:
    """The record of a run of a trial. spec: of the run; known_as: its id, or a hash.

    Raises InputError for a run that cannot be scored.
    """
    score = score_run(run, spec)
    completed = bool((run.column("phase")[-score.samples :] == PHASES.index("done")).any())
    trial = ScoredTrial(run, spec, score, completed)
    return TrialRecord.of(name, "", trial, measured(study, trial), known_as)
