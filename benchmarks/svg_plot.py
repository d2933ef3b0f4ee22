"""Line plots as SVG, for the benchmarks: axes, lines with their names at the end, and no library."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 860, 500
LEFT, RIGHT, TOP, BOTTOM = 78, 196, 84, 66
APART = 17.0  # between two names, px
INK, SOFT, GRID = "#1f2933", "#6b7680", "#e4e8ec"
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
class Scale:
    """From values between ``low`` and ``high`` to px between ``start`` and ``end``."""

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
    xs = Scale(*_ends(x, [v for line in shown for v in line.x]), x.log, LEFT, WIDTH - RIGHT)
    values = [v for line in shown for v in line.y if v is not None] + ([level[0]] if level else [])
    ys = Scale(*_ends(y, values), y.log, HEIGHT - BOTTOM, TOP)
    parts = _axes(x, y, xs, ys)
    if level is not None:
        parts += _level(level, xs, ys)
    for line in reversed(shown):  # the first lies on top
        parts += _line(line, xs, ys)
    parts += _names(shown, ys)
    return page(WIDTH, HEIGHT, LEFT, title, below, parts)


def page(width: int, height: int, left: float, title: str, below: str, parts: Iterable[str]) -> str:
    """The text of an SVG file: a title, a line below it, both from ``left`` on, and the parts."""
    head = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'role="img" aria-label="{escape(title, quote=True)}" {_FONT}>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        text(left, 32, title, size=18, weight=600),
        text(left, 54, below, size=13, colour=SOFT),
    ]
    return "\n".join([*head, *parts, "</svg>", ""])


def _ends(axis: Axis, values: Sequence[float]) -> tuple[float, float]:
    if axis.ends is not None:
        return axis.ends
    low, high = min(values), max(values)
    if axis.log:  # whole decades
        low, high = 10.0 ** math.floor(math.log10(low)), 10.0 ** math.ceil(math.log10(high))
    return low, high if high > low else low + 1.0


def _axes(x: Axis, y: Axis, xs: Scale, ys: Scale) -> list[str]:
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = []
    for mark in y.marks:
        if ys.low <= mark <= ys.high:
            at = ys(mark)
            parts.append(f'<path d="M{LEFT} {at:.1f}H{right}" stroke="{GRID}"/>')
            parts.append(text(LEFT - 10, at + 4, y.written(mark), anchor="end", colour=SOFT))
    for mark in x.marks:
        if xs.low <= mark <= xs.high:
            at = xs(mark)
            parts.append(f'<path d="M{at:.1f} {bottom}v5" stroke="{SOFT}"/>')
            parts.append(text(at, bottom + 21, x.written(mark), anchor="middle", colour=SOFT))
    parts.append(f'<path d="M{LEFT} {bottom}H{right}" stroke="{SOFT}"/>')
    parts.append(text((LEFT + right) / 2, HEIGHT - 18, x.label, anchor="middle"))
    middle = (TOP + bottom) / 2
    turned = f'transform="rotate(-90 18 {middle:.1f})"'
    parts.append(text(18, middle, y.label, anchor="middle", more=turned))
    return parts


def _level(level: tuple[float, str], xs: Scale, ys: Scale) -> list[str]:
    at = ys(level[0])
    return [
        f'<path d="M{xs.start} {at:.1f}H{xs.end}" stroke="{SOFT}" stroke-dasharray="2 4"/>',
        text(xs.end - 6, at - 7, level[1], size=12, colour=SOFT, anchor="end"),
    ]


def _line(line: Line, xs: Scale, ys: Scale) -> list[str]:
    places = [(xs(x), ys(y)) for x, y in zip(line.x, line.y, strict=True) if y is not None]
    dashes = ' stroke-dasharray="6 5"' if line.dashed else ""
    way = "L".join(f"{u:.1f} {v:.1f}" for u, v in places)
    dots = "".join(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{line.width + 1.2:.1f}"/>' for u, v in places)
    return [
        f'<path d="M{way}" fill="none" stroke="{line.colour}" stroke-width="{line.width}" '
        f'stroke-linejoin="round" stroke-linecap="round"{dashes}/>',
        f'<g fill="{line.colour}" stroke="#ffffff">{dots}</g>',
    ]


def _names(lines: Sequence[Line], ys: Scale) -> list[str]:
    """Each line's name beside its last point, moved apart where they would lie over each other."""
    ends = [ys([v for v in line.y if v is not None][-1]) for line in lines]
    order = sorted(range(len(lines)), key=lambda i: ends[i])
    places = spread([ends[i] for i in order], APART)
    return [
        text(WIDTH - RIGHT + 14, at + 4, lines[i].name, colour=lines[i].colour, weight=600)
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


def text(
    x: float,
    y: float,
    words: str,
    *,
    size: int = 13,
    colour: str = INK,
    anchor: str = "start",
    weight: int = 400,
    more: str = "",
) -> str:
    """Words with the foot of the first one, or of the middle or last for another anchor, at (x, y) px."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{colour}" text-anchor="{anchor}" '
        f'font-weight="{weight}" {more}>{escape(words)}</text>'
    )


def printed(part: str) -> str:
    """Names of quantities in an SVG text as they are printed: q_c, z_eff and z_max slanted, the index lower."""
    for name, index in (("q", "c"), ("z", "eff"), ("z", "max")):
        slanted = f'<tspan font-style="italic">{name}</tspan><tspan font-size="10" dy="3">{index}</tspan>'
        part = part.replace(f"{name}_{index}", f'{slanted}<tspan dy="-3">\u200b</tspan>')
    return part
