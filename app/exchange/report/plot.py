"""Clearance along the path as an SVG picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.planning.obstacles import Obstacle
from app.planning.verdict import Profile
from vfix_engine.arrays import Array

WIDTH, HEIGHT = 180.0, 36.0
LEFT, RIGHT, TOP, BOTTOM = 9.0, 2.0, 3.0, 9.0
_TOP_MM = (2.0, 3.0, 5.0, 8.0, 12.0, 20.0)  # tops of the scale; what is farther runs along the top
_MIDDLE_TIMES = 3.0  # the scale shows three times the least clearance that decides
_MOST_PLACES = 340  # of a curve, two a millimetre of the picture
_LEVEL = 5  # so many places of exactly one clearance are where nothing nearer is looked for
_TICKS = (5.0, 10.0, 20.0, 50.0, 100.0)


@dataclass(frozen=True)
class _Scale:
    length_mm: float
    top_mm: float

    def x(self, s: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * s / self.length_mm

    def y(self, mm: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * min(max(mm, 0.0), self.top_mm) / self.top_mm


def clearance_plot(profile: Profile, plotted: Sequence[tuple[Obstacle, str]], length_mm: float) -> str:
    """Clearance of the whole tool to each obstacle over the arc length, its margin dashed, depth in tissue as an area.

    plotted: the obstacles and their colours, as CSS.
    """
    obstacles = [one for one, _ in plotted]
    depth = 0.0 if profile.tissue is None else float(profile.tissue.depth.max())
    nearest = min(obstacles, key=lambda one: one.left_mm)
    wanted = max(_MIDDLE_TIMES * nearest.least_mm, *(one.margin_mm for one in obstacles), depth)
    scale = _Scale(length_mm, next((top for top in _TOP_MM if top >= wanted), _TOP_MM[-1]))
    cut = depth > scale.top_mm or any(float(one.clearance.max()) >= scale.top_mm for one in obstacles)
    parts = [_axes(scale, cut)]
    if profile.tissue is not None:
        base, s = scale.y(0.0), profile.s.tolist()
        ends = f"{scale.x(s[-1]):.2f},{base:.2f} {scale.x(s[0]):.2f},{base:.2f}"
        parts.append(
            f'<polygon class="tissue" points="{_points(scale, profile.s, profile.tissue.depth, np.maximum)} {ends}"/>'
        )
    for one, colour in plotted:
        y = scale.y(one.margin_mm)
        points = _points(scale, profile.s, one.clearance, np.minimum)
        parts += [
            f'<path class="margin" style="stroke:{colour}" d="M{LEFT:g} {y:.2f}H{WIDTH - RIGHT:g}"/>',
            f'<polyline class="curve" style="stroke:{colour}" points="{points}"/>',
            _farthest(scale, profile.s, one, colour),
        ]
    return (
        f'<svg class="plot" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="Clearance along the path">'
        f"{''.join(parts)}</svg>"
    )


def _farthest(scale: _Scale, s: Array, one: Obstacle, colour: str) -> str:
    """Words where a clearance is as great as it is measured at all, which is not a clearance that stays the same."""
    most = float(one.clearance.max())
    rows = np.flatnonzero(one.clearance >= most)
    if len(rows) < _LEVEL or most >= scale.top_mm:
        return ""
    x, y = scale.x(float(s[rows[0]])) + 1.0, scale.y(most) - 1.0
    return f'<text class="level" x="{x:.2f}" y="{y:.2f}" style="fill:{colour}">≥ {most:g}</text>'


def _points(scale: _Scale, s: Array, values: Array, worst: np.ufunc) -> str:
    """A curve; of many places the worst value of each group."""
    first = np.arange(0, len(s), -(-len(s) // _MOST_PLACES))
    ends = (s[0], s[-1])
    places = np.clip(np.add.reduceat(s, first) / np.diff([*first, len(s)]), *ends)
    places[0], places[-1] = ends
    pairs = zip(places.tolist(), worst.reduceat(values, first).tolist(), strict=True)
    return " ".join(f"{scale.x(at):.2f},{scale.y(value):.2f}" for at, value in pairs)


def _axes(scale: _Scale, cut: bool) -> str:
    """Axes with their figures. cut: some values lie above the top and are drawn at it."""
    base, step = scale.y(0.0), next((tick for tick in _TICKS if scale.length_mm / tick <= 8.0), _TICKS[-1])
    across = [index * step for index in range(int(scale.length_mm / step) + 1)]
    labels = [f'<text x="{scale.x(s):.2f}" y="{base + 4:.2f}">{s:g}</text>' for s in across]
    for mm in (0.0, scale.top_mm / 2.0, scale.top_mm):
        y, more = scale.y(mm), "≥ " if cut and mm == scale.top_mm else ""
        labels.append(f'<text class="up" x="{LEFT - 1.2:g}" y="{y + 1:.2f}">{more}{mm:g}</text>')
        labels.append(f'<path class="grid" d="M{LEFT:g} {y:.2f}H{WIDTH - RIGHT:g}"/>')
    labels.append(f'<text x="{(LEFT + WIDTH) / 2:g}" y="{HEIGHT - 1.2:g}">mm along the path, from the entry</text>')
    return "".join(labels)
