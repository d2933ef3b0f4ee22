"""The seeds of a study's simulated people and their trials, each of what it is named by alone."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from ..experiment.trials import seeds
from .file import StudyFile, TrialName


def subject_random(study: StudyFile, name: TrialName) -> np.random.Generator:
    """What a trial's simulated subject is drawn by, the same in all trials."""
    return np.random.default_rng(seeds(study.seed, study.codes.index(name.subject)))


def trial_seed(study: StudyFile, name: TrialName, way: int, words: Sequence[str]) -> np.random.SeedSequence:
    """Of every random number of a trial. way: the number of its mode or arm; words: of what else its condition is."""
    numbers = np.frombuffer(hashlib.sha256("\0".join(words).encode()).digest()[:8], dtype="<u4").tolist()
    return seeds(study.seed, study.codes.index(name.subject), name.trial + 1, way, *numbers)
