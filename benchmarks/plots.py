"""How the figures of the benchmarks look: by matplotlib, as SVG files that are equal byte by byte for equal values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, SOFT, GRID, ACCENT, MARK = "#1f2933", "#6b7680", "#e4e8ec", "#0b4f9c", "#c2571a"
HALO = {"facecolor": "#ffffff", "alpha": 0.7, "edgecolor": "none", "pad": 0.8}  # of words upon lines
_STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Segoe UI", "Helvetica Neue", "Arial"],
    "font.size": 10.0,
    "text.color": INK,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "grid.color": GRID,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "svg.fonttype": "none",  # words stay words
    "svg.hashsalt": "vfix",
}
_APART = 0.045  # of the height of the axes, between two names


def empty_figure(width: float, height: float, left: float, title: str, below: str) -> Figure:
    """A figure of so many inches with a title and a line below it, from ``left`` inches on."""
    matplotlib.rcParams.update(_STYLE)
    figure = Figure(figsize=(width, height), dpi=200)
    figure.text(left / width, 1.0 - 0.33 / height, title, fontsize=13.5, fontweight="bold")
    figure.text(left / width, 1.0 - 0.57 / height, below, color=SOFT)
    return figure


def save(figures: dict[str, Figure], folder: Path) -> list[str]:
    """Write figures by their file names into the folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        figure.savefig(folder / name, metadata={"Date": None})
    return [str(folder / name) for name in figures]


def name_lines(axes: Axes) -> None:
    """Each line's label beside its last point, moved apart where they would lie over each other."""
    lines = [line for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
    to_axes = axes.transData + axes.transAxes.inverted()
    ends = [float(to_axes.transform(line.get_xydata()[-1])[1]) for line in lines]  # type: ignore[index]
    order = sorted(range(len(lines)), key=lambda i: ends[i])
    for i, at in zip(order, spread([ends[i] for i in order], _APART), strict=True):
        look: dict[str, Any] = {"color": lines[i].get_color(), "fontweight": "bold", "verticalalignment": "center"}
        axes.text(1.02, at, str(lines[i].get_label()), transform=axes.transAxes, **look)


def spread(wanted: Sequence[float], apart: float) -> list[float]:
    """Places in ascending order, at least ``apart`` from each other and as near to the wanted ones as that allows."""
    groups: list[list[float]] = []  # the wanted places of names that touch, each as if it were the group's first
    for at in wanted:
        groups.append([at])
        while len(groups) > 1 and _first(groups[-1]) - _first(groups[-2]) < apart * len(groups[-2]):
            later = groups.pop()
            groups[-1] += [value - apart * len(groups[-1]) for value in later]
    return [_first(group) + apart * k for group in groups for k in range(len(group))]


def _first(group: Sequence[float]) -> float:
    return sum(group) / len(group)
