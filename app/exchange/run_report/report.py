"""What the printable report on runs says: their scores, curves and holds, from the runs alone; here of a rigid tool."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from app.exchange.run_report.figures import Axes, PlottedLine, figure
from app.exchange.run_report.in_lumen import lumen_page
from app.exchange.run_report.page import HoldRow, ReportedRun, RunReportPage, ScoreRow
from app.exchange.run_report.reported import RunToReport, page_of, recording_rows, side, when
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.study.metrics import RunScore
from vfix_engine.study.metrics.score import Errors
from vfix_engine.study.series import RunSeries
from vfix_engine.virtual_fixtures.zones import ANATOMY
from vfix_engine.worlds.registry import is_certified
from vfix_engine.worlds.rigid.row import PHASES

MOST_RUNS = 6  # columns of the table, and lines of a figure that can be told apart
_COLOURS = ("#1f6fb5", "#c2410c", "#15803d", "#7e3fb0", "#a16207", "#475569")
_DASHES = ("", "2 0.8", "0.8 0.8", "3 0.8 0.8 0.8", "1.4 1.4", "4 1.6")
_SMOOTH_S = 0.05  # over which a speed is measured
_DONE = PHASES.index("done")
_TASKS = {"follow": "path", "done": "path", "approach": "path", "inspect_hold": "inspection", "free": "free motion"}


def report_html(runs: Sequence[RunToReport]) -> str:
    """The report on one run, or on several side by side, as a page of HTML without references to other files.

    Raises InputError for no run or more than `MOST_RUNS`, and for a run that cannot be scored.
    """
    if not 1 <= len(runs) <= MOST_RUNS:
        raise InputError(f"a report takes 1 to {MOST_RUNS} runs, not {len(runs)}")
    in_lumen = [one.arm is not None for one in runs]
    if any(in_lumen) != all(in_lumen):
        raise InputError("a report has one kind of runs: of a rigid tool, or of a robot in a lumen")
    labels = "ABCDEF" if len(runs) > 1 else " "
    shown = tuple(
        ReportedRun(
            labels[number].strip(), _COLOURS[number], _DASHES[number], one.words,
            is_certified(one.run.manifest), one.id,
        )
        for number, one in enumerate(runs)
    )  # fmt: skip
    return (lumen_page if all(in_lumen) else _rigid_page)(runs, shown).html()


def _rigid_page(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> RunReportPage:
    tools = ", ".join(dict.fromkeys(one.spec.scene.tool_itself().title for one in runs))
    robots = ", ".join(dict.fromkeys(one.spec.scene.robot_model().title for one in runs if one.score.certified))
    return page_of(runs, shown, (tools, robots), _scores(runs), _figures(runs, shown), _holds(runs, shown))


def _scores(runs: Sequence[RunToReport]) -> tuple[ScoreRow, ...]:
    scores = [one.score for one in runs]
    recorded = [when(one.recorded) for one in runs] if len(runs) > 1 else []  # of a single run the subtitle says it
    rows = [
        ScoreRow("Recorded", tuple(at or "–" for at in recorded)),
        ScoreRow("Task", tuple(_task(one) for one in runs)),
        ScoreRow("Completed", tuple(_completed(one) for one in runs)),
        *recording_rows(scores),
        _row("Time, s", scores, lambda one: one.time_s, "{:.1f}"),
        *_error_rows("Path error", [one.path_error_mm for one in scores]),
        *_error_rows("Target error", [one.target_error_mm for one in scores]),
        _row("Angle about a target, °", scores, lambda one: one.angle_deg, "{:.0f}"),
        _row("Way of the tip, mm", scores, lambda one: one.path_length_mm, "{:.1f}"),
        _row("Smoothness (SPARC)", scores, lambda one: one.spectral_arc_length, "{:.2f}"),
        _row("Smoothness (LDLJ)", scores, lambda one: one.log_dimensionless_jerk, "{:.1f}"),
        *_clearance_rows(runs),
        ScoreRow(
            "Margin kept by the certificate, mm",
            tuple(_margin(one) if one.score.certified else "none" for one in runs),
            tuple(number for number, one in enumerate(scores) if not one.certified),
        ),
        _row("Held, s", scores, lambda one: one.held_s, "{:.1f}"),
        _row("Contacts", scores, lambda one: one.contacts, "{:d}", lambda one: one.contacts > 0),
        _row("Deepest contact, mm", scores, lambda one: one.max_depth_mm, "{:.2f}", lambda one: one.contacts > 0),
        *_contact_rows(runs),
    ]
    return tuple(row for row in rows if any(value != "–" for value in row.values))


def _margin(one: RunToReport) -> str:
    """The margin that was kept, or the smallest and the largest where it was changed on the way."""
    least, most = one.kept_mm
    return f"{least:.2f}" if f"{least:.2f}" == f"{most:.2f}" else f"{least:.2f} – {most:.2f}"


def _row(
    name: str,
    scores: Sequence[RunScore],
    value: Callable[[RunScore], float | None],
    form: str,
    caution: Callable[[RunScore], bool] = lambda one: False,
) -> ScoreRow:
    values = [value(one) for one in scores]
    told = tuple("–" if one is None else form.format(one).replace("-", "−") for one in values)
    return ScoreRow(name, told, tuple(number for number, one in enumerate(scores) if caution(one)))


def _error_rows(name: str, errors: Sequence[Errors | None]) -> list[ScoreRow]:
    """Mean and largest error where the run has the tool."""

    def told(kind: str) -> tuple[str, ...]:
        return tuple("–" if one is None else f"{getattr(one.robot_frame, kind):.3f}" for one in errors)

    return [ScoreRow(f"{name}, mean, mm", told("mean")), ScoreRow(f"{name}, largest, mm", told("max"))]


def _clearance_rows(runs: Sequence[RunToReport]) -> list[ScoreRow]:
    """Least clearance to bone and each structure that any run came near to, and how many others there are."""
    names = dict.fromkeys(name for one in runs for name in one.score.least_clearance_mm)
    rows, far = list[ScoreRow](), 0
    for structure in names:
        values, caution = list[str](), list[int]()
        for number, one in enumerate(runs):
            least = one.score.least_clearance_mm.get(structure)
            reach = float(one.series.reach.max())
            values.append("–" if least is None else f"≥ {reach:.1f}" if least >= reach else f"{least:.2f}")
            if least is not None and least < 0.0:
                caution.append(number)
        told = tuple(value.replace("-", "−") for value in values)
        if structure != ANATOMY and all(value[0] in "≥–" for value in told):
            far += 1
        else:
            rows.append(ScoreRow(f"Least clearance, {_named(runs, structure)}, mm", told, tuple(caution)))
    if far:
        beyond = tuple(f"≥ {one.series.reach.max():.1f}" for one in runs)
        rows.append(ScoreRow(f"Least clearance, {far} more, mm", beyond))
    return rows


def _contact_rows(runs: Sequence[RunToReport]) -> list[ScoreRow]:
    """Contacts by structure and part of the tool, where there are any."""
    kinds = dict.fromkeys((one.structure, one.part) for run in runs for one in run.score.contacts_by)
    rows = []
    for structure, part in kinds:
        values = []
        for run in runs:
            found = [one for one in run.score.contacts_by if (one.structure, one.part) == (structure, part)]
            values.append(f"{found[0].count}, {found[0].max_depth_mm:.2f} mm deep" if found else "0")
        rows.append(ScoreRow(f"Contacts of the {part} with {_named(runs, structure)}", tuple(values)))
    return rows


def _figures(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> list[tuple[str, str]]:
    along = all(np.isfinite(one.series.progress).any() for one in runs)
    across = "mm along the path, from the entry" if along else "s"
    margins = [one.kept_mm[0] for one in runs if one.score.certified]
    reach = max(float(one.series.reach.max()) for one in runs)
    margin = (min(margins), "margin of the certificate") if margins else None

    def curves(values: Callable[[RunToReport], tuple[Array, Array]], worst: int) -> list[PlottedLine]:
        found = []
        for one, run in zip(runs, shown, strict=True):
            x, y = values(one)
            found.append(PlottedLine(x, y, run.colour, run.dashes, worst, _mark(one, y, worst) if worst < 0 else None))
        return found

    error = curves(lambda one: _over(one, one.series.error, along), 1)
    clearance = curves(lambda one: _over(one, one.series.clearance.min(axis=1), along), -1)
    speed = curves(lambda one: (one.series.t, speed_of(one.series)), 1)
    return [
        ("Error of the tip, mm", figure(Axes(across, "Error of the tip", least=0.01), error)),
        (
            "Clearance of the whole tool to what is nearest, mm",
            figure(Axes(across, "Clearance of the whole tool", margin, cut=reach), clearance),
        ),
        ("Speed of the tip, mm/s", figure(Axes("s", "Speed of the tip", least=1.0), speed)),
    ]


def _over(one: RunToReport, values: Array, along: bool) -> tuple[Array, Array]:
    """Values over the path, without its approach, or over the time."""
    series = one.series
    if not along:
        return series.t, values
    x = np.fmax.accumulate(np.nan_to_num(series.progress, nan=0.0))  # a hand that goes back does not draw a loop
    return x, values


def _mark(one: RunToReport, clearance: Array, worst: int) -> tuple[int, str] | None:
    """The least clearance with the structure that it is to."""
    index = int(np.nanargmin(clearance))
    nearest = int(one.series.nearest[index])
    if nearest < 0:
        return None
    structure = _named([one], one.series.structures[nearest])
    return index, f"{clearance[index]:.2f} mm to {structure}".replace("-", "−")


def speed_of(series: RunSeries) -> Array:
    """Speed (n,) of the tip in mm/s over windows of 50 ms; NaN in the first one."""
    behind = np.searchsorted(series.t, series.t - _SMOOTH_S + 1e-9)
    behind = np.minimum(behind, np.maximum(np.arange(len(series.t)) - 1, 0))
    gone = np.linalg.norm(series.tip - series.tip[behind], axis=1)
    time = series.t - series.t[behind]
    return np.asarray(np.divide(gone, time, out=np.full(len(gone), np.nan), where=time > 0.0))


def _holds(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> tuple[HoldRow, ...]:
    """All holds and contacts, the longest first."""
    found = [(hold, run.label) for one, run in zip(runs, shown, strict=True) for hold in one.holds]
    found.sort(key=lambda pair: -pair[0].held_s)
    return tuple(
        HoldRow(
            (label, f"{hold.t_s:.1f} s", f"{hold.held_s:.2f} s", hold.reason[:1].upper() + hold.reason[1:],
             " ".join(side(value, axis) for axis, value in enumerate(hold.place))),
            hold.kind == "contact",
        )
        for hold, label in found
    )  # fmt: skip


def _task(one: RunToReport) -> str:
    tasks = dict.fromkeys(_TASKS[name] for name in (PHASES[i] for i in np.unique(one.series.phase)) if name in _TASKS)
    return ", ".join(tasks)


def _completed(one: RunToReport) -> str:
    series = one.series
    if (series.phase == _DONE).any():
        return "yes"
    if not np.isfinite(series.progress).any() or one.spec.scene.path_points is None:
        return "–"
    reached = float(np.nanmax(series.progress))
    return f"no, {reached:.1f} of {SplinePath(one.spec.scene.path_points).length:.1f} mm"


def _named(runs: Sequence[RunToReport], structure: str) -> str:
    for one in runs:
        if structure in one.spec.scene.structure_names:
            return one.spec.scene.structure_names[structure]
    return structure
