"""The table of results of an assignment: each of its runs by each criterion, from the metrics of the run."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from app.assignments.content import Criteria

FELT_S = 0.05  # a hold that was shorter nobody has felt

Score = dict[str, Any]  # as `RunScores.of` has it


@dataclass(frozen=True)
class AskedCriterion:
    """A criterion of an assignment, with its name in files and in words."""

    name: str
    label: str
    unit: str
    limit: float | bool


@dataclass(frozen=True)
class CriterionResult(AskedCriterion):
    """A criterion of one run. value: None where the run has none, such as a target error without a target."""

    value: float | bool | None
    passed: bool


@dataclass(frozen=True)
class RunResult:
    """A run of the assignment. passed: every criterion, without trouble.

    trouble: why it cannot pass whatever its values are, as one that cannot be scored; '' where it can.
    """

    run: str
    recorded: str
    criteria: tuple[CriterionResult, ...]
    passed: bool
    trouble: str = ""


@dataclass(frozen=True)
class Results:
    """since: runs before it do not count, '' for all. runs: the oldest first. wanted: how many have to be passed."""

    name: str
    plan_id: str
    mode: str
    since: str
    wanted: int
    criteria: tuple[AskedCriterion, ...]
    runs: tuple[RunResult, ...]

    @property
    def passed(self) -> int:
        """Number of runs that passed every criterion."""
        return sum(one.passed for one in self.runs)

    @property
    def complete(self) -> bool:
        """Whether as many runs as are wanted have passed."""
        return self.passed >= self.wanted

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self) | {"passed": self.passed, "complete": self.complete}


def asked(criteria: Criteria) -> tuple[AskedCriterion, ...]:
    """What is asked for, in the order of a score."""
    return tuple(AskedCriterion(name, *CRITERIA[name][:2], limit) for name, limit in criteria.asked().items())


def judged(criteria: Criteria, run: str, recorded: str, score: Score | None, trouble: str = "") -> RunResult:
    """One run by its score; None where it cannot be scored. trouble: why it cannot pass."""
    found = []
    for one in asked(criteria):
        value = None if score is None else CRITERIA[one.name][2](score)
        found.append(CriterionResult(**vars(one), value=value, passed=_passes(one.name, one.limit, value)))
    return RunResult(run, recorded, tuple(found), not trouble and all(one.passed for one in found), trouble)


def results_csv(results: Results) -> str:
    """A line a run: id, when it was recorded, value, limit and result of each criterion, of all, and its trouble."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    heads = [f"{one.name} {what}" for one in results.criteria for what in ("value", "limit", "passed")]
    writer.writerow(["run", "recorded", *heads, "passed", "trouble"])
    for run in results.runs:
        cells = [cell for one in run.criteria for cell in (_cell(one.value), _cell(one.limit), _cell(one.passed))]
        writer.writerow([run.run, run.recorded, *cells, _cell(run.passed), run.trouble])
    return out.getvalue()


def results_lines(results: Results) -> list[str]:
    """The table as lines of text."""
    if not results.runs:
        return ["no run of this plan and mode since then"]
    labels = [f"{one.label}{f', {one.unit}' if one.unit else ''}" for one in results.criteria]
    rows: list[Sequence[str]] = [("run", "recorded", *labels, "passed")]
    for run in results.runs:
        passed = "yes" if run.passed else run.trouble or "no"
        rows.append((run.run, run.recorded[:16].replace("T", " "), *map(_words, run.criteria), passed))
    widths = [max(len(row[at]) for row in rows) for at in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def _passes(name: str, limit: float | bool, value: float | bool | None) -> bool:
    if value is None:
        return False
    if name.startswith("max_"):
        return value <= limit
    return value >= limit if name.startswith("min_") else value == limit


def _sign(name: str) -> str:
    return "≤" if name.startswith("max_") else "≥" if name.startswith("min_") else "="


def _words(one: CriterionResult) -> str:
    """Value and limit; with a '!' where it is missed."""
    return f"{_word(one.value)} {_sign(one.name)} {_word(one.limit)}{'' if one.passed else ' !'}"


def _word(value: float | bool | None) -> str:
    if value is None:
        return "–"
    return ("yes" if value else "no") if isinstance(value, bool) else f"{value:.4g}"


def _cell(value: float | bool | None) -> str:
    return "" if value is None else str(int(value)) if isinstance(value, bool) else repr(value)


def _error(of: str, kind: str) -> Callable[[Score], float | None]:
    def value(score: Score) -> float | None:
        return None if score[of] is None else float(score[of]["robot_frame"][kind])

    return value


CRITERIA: dict[str, tuple[str, str, Callable[[Score], float | bool | None]]] = {
    "completed": ("Path completed", "", lambda score: bool(score["completed"])),
    "max_time_s": ("Time", "s", lambda score: float(score["time_s"])),
    "max_mean_tip_error_mm": ("Tip error, mean", "mm", _error("path_error_mm", "mean")),
    "max_tip_error_mm": ("Tip error, largest", "mm", _error("path_error_mm", "max")),
    "max_mean_target_error_mm": ("Target error, mean", "mm", _error("target_error_mm", "mean")),
    "min_clearance_mm": (
        "Least clearance",
        "mm",
        lambda score: min(score["least_clearance_mm"].values(), default=None),
    ),
    "max_contacts": ("Contacts", "", lambda score: int(score["contacts"])),
    "max_contact_depth_mm": ("Deepest contact", "mm", lambda score: float(score["max_depth_mm"])),
    "max_held_s": ("Held", "s", lambda score: float(score["held_s"])),
    "max_holds": ("Holds", "", lambda score: sum(_is_felt(one) for one in score["holds"])),
    "min_smoothness": ("Smoothness", "", lambda score: score["spectral_arc_length"]),
}


def _is_felt(hold: dict[str, Any]) -> bool:
    return bool(hold["kind"] != "contact" and hold["duration_s"] >= FELT_S)
