"""Line plots as SVG, for the benchmarks: axes, lines with their names at the end, and no library."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 860, 500
LEFT, RIGHT, TOP, BOTTOM = 78, 196, 84, 66
APART = 17.0  # between two names, px
_INK, _SOFT, _GRID = "#1f2933", "#6b7680", "#e4e8ec"
_FONT = "font-family=\"-apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif\""


@dataclass(frozen=True)
class Line:
    """One quantity over x; points that are None were not measured."""

    name: str
    x: Sequence[float]
    y: Sequence[float | None]
    colour: str
    width: float = 2.0
    dashed: bool = False


@dataclass(frozen=True)
class Axis:
    """Label, whether logarithmic, where marks are and how they are written, and the ends (None: from the lines)."""

    label: str
    marks: Sequence[float]
    written: Callable[[float], str]
    log: bool = False
    ends: tuple[float, float] | None = None


@dataclass(frozen=True)
class _Scale:
    low: float
    high: float
    log: bool
    start: float
    end: float

    def __call__(self, value: float) -> float:
        """Place in px."""
        low, high, at = (math.log10(v) if self.log else v for v in (self.low, self.high, value))
        return self.start + (at - low) / (high - low) * (self.end - self.start)


def plot(
    title: str, below: str, x: Axis, y: Axis, lines: Sequence[Line], level: tuple[float, str] | None = None
) -> str:
    """The picture as the text of an SVG file; ``level`` is a value of y that is marked all across, with its name."""
    shown = [line for line in lines if any(value is not None for value in line.y)]
    xs = _Scale(*_ends(x, [v for line in shown for v in line.x]), x.log, LEFT, WIDTH - RIGHT)
    values = [v for line in shown for v in line.y if v is not None] + ([level[0]] if level else [])
    ys = _Scale(*_ends(y, values), y.log, HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'role="img" aria-label="{escape(title, quote=True)}" {_FONT}>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        _text(LEFT, 32, title, size=18, weight=600),
        _text(LEFT, 54, below, size=13, colour=_SOFT),
        *_axes(x, y, xs, ys),
    ]
    if level is not None:
        parts += _level(level, xs, ys)
    for line in reversed(shown):  # the first lies on top
        parts += _line(line, xs, ys)
    parts += _names(shown, ys)
    return "\n".join([*parts, "</svg>", ""])


def _ends(axis: Axis, values: Sequence[float]) -> tuple[float, float]:
    if axis.ends is not None:
        return axis.ends
    low, high = min(values), max(values)
    if axis.log:  # whole decades
        low, high = 10.0 ** math.floor(math.log10(low)), 10.0 ** math.ceil(math.log10(high))
    return low, high if high > low else low + 1.0


def _axes(x: Axis, y: Axis, xs: _Scale, ys: _Scale) -> list[str]:
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = []
    for mark in y.marks:
        if ys.low <= mark <= ys.high:
            at = ys(mark)
            parts.append(f'<path d="M{LEFT} {at:.1f}H{right}" stroke="{_GRID}"/>')
            parts.append(_text(LEFT - 10, at + 4, y.written(mark), anchor="end", colour=_SOFT))
    for mark in x.marks:
        if xs.low <= mark <= xs.high:
            at = xs(mark)
            parts.append(f'<path d="M{at:.1f} {bottom}v5" stroke="{_SOFT}"/>')
            parts.append(_text(at, bottom + 21, x.written(mark), anchor="middle", colour=_SOFT))
    parts.append(f'<path d="M{LEFT} {bottom}H{right}" stroke="{_SOFT}"/>')
    parts.append(_text((LEFT + right) / 2, HEIGHT - 18, x.label, anchor="middle"))
    middle = (TOP + bottom) / 2
    turned = f'transform="rotate(-90 18 {middle:.1f})"'
    parts.append(_text(18, middle, y.label, anchor="middle", more=turned))
    return parts


def _level(level: tuple[float, str], xs: _Scale, ys: _Scale) -> list[str]:
    at = ys(level[0])
    return [
        f'<path d="M{xs.start} {at:.1f}H{xs.end}" stroke="{_SOFT}" stroke-dasharray="2 4"/>',
        _text(xs.end - 6, at - 7, level[1], size=12, colour=_SOFT, anchor="end"),
    ]


def _line(line: Line, xs: _Scale, ys: _Scale) -> list[str]:
    places = [(xs(x), ys(y)) for x, y in zip(line.x, line.y, strict=True) if y is not None]
    dashes = ' stroke-dasharray="6 5"' if line.dashed else ""
    way = "L".join(f"{u:.1f} {v:.1f}" for u, v in places)
    dots = "".join(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{line.width + 1.2:.1f}"/>' for u, v in places)
    return [
        f'<path d="M{way}" fill="none" stroke="{line.colour}" stroke-width="{line.width}" '
        f'stroke-linejoin="round" stroke-linecap="round"{dashes}/>',
        f'<g fill="{line.colour}" stroke="#ffffff">{dots}</g>',
    ]


def _names(lines: Sequence[Line], ys: _Scale) -> list[str]:
    """Each line's name beside its last point, moved apart where they would lie over each other."""
    ends = [ys([v for v in line.y if v is not None][-1]) for line in lines]
    order = sorted(range(len(lines)), key=lambda i: ends[i])
    places = spread([ends[i] for i in order], APART)
    return [
        _text(WIDTH - RIGHT + 14, at + 4, lines[i].name, colour=lines[i].colour, weight=600)
        for i, at in zip(order, places, strict=True)
    ]


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


def _text(
    x: float,
    y: float,
    words: str,
    *,
    size: int = 13,
    colour: str = _INK,
    anchor: str = "start",
    weight: int = 400,
    more: str = "",
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{colour}" text-anchor="{anchor}" '
        f'font-weight="{weight}" {more}>{escape(words)}</text>'
    )
