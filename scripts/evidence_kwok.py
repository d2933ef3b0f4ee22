"""The figure of docs/evidence.md from the report in docs/evidence/kwok2013-1.json, as SVG beside it."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.plots import ACCENT, INK, MARK, empty_figure
from scripts.evidence_figures import LEFT, WIDTH, _quiet, _svg

REPORT = Path(__file__).resolve().parents[1] / "docs" / "evidence" / "kwok2013-1.json"
HEIGHT, NAMES = 4.6, 1.75  # inches; of the rows' names
BEFORE, AFTER, OURS = "w/o DAC", "with DAC", "certified"
MOST = 2.5  # times the figure of the manual arm: what is more is drawn there


def drawn(report: Mapping[str, Any]) -> dict[str, str]:
    """The figure as SVG by its file name; equal reports give equal text."""
    rows: dict[str, dict[str, Any]] = {}
    for cell in report["cells"]:
        if cell["table"] == "III":
            rows.setdefault(cell["row"], {})[cell["column"]] = cell
    below = "1: the arm without the control. Below 1 is better; what is more than 2.5 is drawn there."
    figure = empty_figure(WIDTH, HEIGHT, LEFT, "Table III as shares of the arm without the control", below)
    left = (LEFT + NAMES) / WIDTH
    axes = figure.add_axes((left, 0.55 / HEIGHT, 1.0 - left - 0.25 / WIDTH, (HEIGHT - 1.35) / HEIGHT))
    _quiet(axes)
    axes.axvline(1.0, color=INK, linewidth=0.8)
    marks = (("paper, with", "paper", AFTER, INK, "o"), ("ours, guided", "ours", AFTER, ACCENT, "s"),
             ("ours, certified", "ours", OURS, MARK, "^"))  # fmt: skip
    for label, which, column, colour, shape in marks:
        at = [
            (place, share)
            for place, row in enumerate(rows.values())
            if (share := _share(row, which, column)) is not None
        ]
        axes.plot(
            [share for _, share in at], [place for place, _ in at], shape, color=colour, markersize=5, label=label
        )
    axes.set_yticks(range(len(rows)), list(rows), fontsize=8.5)
    axes.set(xlim=(0.0, MOST + 0.1), ylim=(len(rows) - 0.5, -0.5), xlabel="share of the arm without")
    axes.legend(frameon=False, fontsize=8.5, loc="upper right")
    return {"kwok2013-1.svg": _svg(figure)}


def _share(row: Mapping[str, Any], which: str, column: str) -> float | None:
    before, after = row[BEFORE][which], row[column][which]
    return None if not before or after is None else min(after / before, MOST)


def main() -> int:
    """Write the figure."""
    for name, text in drawn(json.loads(REPORT.read_text(encoding="utf-8"))).items():
        (REPORT.parent / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
