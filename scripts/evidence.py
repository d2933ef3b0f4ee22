"""Write the tables of docs/evidence.md from the reports in docs/evidence/, which `vfix study STUDY -o FILE` writes."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, REPORTS = DOCS / "evidence.md", DOCS / "evidence"
LEAST = 0.001  # a smaller figure, such as a p value, is written as a power of ten
BLOCK = re.compile(r"<!-- (\w+) of ([\w-]+) -->\n.*?<!-- end -->", re.DOTALL)


def written(page: str, reports: Path = REPORTS) -> str:
    """The page with every table anew."""

    def block(found: re.Match[str]) -> str:
        what, study = found.groups()
        report = json.loads((reports / f"{study}.json").read_text(encoding="utf-8"))
        return f"<!-- {what} of {study} -->\n{TABLES[what](report)}\n<!-- end -->"

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
        [f"`{name}`", f"{one['value']:.4g}", number(one["paper"], None), number(one["reached"], None)]
        for name, one in report["fitted"].items()
    ]
    return table(["Parameter", "Value", "Fitted to", "Reaches"], rows)


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
        ["A whole certified step of the product", "", f"{ours['product_step_ms']:.3f} ms"],
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
    """Each assumption at other values: means of the swept subjects, of each arm in turn; nothing without sweeps."""
    rows = report.get("sweeps")
    if not rows:
        return "The stored report is of `--quick`, which has no sweeps."
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
    "contradictions": contradictions, "compared": compared, "agrees": agrees, "used": used, "sweeps": sweeps,
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
