"""The order in which each subject meets the conditions, so that practice and fatigue fall on all of them alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..experiment.trials import seeds
from .file import StudyCondition, StudyFile, TrialName, conditions, is_simulated

_ORDER = 99  # in the name of the order's seed, where a trial has its mode


class Turn(NamedTuple):
    """position: 1, 2, … of the trial in its subject's session."""

    position: int
    name: TrialName


def rows_of(count: int, design: str) -> list[list[int]]:
    """The rows of a counterbalanced design of ``count`` conditions: each row has each condition once.

    'latin': a cyclic Latin square, in which each condition is in each place once. 'williams': moreover each condition
    follows each other one equally often (Williams 1949): ``count`` rows for an even number, twice as many for an odd.
    """
    if design == "latin":
        return [[(row + place) % count for place in range(count)] for row in range(count)]
    first = [(place + 1) // 2 if place % 2 else (count - place // 2) % count for place in range(count)]
    square = [[(one + row) % count for one in first] for row in range(count)]
    return square if count % 2 == 0 or count == 1 else square + [row[::-1] for row in square]


def order_of(study: StudyFile) -> dict[str, list[Turn]]:
    """The trials of each subject in turn: one condition after the other, all trials of each together.

    Simulated and real people are counterbalanced apart, each by the rows in turn; which condition is which, and which
    row is first, is drawn by the study's seed.
    """
    random = np.random.default_rng(seeds(study.seed, 0, 0, _ORDER))
    every = conditions(study)
    shuffled = [every[place] for place in random.permutation(len(every))]
    rows = rows_of(len(every), study.order)
    rows = [rows[place] for place in random.permutation(len(rows))]
    found: dict[str, list[Turn]] = {}
    for simulated in (True, False):
        for number, code in enumerate(one for one in study.codes if is_simulated(one) == simulated):
            found[code] = _turns(code, [shuffled[place] for place in rows[number % len(rows)]], study.trials)
    return found


def _turns(code: str, sequence: list[StudyCondition], trials: int) -> list[Turn]:
    names = [TrialName(code, condition, trial) for condition in sequence for trial in range(trials)]
    return [Turn(position, name) for position, name in enumerate(names, 1)]
