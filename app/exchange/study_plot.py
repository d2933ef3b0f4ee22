"""A metric of a study as SVG: each subject's mean in each condition, joined, and the mean with its interval."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from app.exchange.run_report.figures import ticks

WIDTH, HEIGHT = 180.0, 46.0
LEFT, RIGHT, TOP, BOTTOM = 14.0, 2.0, 2.5, 6.5
_MOST_LINES = 60  # of subjects


def plot(metric: str, values: Mapping[str, Any]) -> str:
    """The plot of a metric, '' where it has no value. values: of ``evaluate``."""
    columns, summaries = list(values["subjects"].values()), list(values["conditions"].values())
    shown = [value for column in columns for value in column if value is not None]
    if not shown:
        return ""
    ends = [end for one in summaries if one["ci95"] for end in one["ci95"] if end is not None]
    low, high = min(0.0, *shown, *ends), max(*shown, *ends, low_enough(shown))
    up = ticks(low, high, 4)

    def x(place: int) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (place + 0.5) / len(columns)

    def y(value: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (value - up[0]) / (up[-1] - up[0])

    parts = []
    for value in up:
        parts.append(f'<text class="up" x="{LEFT - 1.2:g}" y="{y(value) + 0.9:.2f}">{_number(value)}</text>')
        parts.append(f'<path class="grid" d="M{LEFT:g} {y(value):.2f}H{WIDTH - RIGHT:g}"/>')
    for subject in list(zip(*columns, strict=True))[:_MOST_LINES]:
        places = [f"{x(place):.2f},{y(value):.2f}" for place, value in enumerate(subject) if value is not None]
        parts.append(f'<polyline class="one" points="{" ".join(places)}"/>')
    for place, (label, one) in enumerate(zip(values["conditions"], summaries, strict=True)):
        parts.append(f'<text x="{x(place):.2f}" y="{HEIGHT - 1.5:g}">{escape(label)}</text>')
        if one["mean"] is not None:
            if one["ci95"] is not None:
                least, most = (y(end) for end in one["ci95"])
                parts.append(f'<path class="mean" d="M{x(place):.2f} {least:.2f}V{most:.2f}"/>')
            parts.append(f'<circle class="mean" cx="{x(place):.2f}" cy="{y(one["mean"]):.2f}" r="0.8"/>')
    return (
        f'<svg class="plot" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(metric)}">'
        f"{''.join(parts)}</svg>"
    )


def low_enough(shown: list[float]) -> float:
    """A top of the scale above its bottom where every value is 0."""
    return 1.0 if not any(shown) else max(shown)


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")
