"""Curves of runs over a common axis, as SVG: error and clearance over the path, speed over the time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from vfix_engine.arrays import Array

WIDTH, HEIGHT = 180.0, 31.0
LEFT, RIGHT, TOP, BOTTOM = 11.0, 4.0, 2.5, 8.5
_MOST_PLACES = 400  # of a curve
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_APART = 3.4  # units of the picture between two labels


@dataclass(frozen=True, eq=False)
class PlottedLine:
    """A curve of a run: x, y (n,), where y may be NaN. worst: 1 where a large value is what is looked for, else -1.

    mark: index of the sample that is labelled, and the label; dashes: of the line, so that it reads without colour.
    """

    x: Array
    y: Array
    colour: str
    dashes: str = ""
    worst: int = 1
    mark: tuple[int, str] | None = None


@dataclass(frozen=True)
class Axes:
    """What a figure shows; its scale begins at 0 or below.

    level: a line across it and its name. least: the scale reaches this value. cut: value that stands for all beyond it.
    """

    across: str
    upwards: str
    level: tuple[float, str] | None = None
    least: float = 0.0
    cut: float | None = None


@dataclass(frozen=True)
class _Scale:
    x0: float
    x1: float
    y0: float
    y1: float

    def x(self, value: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (value - self.x0) / (self.x1 - self.x0)

    def y(self, value: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (value - self.y0) / (self.y1 - self.y0)


def figure(axes: Axes, curves: Sequence[PlottedLine]) -> str:
    """The curves as SVG, '' where none has a value."""
    shown = [curve for curve in curves if np.isfinite(curve.y).any()]
    if not shown:
        return ""
    finite = np.concatenate([curve.y[np.isfinite(curve.y)] for curve in shown])
    level = [] if axes.level is None else [axes.level[0]]
    low, high = min(0.0, float(finite.min()), *level), max(axes.least, float(finite.max()), *level)
    up = ticks(low, high if high > low else low + 1.0, 4)
    ends = [float(curve.x[-1]) for curve in shown]
    starts = [float(curve.x[0]) for curve in shown]
    along = ticks(min(0.0, *starts), max(ends) if max(ends) > 0.0 else 1.0, 9)
    scale = _Scale(min(0.0, *starts), max(max(ends), along[0] + 1e-9), up[0], up[-1])
    parts = [_grid(axes, scale, along, up)]
    parts += [_line(scale, curve) for curve in shown]
    parts.append(_marks(scale, shown))
    return (
        f'<svg class="plot" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(axes.upwards)}">'
        f"{''.join(parts)}</svg>"
    )


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers from at or below ``low`` to at or above ``high``, about ``most`` of them."""
    raw = (high - low) / most
    size = 10.0 ** math.floor(math.log10(raw))
    step = next(size * times for times in _STEPS if size * times >= raw * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [step * index for index in range(first, last + 1)]


def _grid(axes: Axes, scale: _Scale, along: list[float], up: list[float]) -> str:
    base = HEIGHT - BOTTOM
    parts = list[str]()
    for value in up:
        y = scale.y(value)
        more = "≥ " if axes.cut is not None and value >= axes.cut else ""
        parts.append(f'<text class="up" x="{LEFT - 1.2:g}" y="{y + 1:.2f}">{more}{_number(value)}</text>')
        parts.append(f'<path class="grid" d="M{LEFT:g} {y:.2f}H{WIDTH - RIGHT:g}"/>')
    shown = [value for value in along if value <= scale.x1 * (1.0 + 1e-9)]
    parts += [f'<text x="{scale.x(value):.2f}" y="{base + 4:.2f}">{_number(value)}</text>' for value in shown]
    if axes.level is not None:
        y = scale.y(axes.level[0])
        parts.append(f'<path class="limit" d="M{LEFT:g} {y:.2f}H{WIDTH - RIGHT:g}"/>')
        parts.append(f'<text class="level" x="{LEFT + 1:g}" y="{y - 0.8:.2f}">{escape(axes.level[1])}</text>')
    parts.append(f'<text x="{(LEFT + WIDTH) / 2:g}" y="{HEIGHT - 1:g}">{escape(axes.across)}</text>')
    return "".join(parts)


def _line(scale: _Scale, curve: PlottedLine) -> str:
    """A curve, interrupted where it has no value; of many samples the worst of each group."""
    dashes = f' stroke-dasharray="{curve.dashes}"' if curve.dashes else ""
    group = -(-len(curve.x) // _MOST_PLACES)
    first = np.arange(0, len(curve.x), group)
    worst = np.fmax if curve.worst > 0 else np.fmin
    values, places = worst.reduceat(curve.y, first), curve.x[first]
    pieces, piece = list[str](), list[str]()
    for x, y in zip(places.tolist(), values.tolist(), strict=True):
        if math.isfinite(y):
            piece.append(f"{scale.x(x):.2f},{scale.y(y):.2f}")
        elif piece:
            pieces, piece = [*pieces, " ".join(piece)], []
    return "".join(
        f'<polyline class="curve" style="stroke:{curve.colour}"{dashes} points="{points}"/>'
        for points in [*pieces, " ".join(piece)]
        if points
    )


def _marks(scale: _Scale, curves: Sequence[PlottedLine]) -> str:
    """The labelled samples; labels that would lie on each other are moved apart."""
    parts, taken = list[str](), list[tuple[float, float]]()
    for curve in curves:
        if curve.mark is None:
            continue
        index, words = curve.mark
        x, y = scale.x(float(curve.x[index])), scale.y(float(curve.y[index]))
        right = x > WIDTH * 0.7
        at = max(y - 1.6, TOP + 1.0)
        while any(abs(at - other) < _APART and abs(x - beside) < 60.0 for beside, other in taken):
            at += _APART if at + _APART < HEIGHT - BOTTOM else -2 * _APART
        taken.append((x, at))
        side, away = ("up", -1.6) if right else ("level", 1.6)
        parts.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="0.9" style="fill:{curve.colour}"/>')
        parts.append(
            f'<text class="{side}" x="{x + away:.2f}" y="{at:.2f}" style="fill:{curve.colour}">{escape(words)}</text>'
        )
    return "".join(parts)


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")
