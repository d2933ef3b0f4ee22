"""The parameters that are fitted, each to one printed figure; everything else is assumed or predicted.

The figures are those of Li 2004, of one experienced user, and the inspection of Li 2007. The user is the median person,
with the practice of five trials. The fit has seeds of its own, so every study is of the same people.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, Self

import numpy as np
from scipy.optimize import brentq

from ...errors import InputError
from ...resources import assets_dir
from ..person import Person
from .measured import ErrorSizes, off_path, played, robot_frame_error, true_frame_error
from .paper_figures import LI_2004, LI_2007, printed
from .trials import Mode, Trial, TrialKey, run_trial

SCHEMA = "vfix-study-fit/1"
FILE = assets_dir() / "studies" / "fitted.json"
SEED = 2004  # of the fits
TRIALS = 5  # of the user of Li 2004
USERS = 2  # of whose trials the mean is fitted: fewer leave the chance of five trials in it
ROUNDS = 8
LABORATORIES = 400  # over which the sizes of the error chain are fitted
FIGURES: Mapping[str, float] = {
    "li2004 freehand error_mm": printed(LI_2004["freehand error"]),
    "li2004 freehand time_s": printed(LI_2004["freehand time"]),
    "li2004 robot error_mm": printed(LI_2004["robot error"]),
    "li2004 robot time_s": printed(LI_2004["robot time"]),
    "li2007 inspection true_error_mm": printed(LI_2007["inspection tracker mean"]),
}
SERVO_MM = printed(LI_2007["I hands-on error"])  # of the variant with a servo

Size = Literal["shift_mm", "turn_rad"]
Job = tuple[TrialKey, Person, str]  # a trial, who does it, and the preset
Run = Callable[[list[Job]], list[Trial]]


@dataclass(frozen=True)
class Fitted:
    """Median person and sizes of errors that give the figures; ``reached``: what they give."""

    person: Person
    sizes: ErrorSizes
    reached: Mapping[str, float]

    @classmethod
    def stored(cls) -> Self:
        """The stored fit, to ``FIGURES``.

        Raises:
            InputError: it was fitted to other figures.
        """
        told = json.loads(FILE.read_text(encoding="utf-8"))
        if told["figures"] != dict(FIGURES):
            raise InputError(f"{FILE.name} is fitted to other figures; run scripts/fit_studies.py")
        return cls(Person(**told["person"]), ErrorSizes(**told["sizes"]), told["reached"])

    def to_file(self) -> dict[str, Any]:
        """Content of the stored file."""
        named = {"person": asdict(self.person), "sizes": asdict(self.sizes), "reached": dict(self.reached)}
        return {"schema": SCHEMA, "figures": dict(FIGURES), **named}

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Fitted parameters: value, figure that it was fitted to, the paper's value of it, and what it reaches."""
        values = {
            "li2004 freehand error_mm": ("see_depth_mm", self.person.see_depth_mm),
            "li2004 freehand time_s": ("hand_speed_mm_per_s", self.person.hand_speed_mm_per_s),
            "li2004 robot time_s": ("force_n", self.person.force_n),
            "li2004 robot error_mm": ("turn_rad", self.sizes.turn_rad),
            "li2007 inspection true_error_mm": ("shift_mm", self.sizes.shift_mm),
        }
        return {
            name: {"value": value, "figure": figure, "paper": FIGURES[figure], "reached": self.reached[figure]}
            for figure, (name, value) in values.items()
        }


def serially(jobs: list[Job]) -> list[Trial]:
    """Run trials one after another."""
    return [run_trial(*job) for job in jobs]


def fit(figures: Mapping[str, float] = FIGURES, run: Run = serially) -> Fitted:
    """Fit the five parameters.

    Raises:
        InputError: an assumed size alone is larger than a figure.
    """
    person, reached, hands = _fit_person(figures, run)
    looked = run([(TrialKey(SEED, 0, 0, "inspection"), person, "li2007")])
    sizes = ErrorSizes(shift_mm=0.0, turn_rad=0.0)
    sizes = _solve("shift_mm", 3.0, sizes, figures["li2007 inspection true_error_mm"], looked)
    turned = _solve("turn_rad", 0.3, sizes.by_encoders(), figures["li2004 robot error_mm"], hands[:1])
    sizes = replace(sizes, turn_rad=turned.turn_rad)
    reached["li2007 inspection true_error_mm"] = _expected(sizes, looked)
    reached["li2004 robot error_mm"] = _expected(turned, hands[:1])
    return Fitted(person, sizes, reached)


def _fit_person(figures: Mapping[str, float], run: Run) -> tuple[Person, dict[str, float], list[Trial]]:
    """Depth perception, speed and force: the best of some rounds, since contacts make the figures jump.

    The trials returned are those of hands-on.
    """
    names = ("li2004 freehand error_mm", "li2004 freehand time_s", "li2004 robot time_s")
    person, best, found = Person(), math.inf, None
    for _ in range(ROUNDS):
        free, hands = _by_user(run, person, "freehand"), _by_user(run, person, "hands-on")
        now = dict(zip(names, (_mean([off_path(one.tip) for one in free]), _time(free), _time(hands)), strict=True))
        ratios = [figures[name] / now[name] for name in names]
        off = max(abs(math.log(ratio)) for ratio in ratios)
        if off < best:
            best, found = off, (person, now, hands)
        person = replace(
            person,
            see_depth_mm=person.see_depth_mm * ratios[0],
            hand_speed_mm_per_s=person.hand_speed_mm_per_s / ratios[1],
            force_n=person.force_n / ratios[2],
        )
    assert found is not None
    return found


def with_servo(sizes: ErrorSizes, trials: list[Trial], study: int, figure: float = SERVO_MM) -> ErrorSizes:
    """The variant whose servo leaves the printed error of hands-on in the robot's frame."""

    def left(servo_mm: float) -> float:
        changed = replace(sizes, servo_mm=servo_mm)
        return _mean([robot_frame_error(one, changed, study) for one in trials]) - figure

    return replace(sizes, servo_mm=float(brentq(left, 1e-3, 5.0, xtol=1e-4)))


def _by_user(run: Run, person: Person, mode: Mode) -> list[Trial]:
    every = [TrialKey(SEED, user, trial, mode) for user in range(USERS) for trial in range(TRIALS)]
    return run([(key, person.practised(key.trial), "li2004") for key in every])


def _solve(name: Size, most: float, sizes: ErrorSizes, figure: float, trials: list[Trial]) -> ErrorSizes:
    """The sizes whose expected mean error, over many laboratories, is a figure."""

    def off(value: float) -> float:
        return _expected(_changed(sizes, name, value), trials) - figure

    least = off(0.0)
    if least > 0.0:
        raise InputError(
            f"{name} cannot be fitted: without it the expected error is {least + figure:.3f} mm already, more than "
            f"{figure} mm; an assumed size of {asdict(sizes)} is too large"
        )
    return _changed(sizes, name, float(brentq(off, 0.0, most, xtol=1e-6)))


def _changed(sizes: ErrorSizes, name: Size, value: float) -> ErrorSizes:
    return replace(sizes, shift_mm=value) if name == "shift_mm" else replace(sizes, turn_rad=value)


def _expected(sizes: ErrorSizes, trials: list[Trial]) -> float:
    """Mean error over laboratories; some samples of each trial stand for all."""
    parts = [_thinned(one) for one in trials]
    behind = [played(one, sizes)[:: _step(one)] for one in trials]
    values = [
        float(true_frame_error(part, sizes, SEED + 1 + number, tip).mean())
        for number in range(LABORATORIES)
        for part, tip in zip(parts, behind, strict=True)
    ]
    return math.fsum(values) / len(values)


def _step(trial: Trial) -> int:
    return max(1, len(trial.tip) // 60)


def _thinned(trial: Trial) -> Trial:
    step = _step(trial)
    arrays = ("tip", "q", "force", "error_mm", "progress_mm", "rows")
    return replace(trial, **{name: getattr(trial, name)[::step] for name in arrays})


def _time(trials: list[Trial]) -> float:
    return float(np.mean([one.time_s for one in trials]))


def _mean(errors: list[np.ndarray]) -> float:
    """Mean over trials of the mean over samples (Li 2007, section V.F.1)."""
    return float(np.mean([one.mean() for one in errors]))
