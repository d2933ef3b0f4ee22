"""Write the tables of docs/evidence.md from the reports in docs/evidence/, which `vfix study STUDY -o FILE` writes.

A name that ends in -full is a run without --quick, which takes an hour: where it is not stored, the page says so.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, REPORTS = DOCS / "evidence.md", DOCS / "evidence"
FULL = "-full"
LEAST = 0.001  # a smaller figure, such as a p value, is written as a power of ten
SWEPT = ("freehand", "hands-on", "teleoperated")  # modes
BLOCK = re.compile(r"<!-- (\w+) of ([\w-]+) -->\n.*?<!-- end -->", re.DOTALL)


def written(page: str, reports: Path = REPORTS) -> str:
    """The page with every table anew."""

    def block(found: re.Match[str]) -> str:
        what, study = found.groups()
        file = reports / f"{study}.json"
        if study.endswith(FULL) and not file.exists():
            words = f"No full run is stored; `vfix study {study.removesuffix(FULL)}` makes one."
        else:
            words = TABLES[what](json.loads(file.read_text(encoding="utf-8")))
        return f"<!-- {what} of {study} -->\n{words}\n<!-- end -->"

    return BLOCK.sub(block, page)


def cells(report: Mapping[str, Any]) -> str:
    """Each cell of the paper beside ours."""
    rows = [
        [
            cell["table"], cell["row"], cell["column"], printed(cell["paper"], cell["paper_sd"]),
            number(cell["ours"], cell["sd_subjects"]), cell["kind"], cell["note"],
        ]
        for cell in report["cells"]
    ]  # fmt: skip
    return table(["Table, section", "Row", "Column", "Paper", "Ours", "Kind", "Note"], rows)


def fitted(report: Mapping[str, Any]) -> str:
    """Each fitted parameter with the figure that it was fitted to."""
    rows = [
        [
            f"`{name}`",
            f"{one['value']:.4g}",
            f"`{one['figure']}`",
            number(one["paper"], None),
            number(one["reached"], None),
        ]
        for name, one in report["fitted"].items()
    ]
    return table(["Parameter", "Value", "Fitted to", "Paper", "Reached"], rows)


def assumed(report: Mapping[str, Any]) -> str:
    """Each assumed size of the error chain."""
    return table(["Assumed", "Value"], [[f"`{name}`", str(value)] for name, value in report["assumed"].items()])


def order(report: Mapping[str, Any]) -> str:
    """In how many simulated laboratories an order came out."""
    rows = [
        [name, f"{one['count']} of {one['of']}", f"{one['ci95'][0]:.2f} to {one['ci95'][1]:.2f}"]
        for name, one in report["order_share"].items()
        if isinstance(one, dict)
    ]
    return table(["Came out", "Laboratories", "95 % interval of the share"], rows)


def times(report: Mapping[str, Any]) -> str:
    """What a step and the tree take on the machine of the report, beside the printed times."""
    ours = report["times"]
    rows = [
        ["Building the covariance tree", "about 60 s", f"{ours['tree_build_s']:.2f} s"],
        ["Pairs of the boundary and solution of (20)-(21), the papers' way", "5.54 ms (2004), 6 ms (2007)",
         f"{ours['papers_program_ms']:.2f} ms"],
        ["A certified step of the product, at states 1/30 s apart", "", f"{ours['product_step_ms']:.3f} ms"],
    ]  # fmt: skip
    return table(["Time", "Paper, Pentium IV, 2 GHz", "Ours, median"], rows)


def compared(report: Mapping[str, Any]) -> str:
    """Each pair of arms by subjects: difference with its interval, effect size, and p after Holm."""
    rows = [
        [
            name, pair, str(one["n"]), number(one["mean"], None), interval(one["ci95"]), number(one["d_z"], None),
            number(one["p_t"], None), number(one["p_t_holm"], None), number(one["p_wilcoxon"], None),
        ]
        for name, pairs in report["pairs"].items()
        for pair, one in pairs.items()
    ]  # fmt: skip
    return table(["Quantity", "Pair", "n", "Mean", "95 % interval", "d_z", "p, t", "Holm", "p, Wilcoxon"], rows)


def agrees(report: Mapping[str, Any]) -> str:
    """What of the paper's text and tables agrees."""
    return "\n".join(f"- {one}" for one in report["agrees"])


def used(report: Mapping[str, Any]) -> str:
    """What the run took and how many finished."""
    left = ", ".join(f"{count} {arm}" for arm, count in report["unfinished"].items())
    return (
        f"{report['subjects']} subjects in three arms, seed {report['seed']}: {report['cpu_s']:.0f} s of processor. "
        f"Trials that did not end their task: {left}."
    )


def sweeps(report: Mapping[str, Any]) -> str:
    """What moves by how much where an assumption has other values; one figure where nothing moves."""

    def along(rows: list[Mapping[str, Any]], name: str, digits: int) -> str:
        found = [f"{row[name]:.{digits}f}" for row in rows]
        return found[0] if len(set(found)) == 1 else ", ".join(found)

    lines = []
    for one in report["sweeps"].values():
        values = [valued(row) for row in one["rows"]]
        errors = [along(one["rows"], f"{mode} error_mm", 2) for mode in SWEPT]
        times = [along(one["rows"], f"{mode} time_s", 1) for mode in SWEPT]
        rest = [along(one["rows"], "inspection_mm", 2), along(one["rows"], "order_share", 1)]
        lines.append([one["what"], ", ".join(values), *errors, *times, *rest])
    heads = ["Assumption", "Values", *(f"{mode}, mm" for mode in SWEPT), *(f"{mode}, s" for mode in SWEPT)]
    return table([*heads, "inspection, mm", "order's share"], lines)


def valued(row: Mapping[str, Any]) -> str:
    """A value of a sweep, the assumed one in bold."""
    value = row["value"]
    words = {True: "yes", False: "no"}[value] if isinstance(value, bool) else f"{value:g}"
    return f"**{words}**" if row["is_assumed"] else words


def beyond(report: Mapping[str, Any]) -> str:
    """Each anatomy, control and mode with what was measured."""
    columns = list(dict.fromkeys(cell["column"] for cell in report["cells"]))
    found: dict[tuple[str, str], dict[str, str]] = {}
    for cell in report["cells"]:
        value = "" if cell["ours"] is None else f"{cell['ours']:.2f}"
        spread = "" if cell["sd_subjects"] is None else f" ± {cell['sd_subjects']:.2f}"
        found.setdefault((cell["table"], cell["row"]), {})[cell["column"]] = value + spread
    rows = [[anatomy, row, *(one.get(name, "") for name in columns)] for (anatomy, row), one in found.items()]
    skipped = [f"\n\nLeft out: {name}, since {why}." for name, why in report["skipped"].items()]
    return table(["Anatomy", "Control, mode", *columns], rows) + "".join(skipped)


def sizes(report: Mapping[str, Any]) -> str:
    """How large a study was."""
    share = next((one for one in report["order_share"].values() if isinstance(one, dict)), None)
    where = "" if share is None else f", {share['of']} laboratories"
    return (
        f"{report['subjects']} subjects, trials of each in a mode: {report['trials']}{where}, seed {report['seed']}: "
        f"{report['cpu_s']:.0f} s of processor."
    )


def beside(report: Mapping[str, Any]) -> str:
    """A line for each row of a printed table, with the paper's figure and ours in each column."""
    printed_ones = [cell for cell in report["cells"] if cell["table"] != "ours"]
    columns = list(dict.fromkeys(cell["column"] for cell in printed_ones))
    found: dict[str, dict[str, str]] = {}
    for cell in printed_ones:
        paper = printed(cell["paper"], cell["paper_sd"])
        spread = "" if cell["sd_subjects"] is None else f" ± {short(cell['sd_subjects'])}"
        ours = f"**{short(cell['ours'])}{spread}**"
        found.setdefault(cell["row"], {})[cell["column"]] = f"{paper} / {ours}" if paper else ours
    return table(["Row", *columns], [[row, *(one.get(name, "") for name in columns)] for row, one in found.items()])


def swept(report: Mapping[str, Any]) -> str:
    """Each assumption at other values: means of the swept subjects, of each arm in turn."""
    rows = report["sweeps"]
    arms = list(rows[0]["arms"])
    figures = list(rows[0]["arms"][arms[0]])
    lines = [
        [f"`{row['assumption']}`" if row["value"] is not None else row["assumption"],
         "" if row["value"] is None else f"{row['value']:.4g}",
         *(" / ".join(short(row["arms"][arm][figure]) for arm in arms) for figure in figures)]
        for row in rows
    ]  # fmt: skip
    told = f"Means of {rows[0]['subjects']} subjects, {' / '.join(arms)}:\n\n"
    return told + table(["Assumed", "Value", *(f"`{figure}`" for figure in figures)], lines)


def contradictions(report: Mapping[str, Any]) -> str:
    """Where the papers contradict themselves."""
    return "\n".join(f"- {one}" for one in report["contradictions"])


TABLES: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "cells": cells, "fitted": fitted, "assumed": assumed, "order": order, "times": times,
    "contradictions": contradictions, "compared": compared, "agrees": agrees, "used": used,
    "sweeps": sweeps, "swept": swept, "beside": beside, "beyond": beyond, "sizes": sizes,
}  # fmt: skip


def table(heads: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def printed(value: float | None, spread: float | None) -> str:
    """A paper's figure, with the digits that it prints, but for zeros at the end."""
    if value is None:
        return ""
    return f"{value:g}" if spread is None else f"{value:g} ± {spread:g}"


def interval(ends: list[float | None]) -> str:
    """An interval, or nothing."""
    low, high = ends
    return "" if low is None or high is None else f"{low:.3g} to {high:.3g}"


def number(value: float | None, spread: float | None) -> str:
    """A figure with what follows ±, or nothing."""
    if value is None:
        return ""
    if spread is not None:
        return f"{value:.3f} ± {spread:.3f}"
    return f"{value:.3f}" if abs(value) >= LEAST or value == 0.0 else f"{value:.1e}"


def short(value: float | None) -> str:
    """A figure of a crowded table."""
    return "none" if value is None else f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"


def main() -> int:
    """Write the page."""
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
