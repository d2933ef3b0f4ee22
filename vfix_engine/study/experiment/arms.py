"""What the studies of Kwok 2013 share: subjects, the order of their arms, and how arms are compared."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...worlds.snake.settings import ARMS, Arm
from ..endoscopy.endoscopist import Endoscopist
from ..statistics import PairedTest, pairs
from .cells import Cell
from .options import Options
from .paper_figures import Printed
from .trials import seeds

QUICK_SUBJECTS = 4  # the first of them
COMPARED: tuple[tuple[Arm, Arm], ...] = (("manual", "guided"), ("manual", "certified"), ("guided", "certified"))
_ORDERS = tuple(itertools.permutations(range(len(ARMS))))
_TRIAL = 1  # in the names of seeds, behind a subject's number


class ArmKey(NamedTuple):
    """Names one trial: a subject does each arm once, as the paper reads."""

    study: int
    subject: int
    arm: Arm


def keys(options: Options) -> list[ArmKey]:
    """The trials of a study."""
    return [ArmKey(options.seed, *one) for one in itertools.product(range(subjects_of(options)), ARMS)]


def subjects_of(options: Options) -> int:
    """The paper's twelve, or with ``quick`` the first four of them."""
    return min(options.subjects, QUICK_SUBJECTS) if options.quick else options.subjects


def place_of(key: ArmKey) -> int:
    """When a subject meets an arm, 0 first: the six orders in turn, as the paper's is not printed (assumed)."""
    return _ORDERS[key.subject % len(_ORDERS)].index(ARMS.index(key.arm))


def subject_of(key: ArmKey, median: Endoscopist | None = None) -> Endoscopist:
    """The subject of a trial, with the practice of the arms before it; the same person in every arm."""
    drawn = (median or Endoscopist()).drawn(np.random.default_rng(seeds(key.study, key.subject)))
    return drawn.practised(place_of(key))


def seed_of(key: ArmKey) -> np.random.SeedSequence:
    """Of every random number of a trial."""
    return seeds(key.study, key.subject, _TRIAL, ARMS.index(key.arm))


def by_arm(values: Mapping[ArmKey, float | None], subjects: int) -> dict[Arm, Array]:
    """Values (subjects,) of each arm; NaN where there is none."""
    out = {arm: np.full(subjects, np.nan) for arm in ARMS}
    for key, value in values.items():
        out[key.arm][key.subject] = np.nan if value is None else value
    return out


def compared(values: Mapping[Arm, Array], which: Sequence[tuple[Arm, Arm]] = COMPARED) -> dict[str, PairedTest]:
    """Pairs of arms, corrected together; none where fewer than two subjects have both of a pair."""
    able = [pair for pair in which if np.count_nonzero(~np.isnan(values[pair[0]] - values[pair[1]])) >= 2]
    return pairs({str(arm): one for arm, one in values.items()}, able) if able else {}


def mean_cell(printed: Printed, values: Array) -> Cell:
    """The mean over the subjects who have a value beside a printed figure; values: (subjects,), NaN is none."""
    known = values[~np.isnan(values)]
    mean = float(known.mean()) if len(known) else None
    sd = float(known.std(ddof=1)) if len(known) > 1 else None
    return figure_cell(printed, mean, sd, len(known), printed.note)


def figure_cell(printed: Printed, ours: float | None, sd: float | None, n: int, note: str = "") -> Cell:
    """A predicted cell of a printed one; of these studies nothing is fitted."""
    return Cell(
        printed.table, printed.row, printed.column, printed.value, printed.sd, ours, sd, "predicted", n, note
    )  # fmt: skip
