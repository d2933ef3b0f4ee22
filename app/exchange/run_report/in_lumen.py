"""What the printable report says of runs in a lumen: score, task with its polyps or labels, curves, holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from app.exchange.run_report.figures import Axes, PlottedLine, figure
from app.exchange.run_report.page import HoldRow, ReportedRun, RunReportPage, ScoreRow, Table
from app.exchange.run_report.reported import RunToReport, page_of, recording_rows, side, when
from vfix_engine.arrays import Array
from vfix_engine.study.lumen import LumenScore, LumenSeries
from vfix_engine.study.lumen.task_rows import task_told

UNCERTIFIED = "with links that may leave their bounds: how far they do is measured, not prevented."
_NONE = "–"


def lumen_page(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> RunReportPage:
    """The page on runs in a lumen. Raises InputError for a run that cannot be scored."""
    robots = ", ".join(dict.fromkeys(_robot(one) for one in runs))
    page = page_of(runs, shown, (robots,), _scores(runs), _figures(runs, shown), _holds(runs, shown))
    tables = tuple(_marks(one, run) for one, run in zip(runs, shown, strict=True) if task_told(one.run) is not None)
    return replace(page, uncertified=UNCERTIFIED, holds_title="Holds", tables=tables)


def _robot(one: RunToReport) -> str:
    snake = one.run.manifest["spec"]["snake"]
    return f"{snake['links']} links of {snake['length_mm']:g} mm, {2.0 * snake['radius_mm']:g} mm across"


def _scores(runs: Sequence[RunToReport]) -> tuple[ScoreRow, ...]:
    scores = [one.lumen_score for one in runs]
    recorded = [when(one.recorded) for one in runs] if len(runs) > 1 else []  # of a single run the subtitle says it
    rows = [
        ScoreRow("Recorded", tuple(at or _NONE for at in recorded)),
        ScoreRow("Task", tuple(_NONE if one.task is None else one.task.title for one in scores)),
        ScoreRow("Completed", tuple("yes" if one.completed else "no" for one in scores)),
        *recording_rows(scores),
        _row("Time driven, s", scores, lambda one: one.time_s, "{:.1f}"),
        _row("Depth, mm", scores, lambda one: one.depth_mm, "{:.0f}"),
        _row("Share of the way, %", scores, lambda one: None if one.share is None else 100.0 * one.share, "{:.0f}"),
        _row("Insertion, s", scores, lambda one: one.insertion_s, "{:.1f}"),
        _row("Withdrawal, s", scores, lambda one: one.withdrawal_s, "{:.1f}"),
        _row("Way of the tip, mm", scores, lambda one: one.path_length_mm, "{:.0f}"),
        _row("Deviations", scores, _episodes, "{:.0f}"),
        _row("Deviation, deepest, mm", scores, _deepest, "{:.1f}"),
        _row("Deviation, time, s", scores, _deviated_s, "{:.1f}"),
        _row("Beyond its bound, mm", scores, lambda one: one.beyond_bound_mm, "{:.2f}", _is_beyond),
        _row("Bound, largest, mm", scores, lambda one: one.bound_mm, "{:.1f}"),
        _row("Pathway behind the wall, %", scores, _behind_share, "{:.0f}"),
        _row("Pathway behind the wall, deepest, mm", scores, _behind_mm, "{:.1f}"),
        _row("Force on the hand, largest, N", scores, lambda one: one.force_n.max, "{:.2f}"),
        _row("Held, s", scores, lambda one: one.held_s, "{:.1f}"),
        *_task_rows(scores),
    ]  # fmt: skip
    return tuple(row for row in rows if any(value != _NONE for value in row.values))


def _episodes(score: LumenScore) -> float | None:
    return None if score.deviation is None else float(score.deviation.episodes)


def _deviated_s(score: LumenScore) -> float | None:
    return None if score.deviation is None else score.deviation.time_s


def _deepest(score: LumenScore) -> float | None:
    deviation = score.deviation
    return None if deviation is None or deviation.depth_mm is None else deviation.depth_mm.max


def _behind_share(score: LumenScore) -> float | None:
    return None if score.behind_wall is None else 100.0 * score.behind_wall.share


def _behind_mm(score: LumenScore) -> float | None:
    return None if score.behind_wall is None else score.behind_wall.depth_mm


def _is_beyond(score: LumenScore) -> bool:
    return score.beyond_bound_mm > 0.0


def _row(
    name: str,
    scores: Sequence[LumenScore],
    value: Callable[[LumenScore], float | None],
    form: str,
    caution: Callable[[LumenScore], bool] = lambda one: False,
) -> ScoreRow:
    values = [value(one) for one in scores]
    told = tuple(_NONE if one is None else form.format(one) for one in values)
    return ScoreRow(name, told, tuple(number for number, one in enumerate(scores) if caution(one)))


def _task_rows(scores: Sequence[LumenScore]) -> list[ScoreRow]:
    """What each task adds, and what of it is not known."""
    found = [{} if one.task is None else {row.name: row for row in one.task.rows} for one in scores]
    rows = []
    for name in dict.fromkeys(name for of_run in found for name in of_run):
        of_name = [of_run.get(name) for of_run in found]
        unit = next((one.unit for one in of_name if one is not None), "")
        told = tuple(_NONE if one is None or one.value is None else f"{one.value:.{one.digits}f}" for one in of_name)
        worse = tuple(number for number, one in enumerate(of_name) if one is not None and one.worse)
        rows.append(ScoreRow(f"{name}, {unit}" if unit else name, told, worse))
    lacking = tuple(_NONE if one.task is None or not one.task.lacking else one.task.lacking for one in scores)
    return [*rows, ScoreRow("Not known", lacking, tuple(n for n, words in enumerate(lacking) if words != _NONE))]


def _figures(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> list[tuple[str, str]]:
    def curves(values: Callable[[LumenSeries], Array]) -> list[PlottedLine]:
        series = [one.lumen_series for one in runs]
        return [PlottedLine(one.t, values(one), run.colour, run.dashes) for one, run in zip(series, shown, strict=True)]

    inserted = any(one.lumen_score.depth_mm is not None for one in runs)
    share = curves(lambda one: 100.0 * one.deviation / one.bound)
    bound = (100.0, "bound")
    return [
        *([("Depth of the tip, mm", figure(Axes("s", "Depth of the tip"), curves(lambda one: one.depth)))] if inserted
          else []),
        ("Bound used by the link nearest to its own, %", figure(Axes("s", "Bound used", bound, least=120.0), share)),
        ("Deepest distal link outside the pathway, mm",
         figure(Axes("s", "Deviation of the distal links", least=1.0), curves(lambda one: one.distal))),
        ("Force on the hand, N", figure(Axes("s", "Force on the hand", least=0.1), curves(lambda one: one.force))),
    ]  # fmt: skip


def _holds(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> tuple[HoldRow, ...]:
    """All holds, the longest first."""
    found = [(hold, run.label) for one, run in zip(runs, shown, strict=True) for hold in one.lumen_holds]
    found.sort(key=lambda pair: -pair[0].held_s)
    return tuple(
        HoldRow(
            (label, f"{hold.t_s:.1f} s", f"{hold.held_s:.2f} s", hold.reason[:1].upper() + hold.reason[1:],
             _place(hold.place))
        )
        for hold, label in found
    )  # fmt: skip


def _marks(one: RunToReport, run: ReportedRun) -> Table:
    """The polyps or labels of a run's task."""
    told: dict[str, Any] | None = task_told(one.run)
    assert told is not None
    title = f"{told['title']} of run {run.label}" if run.label else str(told["title"])
    if "polyps" in told:
        rows = [(f"{polyp['s_mm']:.0f} mm", _place(polyp["wall"])) for polyp in told["polyps"]]
        return Table(title, ("", "Along the way", "Place, mm"), _numbered(rows))
    rows = [(str(label["place"]) or _NONE, _place(label["centre"])) for label in told["labels"]]
    return Table(title, ("", "On", "Centre, mm"), _numbered(rows))


def _numbered(rows: Sequence[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    return tuple((str(number), *row) for number, row in enumerate(rows, start=1))


def _place(values: Sequence[float]) -> str:
    return " ".join(side(float(value), axis) for axis, value in enumerate(np.asarray(values, dtype=np.float64)))
