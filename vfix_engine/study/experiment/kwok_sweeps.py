"""Sweeps of the studies of Kwok 2013: each assumption about people to half and to double, one at a time.

The subjects are the first ones of the study, with its seeds, so that a sweep differs from the study by the one
assumption alone. A control (``parameterised``) or a step's length is not swept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...worlds.snake.settings import Arm
from ..endoscopy.endoscopist import USED_OF_PERSON, Endoscopist
from .arms import ArmKey, subject_of

SUBJECTS = 2  # the first of them
FACTORS = (0.5, 2.0)
RANGES: Mapping[str, tuple[float, ...]] = {"content": (0.35, 0.95), "hand_turn_deg": (30.0, 60.0)}
"""Of an assumption that cannot be halved and doubled, as it ends at 1 or is 0."""


class SweptKey(NamedTuple):
    """Names one trial of a sweep: that of ``key``, with the median of one assumption at ``value``."""

    assumption: str
    value: float
    key: ArmKey


def swept_keys(names: Sequence[str], arms: Sequence[Arm], study: int, subjects: int) -> list[SweptKey]:
    """The trials of the sweeps of some assumptions."""
    return [
        SweptKey(name, value, ArmKey(study, subject, arm))
        for name in names
        for value in values_of(name)
        for subject in range(min(subjects, SUBJECTS))
        for arm in arms
    ]


def values_of(name: str) -> tuple[float, ...]:
    """The values of an assumption that are tried beside its own."""
    median = Endoscopist().to_dict()[name]
    return RANGES.get(name) or tuple(factor * median for factor in FACTORS)


def median_with(name: str, value: float) -> Endoscopist:
    """The people of the study with the median of one assumption at a value. Raises InputError for no such name."""
    median = Endoscopist()
    changed: dict[str, Any] = {name: value}
    if name in USED_OF_PERSON:
        return replace(median, person=replace(median.person, **changed))
    if name not in median.own():
        raise InputError(f"{name!r:.40} is no assumption about an endoscopist")
    return replace(median, **changed)


def asked_of(key: ArmKey | SweptKey) -> tuple[ArmKey, Endoscopist]:
    """A trial of the study, and the person in it."""
    if isinstance(key, SweptKey):
        return key.key, subject_of(key.key, median_with(key.assumption, key.value))
    return key, subject_of(key)


def swept_rows(
    swept: Mapping[SweptKey, Mapping[str, float | None]], main: Mapping[ArmKey, Mapping[str, float | None]]
) -> list[dict[str, Any]]:
    """Of each value, and of the study's own, the mean of each figure over the subjects who have it, by arm.

    main: figures of the study's trials, of which the same subjects are taken.
    """
    asked: dict[tuple[str, float], dict[ArmKey, Mapping[str, float | None]]] = {}
    for one, figures in swept.items():
        asked.setdefault((one.assumption, one.value), {})[one.key] = figures
    if not asked:
        return []
    used = {key: main[key] for key in next(iter(asked.values()))}
    return [_row("as assumed", None, used), *(_row(name, value, found) for (name, value), found in asked.items())]


def _row(name: str, value: float | None, found: Mapping[ArmKey, Mapping[str, float | None]]) -> dict[str, Any]:
    arms = dict.fromkeys(key.arm for key in found)
    figures = next(iter(found.values())).keys()

    def mean(arm: Arm, figure: str) -> float | None:
        values = [one[figure] for key, one in found.items() if key.arm == arm]
        known = [value for value in values if value is not None]
        return float(np.mean(known)) if known else None

    return {
        "assumption": name, "value": value, "subjects": len({key.subject for key in found}),
        "arms": {arm: {figure: mean(arm, figure) for figure in figures} for arm in arms},
    }  # fmt: skip
