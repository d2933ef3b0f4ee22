"""How a study of a paper is run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..kept_trials import KeptTrials

SUBJECTS, TRIALS, LOOKS = 10, 5, 10  # as printed (Li 2007, sections V.D and V.F)
LABORATORIES = 30


@dataclass(frozen=True, eq=False)
class Options:
    """Size and seed of a study.

    looks: trials of target inspection. quick: one set of trials for all laboratories, and no sweeps.
    workers: processes; scheduler: address of a Dask scheduler instead, 'tcp://…'; of the studies of Kwok 2013 alone.
    head: folder of the real head, of the study beyond the papers.
    kept: where results of trials are kept, so that a study that was interrupted goes on.
    progress: called with the completed fraction, 0 … 1; an exception from it ends the study.
    """

    seed: int = 0
    quick: bool = False
    subjects: int = SUBJECTS
    trials: int = TRIALS
    looks: int = LOOKS
    laboratories: int = LABORATORIES
    workers: int = 1
    scheduler: str | None = None
    head: Path | None = None
    kept: KeptTrials | None = None
    progress: Callable[[float], object] = bool
