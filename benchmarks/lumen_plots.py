"""The sweeps of Kwok 2013, fig. 7a and 7b, as plots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.svg_plot import Axis, Line, plot

_DECADES = [10.0**k for k in range(8)]
_OURS = ("#0b4f9c", "#3f83c9", "#7fb0e0", "#a9c9ea", "#c7dcf2", "#d9e8f7")
_LITERAL, _NUMPY, _GPU = "#b45f14", "#69737c", "#24815a"
_LEVEL = (1000.0, "1 kHz, the paper's GPU with 14,800 vertices")


def draw(folder: Path, sweeps: dict[str, Any], count: int, gpu: dict[str, Any] | None) -> list[str]:
    """Write ``lumen_vertices.svg`` and ``lumen_inside.svg`` into the folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    time = Axis("time of one query", _DECADES, _micros, log=True)
    vertices, inside = sweeps["vertices_sweep"], sweeps["inside_sweep"]
    counts = [row["vertices"] for row in vertices]
    pictures = {
        "lumen_vertices.svg": plot(
            "Deviation of five links against the number of vertices",
            f"20 segments, {vertices[0]['outside_percent']:.0f} % of the vertices outside; Kwok 2013, fig. 7a",
            Axis("vertices", counts, lambda v: f"{v:,.0f}", log=True, ends=(0.8 * counts[0], 1.2 * counts[-1])),
            time,
            [*_lines(vertices, "vertices"), *_gpu_lines(gpu)],
            level=_LEVEL,
        ),
        "lumen_inside.svg": plot(
            "Deviation of five links against the share of vertices inside",
            f"20 segments, {count:,} vertices; Kwok 2013, fig. 7b",
            Axis("vertices inside", [0, 20, 40, 60, 80, 100], lambda v: f"{v:.0f} %", ends=(-3.0, 103.0)),
            time,
            _lines(inside, "inside_percent"),
            level=_LEVEL,
        ),
    }
    for name, picture in pictures.items():
        (folder / name).write_text(picture, encoding="utf-8")
    return [str(folder / name) for name in pictures]


def _lines(rows: list[dict[str, Any]], over: str) -> list[Line]:
    x = [row[over] for row in rows]
    threads = [name for name in rows[0] if name.endswith("_threads_us")]
    wanted = [("ours_us", "vfix, one core", _OURS[0], 2.6, False)]
    for k, name in enumerate(threads):
        wanted.append((name, f"vfix, {name.split('_')[0]} threads", _OURS[min(k + 1, 5)], 2.0, True))
    wanted.append(("every_vertex_us", "vfix, every vertex", "#6a51a3", 2.0, False))
    wanted += [("literal_us", "as printed, compiled", _LITERAL, 2.0, False), ("numpy_us", "numpy", _NUMPY, 2.0, False)]
    return [
        Line(words, x, [row[name] for row in rows], colour, width, dashed)
        for name, words, colour, width, dashed in wanted
    ]


def _gpu_lines(gpu: dict[str, Any] | None) -> list[Line]:
    if gpu is None:
        return []
    rows = gpu["vertices_sweep"]
    return [Line("vfix, GPU", [row["vertices"] for row in rows], [row["us"] for row in rows], _GPU)]


def _micros(value: float) -> str:
    """A time in µs as people write it."""
    return f"{value:g} µs" if value < 1000.0 else f"{value / 1000.0:g} ms" if value < 1e6 else f"{value / 1e6:g} s"
