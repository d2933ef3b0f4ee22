"""The statistics of a user's study: means by subject, and paired comparisons of conditions that differ in one thing."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...arrays import Array
from ...runtime.versions import versions
from ..statistics import LEAST_SUBJECTS, mean_interval, pairs
from .file import StudyCondition, StudyFile, TrialName, conditions, is_simulated, labels
from .kinds import kind_of
from .order import order_of
from .questionnaire import UNIT, AnsweredTlx
from .results import TrialRecord

SCHEMA = "vfix-study/1"
NOTICE = "Not for clinical use."
SIMULATED, PEOPLE = "simulated people", "people"


def evaluate(
    study: StudyFile,
    done: Mapping[TrialName, TrialRecord],
    answers: Sequence[AnsweredTlx] = (),
    reasons: Mapping[TrialName, str] | None = None,
) -> dict[str, Any]:
    """The report of a study as plain values for JSON; simulated and real people are evaluated apart.

    answers: of questionnaires. reasons: why trials are missing, where somebody has said it.
    """
    names = labels(conditions(study))
    groups = {}
    for group, simulated in ((SIMULATED, True), (PEOPLE, False)):
        codes = [code for code in study.codes if is_simulated(code) == simulated]
        if codes:
            groups[group] = _group(study, codes, names, done, reasons or {})
            if not simulated and study.questionnaire != "none":
                groups[group]["questionnaire"] = _questionnaire(codes, names, answers)
    return {
        "schema": SCHEMA,
        "name": study.name,
        "seed": study.seed,
        "notice": NOTICE,
        "operator": study.operator if study.subjects.simulated else None,
        "trials_each": study.trials,
        "conditions": {label: one._asdict() for one, label in names.items()},
        "groups": groups,
        "versions": {name: versions()[name] for name in ("vfix", "python", "numpy", "scipy")},
    }


def compared(names: Mapping[StudyCondition, str]) -> list[tuple[str, str]]:
    """The pairs of conditions that differ in one thing: case and plan are one, and so is having no arm."""

    def differences(one: StudyCondition, other: StudyCondition) -> int:
        modes = one.mode != other.mode
        arms = one.arm != other.arm and not modes  # a free hand has none
        return ((one.case, one.plan) != (other.case, other.plan)) + modes + arms + (one.tool != other.tool)

    every = itertools.combinations(names, 2)
    near = [pair for pair in every if differences(*pair) == 1 and not _other_arm(*pair)]
    return [(names[one], names[other]) for one, other in near]


def _other_arm(one: StudyCondition, other: StudyCondition) -> bool:
    """Whether two modes on a robot differ in the arm as well."""
    return "freehand" not in (one.mode, other.mode) and one.mode != other.mode and one.arm != other.arm


def _group(
    study: StudyFile,
    codes: Sequence[str],
    names: Mapping[StudyCondition, str],
    done: Mapping[TrialName, TrialRecord],
    reasons: Mapping[TrialName, str],
) -> dict[str, Any]:
    turns = [turn.name for code, order in order_of(study).items() if code in set(codes) for turn in order]
    missing = [name for name in turns if name not in done]
    unfinished = [name for name in turns if name in done and not done[name].completed]
    return {
        "subjects": len(codes),
        "planned": len(turns),
        "done": len(turns) - len(missing),
        "missing": [_said(name, names) | {"reason": reasons.get(name, "")} for name in missing],
        "unfinished": [_said(name, names) for name in unfinished],
        "metrics": {metric: _metric(study, metric, codes, names, done) for metric in study.metrics},
    }


def _metric(
    study: StudyFile,
    metric: str,
    codes: Sequence[str],
    names: Mapping[StudyCondition, str],
    done: Mapping[TrialName, TrialRecord],
) -> dict[str, Any]:
    means = {label: _subject_means(study, metric, codes, one, done) for one, label in names.items()}
    return _compared_means(means, names, kind_of(study).metric(metric).unit)


def _questionnaire(
    codes: Sequence[str], names: Mapping[StudyCondition, str], answers: Sequence[AnsweredTlx]
) -> dict[str, Any]:
    """The raw index and each scale, as a metric; empty without answers."""
    there = {(one.subject, one.condition): one.values for one in answers}
    of_one = next(iter(there.values()), {})

    def means(scale: str) -> dict[str, Array]:
        return {
            label: np.array([there.get((code, one), {}).get(scale, np.nan) for code in codes])
            for one, label in names.items()
        }

    return {scale: _compared_means(means(scale), names, UNIT) for scale in of_one}


def _compared_means(means: Mapping[str, Array], names: Mapping[StudyCondition, str], unit: str) -> dict[str, Any]:
    """means: (subjects,) by condition, NaN where a subject has none."""
    enough = [pair for pair in compared(names) if np.isfinite(means[pair[0]] - means[pair[1]]).sum() >= LEAST_SUBJECTS]
    tests = pairs(means, enough) if enough else {}
    return {
        "unit": unit,
        "conditions": {label: _summary(values) for label, values in means.items()},
        "subjects": {label: [_number(value) for value in values.tolist()] for label, values in means.items()},
        "pairs": {pair: one.to_dict() for pair, one in tests.items()},
    }


def _subject_means(
    study: StudyFile,
    metric: str,
    codes: Sequence[str],
    condition: StudyCondition,
    done: Mapping[TrialName, TrialRecord],
) -> Array:
    """Means (subjects,) of the trials that have a value; NaN where none has."""
    found = np.full(len(codes), np.nan)
    for place, code in enumerate(codes):
        records = [done.get(TrialName(code, condition, trial)) for trial in range(study.trials)]
        values = [one.metrics[metric] for one in records if one is not None]
        there = [value for value in values if value is not None]
        if there:
            found[place] = math.fsum(there) / len(there)
    return found


def _summary(means: Array) -> dict[str, Any]:
    """n, mean, and over subjects sd and interval."""
    there = means[~np.isnan(means)]
    several = len(there) >= LEAST_SUBJECTS
    return {
        "n": len(there),
        "mean": float(there.mean()) if len(there) else None,
        "sd": float(there.std(ddof=1)) if several else None,
        "ci95": list(mean_interval(there)) if several else None,
    }


def _said(name: TrialName, names: Mapping[StudyCondition, str]) -> dict[str, Any]:
    return {"subject": name.subject, "condition": names[name.condition], "trial": name.trial + 1}


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
