"""Clearance along the path as an SVG picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.planning.obstacles import Obstacle
from app.planning.verdict import Profile
from vfix_engine.arrays import Array

WIDTH, HEIGHT = 180.0, 40.0
LEFT, RIGHT, TOP, BOTTOM = 9.0, 2.0, 3.0, 9.0
_TOP_MM = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0)  # tops of the scale; what is farther runs along the top
_MIDDLE_TIMES = 3.0  # the scale shows three times the least clearance at least
_TICKS = (5.0, 10.0, 20.0, 50.0, 100.0)


@dataclass(frozen=True)
class _Scale:
    length_mm: float
    top_mm: float

    def x(self, s: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * s / self.length_mm

    def y(self, mm: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * min(max(mm, 0.0), self.top_mm) / self.top_mm


def clearance_plot(profile: Profile, obstacles: Sequence[Obstacle], colours: Sequence[str], length_mm: float) -> str:
    """Clearance of the whole tool to each obstacle over the arc length, its margin dashed, depth in tissue as an area.

    colours: of the obstacles, as CSS.
    """
    depth = 0.0 if profile.tissue is None else float(profile.tissue.depth.max())
    wanted = max(*(_MIDDLE_TIMES * one.least_mm for one in obstacles), *(one.margin_mm for one in obstacles), depth)
    scale = _Scale(length_mm, next((top for top in _TOP_MM if top >= wanted), _TOP_MM[-1]))
    parts = [_axes(scale)]
    if profile.tissue is not None:
        base, s = scale.y(0.0), profile.s.tolist()
        ends = f"{scale.x(s[-1]):.2f},{base:.2f} {scale.x(s[0]):.2f},{base:.2f}"
        parts.append(f'<polygon class="tissue" points="{_points(scale, profile.s, profile.tissue.depth)} {ends}"/>')
    for one, colour in zip(obstacles, colours, strict=True):
        y = scale.y(one.margin_mm)
        parts += [
            f'<path class="margin" style="stroke:{colour}" d="M{LEFT:g} {y:.2f}H{WIDTH - RIGHT:g}"/>',
            f'<polyline class="curve" style="stroke:{colour}" points="{_points(scale, profile.s, one.clearance)}"/>',
        ]
    return (
        f'<svg class="plot" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="Clearance along the path">'
        f"{''.join(parts)}</svg>"
    )


def _points(scale: _Scale, s: Array, values: Array) -> str:
    pairs = zip(s.tolist(), values.tolist(), strict=True)
    return " ".join(f"{scale.x(at):.2f},{scale.y(value):.2f}" for at, value in pairs)


def _axes(scale: _Scale) -> str:
    base, step = scale.y(0.0), next((tick for tick in _TICKS if scale.length_mm / tick <= 8.0), _TICKS[-1])
    across = [index * step for index in range(int(scale.length_mm / step) + 1)]
    labels = [f'<text x="{scale.x(s):.2f}" y="{base + 4:.2f}">{s:g}</text>' for s in across]
    for mm in (0.0, scale.top_mm / 2.0, scale.top_mm):
        y = scale.y(mm)
        labels.append(f'<text class="up" x="{LEFT - 1.2:g}" y="{y + 1:.2f}">{mm:g}</text>')
        labels.append(f'<path class="grid" d="M{LEFT:g} {y:.2f}H{WIDTH - RIGHT:g}"/>')
    labels.append(f'<text x="{(LEFT + WIDTH) / 2:g}" y="{HEIGHT - 1.2:g}">mm along the path, from the entry</text>')
    return "".join(labels)
