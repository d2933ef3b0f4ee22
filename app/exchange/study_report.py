"""What a user's study came to, as files: a table of its trials, statistics as JSON, plots, and one page."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from app.exchange.study_plot import plot
from vfix_engine.study.own.evaluation import NOTICE
from vfix_engine.study.own.file import StudyFile
from vfix_engine.study.own.questionnaire import AnsweredTlx
from vfix_engine.study.own.results import TrialRecord, write_whole

_COLUMNS = ("subject", "case", "plan", "mode", "arm", "tool", "trial", "completed")
_SUMMARY = ("", "n", "mean", "SD of subjects", "95 % interval")
_TESTS = ("n", "mean difference", "95 % interval", "d_z", "p, t", "p, t, Holm", "p, Wilcoxon", "p, Wilcoxon, Holm")


def write_report(
    folder: Path,
    told: Mapping[str, Any],
    study: StudyFile,
    records: Sequence[TrialRecord],
    answers: Sequence[AnsweredTlx] = (),
) -> list[str]:
    """Write trials, what people answered, what is missing of them, statistics, plots and page into a folder.

    Returns the names of the files. Raises InputError.
    """
    written: dict[str, bytes] = {
        "trials.csv": _csv(study, records).encode(),
        "statistics.json": (json.dumps(told, allow_nan=False, indent=1) + "\n").encode(),
    }
    if answers:
        written["answers.csv"] = _answers_csv(answers).encode()
    if missing := told["groups"].get("people", {}).get("missing"):
        written["missing.csv"] = _table_csv(list(missing[0]), missing).encode()
    plots: dict[str, dict[str, str]] = {}
    for group, one in told["groups"].items():
        plots[group] = {metric: plot(metric, values) for metric, values in _compared(one).items()}
        for metric, svg in plots[group].items():
            written[f"{group.replace(' ', '_')}_{metric}.svg"] = _alone(svg).encode()
    written["report.html"] = _page(told, plots).encode()
    for name, data in written.items():
        write_whole(folder / name, data)
    if find_spec("pyarrow") is not None:
        _write_parquet(folder / "trials.parquet", study, records)
        written["trials.parquet"] = b""
    return sorted(written)


def report_lines(told: Mapping[str, Any]) -> list[str]:
    """The statistics as lines of text."""
    lines = []
    for group, one in told["groups"].items():
        lines.append(f"{told['name']}: {one['subjects']} {group}, {one['done']} of {one['planned']} trials")
        lines += _gaps(one)
        for metric, values in _compared(one).items():
            rows = [_SUMMARY, *(_summary_row(*row) for row in values["conditions"].items())]
            lines += ["", _heading(metric, values), *_aligned(rows)]
            if values["pairs"]:
                tests = [("", *_TESTS), *(_test_row(pair, test) for pair, test in values["pairs"].items())]
                lines += ["", *_aligned(tests)]
        lines.append("")
    return lines


def _compared(group: Mapping[str, Any]) -> dict[str, Any]:
    """What conditions are compared in: the metrics, and what people answered."""
    return {**group["metrics"], **group.get("questionnaire", {})}


def _rows(study: StudyFile, records: Sequence[TrialRecord]) -> list[dict[str, Any]]:
    def row(one: TrialRecord) -> dict[str, Any]:
        return {name: getattr(one, name) for name in _COLUMNS} | {name: one.metrics[name] for name in _measured(study)}

    return [row(one) for one in records]


def _measured(study: StudyFile) -> list[str]:
    """The metrics that have a column of their own."""
    return [name for name in study.metrics if name not in _COLUMNS]


def _csv(study: StudyFile, records: Sequence[TrialRecord]) -> str:
    """A line a trial."""
    rows = [row | {"completed": int(row["completed"])} for row in _rows(study, records)]
    return _table_csv([*_COLUMNS, *_measured(study)], rows)


def _answers_csv(answers: Sequence[AnsweredTlx]) -> str:
    """A line a questionnaire."""
    rows = [{"subject": one.subject, **one.condition._asdict(), **one.values} for one in answers]
    return _table_csv(list(rows[0]), rows)


def _table_csv(heads: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> str:
    """A first line, a comment, has the notice."""
    out = io.StringIO()
    out.write(f"# {NOTICE}\n")
    writer = csv.DictWriter(out, heads, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def _write_parquet(file: Path, study: StudyFile, records: Sequence[TrialRecord]) -> None:
    """The same table for programs; needs the extra `tables`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    texts = [pa.field(name, pa.string()) for name in _COLUMNS[:6]]
    kinds = [*texts, pa.field("trial", pa.int64()), pa.field("completed", pa.bool_())]
    kinds += [pa.field(name, pa.float64()) for name in _measured(study)]
    schema = pa.schema(kinds, metadata={"notice": NOTICE, "study": study.name})
    buffer = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_pylist(_rows(study, records), schema=schema), buffer, compression="zstd")
    write_whole(file, buffer.getvalue().to_pybytes())


def _page(told: Mapping[str, Any], plots: Mapping[str, Mapping[str, str]]) -> str:
    """The report as HTML, with its styles and plots in it."""
    style = files("app.exchange").joinpath("report", "report.css").read_text(encoding="utf-8") + _PLOT + _STYLE
    parts = [
        f"<header><div><h1>{escape(told['name'])}</h1><p>{_subtitle(told)}</p></div>"
        f'<strong class="notice">{escape(NOTICE)}</strong></header>'
    ]
    if "simulated people" in told["groups"]:
        parts.append("<section><p>Simulated people say nothing of how people behave.</p></section>")
    for group, one in told["groups"].items():
        gaps = "".join(f"<p>{escape(line)}</p>" for line in _gaps(one))
        parts.append(
            f"<section><h1>{escape(group.capitalize())}</h1><p>{one['subjects']} subjects, {one['done']} of "
            f"{one['planned']} trials.</p>{gaps}</section>"
        )
        for metric, values in _compared(one).items():
            rows = [_summary_row(*row) for row in values["conditions"].items()]
            summary = _table(_SUMMARY, rows)
            tests = [_test_row(pair, test) for pair, test in values["pairs"].items()]
            compared = _table(("", *_TESTS), tests) if tests else "<p>No two conditions of two subjects to compare.</p>"
            heading, svg = escape(_heading(metric, values)), plots[group][metric]
            parts.append(f"<section><h2>{heading}</h2>{svg}{summary}{compared}</section>")
    parts.append(
        f"<footer><span>{escape(NOTICE)} A subject's trials are averaged, then paired. Holm corrects within a metric."
        f"</span><span>vfix {escape(told['versions']['vfix'])}, seed {told['seed']}</span></footer>"
    )
    title = escape(told["name"])
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{style}</style>'
        f"</head>\n<body>{''.join(parts)}</body></html>\n"
    )


_PLOT = """
.plot text { font-size: 2.6px; }
.plot .grid { stroke: var(--line); stroke-width: 0.2; }
.plot .one { fill: none; stroke: var(--soft); stroke-width: 0.2; opacity: 0.45; }
.plot .mean { stroke: #0b4f9c; stroke-width: 0.6; fill: #0b4f9c; }
"""
_STYLE = """
table { width: 100%; margin: 2mm 0; }
:is(th, td):not(:first-child) { text-align: right; font-variant-numeric: tabular-nums; }
section + section h1 { margin-top: 4mm; }
"""


_ALONE = """
:root { --line: #d5dbe3; --soft: #53606e; }
text { font-family: sans-serif; text-anchor: middle; fill: #53606e; }
.up { text-anchor: end; }
"""


def _alone(svg: str) -> str:
    """A plot as a file of its own, with the styles that it needs."""
    style = f"<style>{_ALONE}{_PLOT}</style>"
    return svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1).replace(">", f">{style}", 1)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f'<th scope="col">{escape(one)}</th>' for one in heads)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in row[1:])}</tr>'
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _subtitle(told: Mapping[str, Any]) -> str:
    words = [f"{len(told['conditions'])} conditions", f"{told['trials_each']} trials in each"]
    if told["operator"]:
        words.append(f"simulated people: {told['operator']}")
    return escape(", ".join(words))


def _gaps(group: Mapping[str, Any]) -> list[str]:
    """What is missing, and what did not reach the end."""
    found = []
    for name, words in (("missing", "missing"), ("unfinished", "not driven to the end")):
        trials = group[name]
        if trials:
            first = "; ".join(map(_gap, trials[:_MOST_SAID]))
            more = f" and {len(trials) - _MOST_SAID} more" if len(trials) > _MOST_SAID else ""
            found.append(f"{len(trials)} trials {words}: {first}{more}")
    return found


_MOST_SAID = 8


def _gap(one: Mapping[str, Any]) -> str:
    reason = f" ({one['reason']})" if one.get("reason") else ""
    return f"{one['subject']}: {one['condition']}, {one['trial']}{reason}"


def _heading(metric: str, values: Mapping[str, Any]) -> str:
    name = metric.removesuffix(f"_{values['unit']}").replace("_", " ")
    return f"{name}, {values['unit']}" if values["unit"] else name


def _summary_row(label: str, one: Mapping[str, Any]) -> tuple[str, ...]:
    return (label, str(one["n"]), _figure(one["mean"]), _figure(one["sd"]), _interval(one["ci95"]))


def _test_row(pair: str, test: Mapping[str, Any]) -> tuple[str, ...]:
    probabilities = (_p(test[name]) for name in ("p_t", "p_t_holm", "p_wilcoxon", "p_wilcoxon_holm"))
    return (pair, str(test["n"]), _figure(test["mean"]), _interval(test["ci95"]), _figure(test["d_z"]), *probabilities)


def _interval(ends: Sequence[float | None] | None) -> str:
    return "" if ends is None else f"{_figure(ends[0])} to {_figure(ends[1])}"


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}".replace("-", "−")


def _p(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}" if value >= 0.001 else f"{value:.1e}".replace("-", "−")


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]

    def line(row: Sequence[str]) -> str:
        first, *others = zip(row, widths, strict=True)
        return "  ".join([first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]).rstrip()

    return [line(row) for row in rows]
