"""The sweeps of Kwok 2013, fig. 7a and 7b, as plots."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, FuncFormatter, NullLocator

from benchmarks.plots import SOFT, empty_figure, name_lines

_OURS = ("#0b4f9c", "#3f83c9", "#7fb0e0", "#a9c9ea", "#c7dcf2", "#d9e8f7")
_LITERAL, _NUMPY, _GPU, _EVERY = "#b45f14", "#69737c", "#24815a", "#6a51a3"


def sweeps_drawn(sweeps: dict[str, Any], count: int, gpu: dict[str, Any] | None) -> dict[str, Figure]:
    """``lumen_vertices.svg`` and ``lumen_inside.svg``, by these names; ``count`` vertices in the second."""
    vertices, inside = sweeps["vertices_sweep"], sweeps["inside_sweep"]
    counts = [row["vertices"] for row in vertices]
    by_count = _drawn(
        "Deviation of five links against the number of vertices",
        f"20 segments, {vertices[0]['outside_percent']:.0f} % of the vertices outside; Kwok 2013, fig. 7a",
        vertices,
        "vertices",
        gpu,
    )
    (axes,) = by_count.axes
    axes.set(xlabel="number of vertices", xscale="log", xlim=(0.8 * counts[0], 1.2 * counts[-1]), xticks=counts)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    by_share = _drawn(
        "Deviation of five links against the share of vertices inside",
        f"20 segments, {count:,} vertices; Kwok 2013, fig. 7b",
        inside,
        "inside_percent",
        None,
    )
    by_share.axes[0].set(xlabel="vertices inside, %", xlim=(-3.0, 103.0))
    for figure in (by_count, by_share):
        name_lines(figure.axes[0])
    return {"lumen_vertices.svg": by_count, "lumen_inside.svg": by_share}


def _drawn(title: str, below: str, rows: list[dict[str, Any]], over: str, gpu: dict[str, Any] | None) -> Figure:
    figure = empty_figure(9.0, 5.2, 0.9, title, below)
    axes = figure.add_axes((0.1, 0.13, 0.67, 0.7))
    threads = [name for name in rows[0] if name.endswith("_threads_us")]
    looks: list[tuple[str, str, str, float, str]] = [("ours_us", "vfix, one core", _OURS[0], 2.0, "-")]
    for k, name in enumerate(threads, 1):
        looks.append((name, f"vfix, {name.split('_')[0]} threads", _OURS[min(k, 5)], 1.5, "--"))
    looks += [("every_vertex_us", "vfix, every vertex", _EVERY, 1.5, "-")]
    looks += [("literal_us", "as printed, compiled", _LITERAL, 1.5, "-"), ("numpy_us", "numpy", _NUMPY, 1.5, "-")]
    lines = [(words, rows, over, name, colour, width, style) for name, words, colour, width, style in looks]
    if gpu is not None:
        lines.append(("vfix, GPU", gpu["vertices_sweep"], "vertices", "us", _GPU, 1.5, "-"))
    for order, (words, taken, x, y, colour, width, style) in enumerate(lines):
        seconds = np.array([row[y] for row in taken], dtype=float) * 1e-6
        known = np.isfinite(seconds)  # NaN: not measured
        places = np.array([row[x] for row in taken], dtype=float)
        look: dict[str, Any] = {"linestyle": style, "linewidth": width, "markersize": 3.0 + width, "zorder": 9 - order}
        axes.plot(places[known], seconds[known], "o", color=colour, label=words, markeredgecolor="#ffffff", **look)
    axes.set(ylabel="time of one query", yscale="log")
    low, high = (np.log10(value) for value in axes.get_ylim())
    axes.set_ylim(10.0 ** np.floor(low), 10.0 ** np.ceil(high))
    axes.yaxis.set_major_formatter(EngFormatter(unit="s"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.grid(axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.axhline(1e-3, color=SOFT, linestyle=":", linewidth=1.0)
    at: dict[str, Any] = {"xytext": (-4, 4), "textcoords": "offset points", "horizontalalignment": "right"}
    words = "1 kHz, the paper's GPU with 14,800 vertices"
    axes.annotate(words, (1.0, 1e-3), xycoords=axes.get_yaxis_transform(), fontsize=9, color=SOFT, **at)
    return figure
