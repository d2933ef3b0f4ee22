"""What one simulated person of Kwok 2013 is: parameters, each with its source, or said to be assumed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ..person import Person

# Standard deviation over people of the logarithm of a parameter: all assumed, but that people differ is not.
SPREADS: Mapping[str, float] = {
    "camera_mm_per_s": 0.25, "approach_s": 0.20, "insert_mm_per_s": 0.25, "cut_mm_per_s": 0.25, "see_deg": 0.30,
    "see_distance": 0.30, "yield_mm_per_s_per_n": 0.30, "content": 0.10, "patience_s": 0.25, "careful_n": 0.25,
}  # fmt: skip
_PRACTISED_ERRORS = ("see_deg", "see_distance", "approach_s")
_PRACTISED_SPEEDS = ("camera_mm_per_s", "insert_mm_per_s", "cut_mm_per_s")


@dataclass(frozen=True)
class Endoscopist:
    """Parameters of a simulated person who steers a camera; the defaults are medians over people.

    person: the hand of every study here: delay, tremor, lag, noise of a motion, drift of what is seen, and learning
        (``Person`` has their sources).
    camera_mm_per_s: fastest motion of the camera across its picture, by a hand of the same speed (assumed).
    approach_s: time constant with which what is off the wanted place of the picture is taken away, as by a view that
        turns by ``DEG_PER_MM``: slower as the rest gets less, so that a motion takes a time with the logarithm of
        distance over tolerance, the form of Fitts 1954. The size is assumed: with 0.6 s hands of this delay oscillate.
    insert_mm_per_s: at which the robot is inserted (assumed). cut_mm_per_s: at which a line is followed (assumed).
    see_deg: rms error of a seen direction (assumed). see_distance: that of a distance judged by size, relative
        (assumed). Both drift with ``person.drift_s``.
    yield_mm_per_s_per_n: how fast the hand on the stylus goes where a force pushes it, the same as the admittance of
        ``DriveSettings`` (assumed). 0: forces change nothing but where they are minded (``careful_n``).
    careful_n: guidance that is felt, at which a person stops to insert and lets the hand be led (assumed).
    content: value of the marker, from 0, blue, to 1, bright yellow, with which a person rests (assumed).
    patience_s: after which a target is left (assumed). whole_s: after which he looks for nothing again (assumed).
    gap_mm: of insertion without a polyp, which he looks over again (assumed). flexure_mm: between two places where he
        looks round in a bend (assumed). round_mm: of the hand off its place with a straight tip, while he leads it
        round (assumed): a view of about 45° to each side.
    free_n: force above which he gives way before he goes on, while nothing is looked at (assumed).
    hand_turn_deg: of the axes of the chosen joint against the picture, as the hand has them in the manual arm. The
        paper prints that they are mapped "directly" and no angle: 0 is assumed, the easiest one.

    Raises:
        InputError: a value is negative or not finite, or a time or speed that divides is 0.
    """

    person: Person = field(default_factory=Person)
    camera_mm_per_s: float = 25.0
    approach_s: float = 1.2
    insert_mm_per_s: float = 20.0
    cut_mm_per_s: float = 2.0
    see_deg: float = 0.5
    see_distance: float = 0.10
    yield_mm_per_s_per_n: float = 10.0
    careful_n: float = 1.0
    content: float = 0.7
    patience_s: float = 60.0
    whole_s: float = 600.0
    gap_mm: float = 90.0
    flexure_mm: float = 25.0
    round_mm: float = 16.0
    free_n: float = 0.2
    hand_turn_deg: float = 0.0

    def __post_init__(self) -> None:
        for name, value in self.own().items():
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"{name} of an endoscopist is {value!r:.40}; it is a number from 0 on")
        for name in ("approach_s", "camera_mm_per_s", "insert_mm_per_s", "cut_mm_per_s", "patience_s", "round_mm"):
            if getattr(self, name) == 0.0:
                raise InputError(f"{name} of an endoscopist must not be 0")

    def own(self) -> dict[str, float]:
        """Its own parameters by name, without the person's."""
        return {name: value for name, value in vars(self).items() if name != "person"}

    def drawn(self, random: np.random.Generator) -> Endoscopist:
        """One of many people with these medians."""
        person = self.person.drawn(random)
        factors = np.exp(np.array([*SPREADS.values()]) * random.standard_normal(len(SPREADS))).tolist()
        changed = {name: getattr(self, name) * factor for name, factor in zip(SPREADS, factors, strict=True)}
        return replace(self, person=person, **changed | {"content": min(changed["content"], 0.95)})

    def practised(self, trial: int) -> Endoscopist:
        """The same person in trial 0, 1, …: faster, and wrong by less."""
        left = (trial + 1) ** -self.person.learning
        less = {name: left * getattr(self, name) for name in _PRACTISED_ERRORS}
        more = {name: getattr(self, name) / left for name in _PRACTISED_SPEEDS}
        return replace(self, person=self.person.practised(trial), **less, **more)

    def to_dict(self) -> dict[str, Any]:
        """What a person of these tasks uses, by name."""
        used = {name: value for name, value in vars(self.person).items() if name in USED_OF_PERSON}
        return used | self.own()


USED_OF_PERSON = ("delay_s", "tremor_mm", "drift_s", "hand_lag_s", "motion_noise", "learning")
DEG_PER_MM = 2.7  # of the view by a motion of the camera across its picture: measured, docs/lumen_page.md
