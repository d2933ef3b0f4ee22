"""Kwok 2013, fig. 7(c): what bending costs and where the pathway lets it, over the two parameters of a planar bend.

Within the bounds lies a band a few degrees wide, too thin to be seen over (m, q_c). So there is a second panel over m
and q_c less a multiple of m, the mean angle of the joints weighted by how far each one moves the tip: rays from rest
stay straight lines in it, and the tip goes the wanted way where it is positive, as long as joints do not saturate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from skimage.measure import approximate_polygon, find_contours

from benchmarks.svg_plot import GRID, INK, SOFT, Scale, page, printed, text
from vfix_engine.arrays import Array
from vfix_engine.snake.bending.bending import BendProblem, bend_angles
from vfix_engine.snake.bending.optimise import DistalBend, optimise_primary, search_globally

Colours = tuple[tuple[int, int, int], tuple[int, int, int]]  # red, green and blue at 1 and at −0.4

ACCENT, MARK = "#0b4f9c", "#c2571a"
WIDTH, HEIGHT, FOOT, TOP = 960, 520, 446.0, 92.0
_LEVELS = np.round(np.arange(0.9, -0.35, -0.1), 1)  # of z_eff/z_max, from straight to bent back
_BEYOND, _WITHIN = ((247, 248, 249), (118, 128, 138)), ((222, 235, 247), (8, 48, 107))  # at 1 and at −0.4
_RAYS, _CLOSER = 240, 30  # all about, and on either side of the bend that is found
_ROUND = 0.3  # [rad] below the line through rest, where the tip may still go the wanted way
_STEPS, _HALVINGS = 160, 12  # along a ray, and of the step that leaves the bounds
_REACH = (0.5, math.radians(30.0))  # of rays, in m and in the weighted mean


class Asked(NamedTuple):
    """(14) and (17) on a grid: z_eff/z_max, max (D_i − b_i) in mm and the tip's way to the wanted side in mm (a, b)."""

    cost: Array
    excess: Array
    towards: Array


class _Panel(NamedTuple):
    """A part of the plane: m in rad, q_c − ``shear``·m in rad, and where they are drawn."""

    m: Array
    up: Array
    shear: float
    x: Scale
    y: Scale

    def place(self, m: float, q_c: float) -> tuple[float, float]:
        """Where a bend is drawn, px."""
        return self.x(m), self.y(math.degrees(q_c - self.shear * m))


def weighted(problem: BendProblem) -> float:
    """k such that q_c − k m is the joints' mean, each weighted by the links that it carries: what moves the tip."""
    links = problem.snake.links
    carried = np.arange(links, 0, -1)
    return float(carried @ np.arange(2 * links - 2, -1, -2) / carried.sum())


def ask(problem: BendProblem, m: float, q_c: float) -> tuple[float, float, float]:
    """z_eff/z_max, max (D_i − b_i) in mm, and the tip's way along +x in mm of the bend to e+ (10)."""
    q = problem.snake.clamp(problem.q_rest + bend_angles(m, q_c, problem.snake.links, odd=False))
    tip = problem.snake.tip(q - problem.q_rest, np.eye(4))[:3, 3]
    excess = float((problem.deviations(q - problem.q_rest) - problem.bound).max())
    return float(tip[2]) / problem.snake.reach_mm(), excess, float(tip[0])


def growable(problem: BendProblem, bend: DistalBend) -> Array:
    """Where rays of (m, q_c) from rest first leave the bounds (n, 2): the corners of what can be grown into.

    Rays go all about, as far as the tip goes the wanted way, and ever closer to the bend's own, which is one of them.
    """
    shear = weighted(problem)
    m, q_c = bend.parameters
    own = math.atan2((q_c - shear * m) / _REACH[1], m / _REACH[0])
    near = 0.3 * np.geomspace(1e-4, 1.0, _CLOSER)
    angles = np.concatenate([np.linspace(-_ROUND, math.pi + _ROUND, _RAYS), own - near, [own], own + near])

    def kept(place: Array) -> bool:
        _, excess, towards = ask(problem, *place)
        return excess <= 0.0 and towards > 0.0

    corners = []
    for angle in np.unique(angles):
        way = np.array([_REACH[0] * math.cos(angle), _REACH[1] * math.sin(angle)])
        way[1] += shear * way[0]
        low, step = 0.0, 1.6 / _STEPS
        while low < 1.6 and kept((low + step) * way):
            low += step
        for _ in range(_HALVINGS):
            step *= 0.5
            low += step if kept((low + step) * way) else 0.0
        corners.append(low * way)
    return np.array(corners)


def figure_7c(problem: BendProblem, grid: int = 101) -> str:
    """The whole plane as in the paper, and the band in it that keeps the bounds; ``grid`` of the search everywhere."""
    bend, best = optimise_primary(problem, "e+"), search_globally(problem, "e+", grid).anywhere
    grown = growable(problem, bend)
    whole = _Panel(
        np.linspace(-0.5, 0.5, 61),
        np.radians(np.linspace(-180.0, 180.0, 73)),
        0.0,
        Scale(-0.5, 0.5, False, 66.0, 286.0),
        Scale(-180.0, 180.0, False, FOOT, TOP),
    )
    band = _Panel(
        np.linspace(-0.2, 0.48, 171),
        np.radians(np.linspace(-4.0, 32.0, 181)),
        weighted(problem),
        Scale(-0.2, 0.48, False, 372.0, 802.0),
        Scale(-4.0, 32.0, False, FOOT, TOP),
    )
    ends = [(m, up) for m, up in zip(band.m[[0, -1, -1, 0]], band.up[[0, 0, -1, -1]], strict=True)]
    edge = "L".join(f"{x:.1f} {y:.1f}" for x, y in (whole.place(m, up + band.shear * m) for m, up in ends))
    seen = _asked(problem, band)
    kept = _region(band, seen.excess, 0.0)
    parts = [
        *_drawn(whole, _asked(problem, whole), kept, grown, "whole"),
        f'<g clip-path="url(#whole)"><path d="M{edge}Z" fill="none" stroke="{INK}"/></g>',
        *_frame(whole, [-0.4, 0.0, 0.4], [-180, -90, 0, 90, 180], "m, rad", "q_c"),
        *_drawn(band, seen, kept, grown, "band"),
        *_frame(band, [-0.2, 0.0, 0.2, 0.4], [0, 10, 20, 30], "m, rad", f"q_c − {band.shear:.2f} m"),
        *_words(band, bend, best),
        *_key(),
    ]
    limits = ", ".join(f"{b:g}" for b in problem.bound)
    return page(
        WIDTH,
        HEIGHT,
        66.0,
        "What a planar bend costs, and where its bounds let it be",
        f"towards +x in a tube of 30 mm radius, b = {limits} mm; right: the framed part, sheared along m; "
        "Kwok 2013, fig. 7c",
        parts,
    )


def _asked(problem: BendProblem, panel: _Panel) -> Asked:
    asked = Asked(*(np.empty((len(panel.m), len(panel.up))) for _ in range(3)))
    for i, j in np.ndindex(asked.cost.shape):
        found = ask(problem, m := float(panel.m[i]), float(panel.up[j]) + panel.shear * m)
        for array, value in zip(asked, found, strict=True):
            array[i, j] = value
    return asked


def _drawn(panel: _Panel, asked: Asked, kept: Sequence[Array], grown: Array, name: str) -> list[str]:
    """The cost in bands, grey, and blue where the bounds are kept: pale what cannot be grown into."""
    within, reach = _closed(panel, *kept), _closed(panel, np.vstack([[0.0, 0.0], grown]))
    away = _closed(panel, *_region(panel, asked.towards, 0.0))
    frame = f"M{panel.x.start} {panel.y.start}H{panel.x.end}V{panel.y.end}H{panel.x.start}Z"
    levels = [_closed(panel, *_region(panel, asked.cost, level)) for level in _LEVELS]
    ways = "".join(f'<path id="{name}{k}" d="{way}"/>' for k, way in enumerate(levels) if way)

    def bands(colours: Colours) -> list[str]:
        filled = [f'<path d="{frame}" fill="{_shade(0.95, colours)}"/>']
        for k, (way, level) in enumerate(zip(levels, _LEVELS, strict=True)):
            if way:
                filled.append(f'<use href="#{name}{k}" fill="{_shade(level - 0.05, colours)}"/>')
        return filled

    return [
        f'<defs><clipPath id="{name}"><path d="{frame}"/></clipPath><clipPath id="{name}-kept"><path d="{within}"/>'
        f'</clipPath><clipPath id="{name}-grown"><path d="{reach}"/></clipPath>{ways}</defs>',
        f'<g clip-path="url(#{name})" fill-rule="evenodd">',
        *bands(_BEYOND),
        f'<path d="{within}" fill="#ffffff"/><g clip-path="url(#{name}-kept)" opacity="0.5">',
        *bands(_WITHIN),
        f'</g><g clip-path="url(#{name}-grown)">',
        *bands(_WITHIN),
        f'</g><path d="{within}" fill="none" stroke="{ACCENT}" stroke-width="0.8"/>',
        f'<path class="grown {name}" d="{reach}" fill="none" stroke="{ACCENT}" stroke-width="1.4" '
        'stroke-linejoin="round"/>',
        f'<path d="{away}" fill="#ffffff"/></g>',
    ]


def _region(panel: _Panel, values: Array, level: float) -> list[Array]:
    """The edges (n, 2) of where values on the panel's grid are at most that, as (m, q_c)."""
    around = np.pad(values, 1, constant_values=float(np.abs(values).max()) + 1e6)
    edges = []
    for corners in find_contours(around, level):
        at = approximate_polygon(corners, 0.04) - 1.0
        m = np.interp(at[:, 0], np.arange(len(panel.m)), panel.m)
        up = np.interp(at[:, 1], np.arange(len(panel.up)), panel.up)
        edges.append(np.column_stack([m, up + panel.shear * m]))
    return edges


def _frame(panel: _Panel, across: Sequence[float], up: Sequence[int], m: str, q: str) -> list[str]:
    """The panel's frame, marks and labels."""
    x, y = panel.x, panel.y
    parts = [f'<path d="M{x.start} {y.start}H{x.end}V{y.end}H{x.start}Z" fill="none" stroke="{SOFT}"/>']
    for at in across:
        parts.append(f'<path d="M{x(at):.1f} {y.start}v5" stroke="{SOFT}"/>')
        parts.append(text(x(at), y.start + 20, _signed(at, ".1f"), anchor="middle", colour=SOFT))
    for at in up:
        parts.append(f'<path d="M{x.start} {y(at):.1f}h-5" stroke="{SOFT}"/>')
        parts.append(text(x.start - 9, y(at) + 4, f"{_signed(at, 'd')}°", anchor="end", colour=SOFT))
    parts.append(text(0.5 * (x.start + x.end), y.start + 44, m, anchor="middle"))
    left, middle = x.start - 50.0, 0.5 * (y.start + y.end)
    parts.append(printed(text(left, middle, q, anchor="middle", more=f'transform="rotate(-90 {left} {middle})"')))
    return parts


def _words(panel: _Panel, bend: DistalBend, best: DistalBend) -> list[str]:
    """The bend that is found, rest, the best within the bounds, and what the regions are."""
    halo = 'paint-order="stroke" stroke="#ffffff" stroke-width="3" stroke-linejoin="round" stroke-opacity="0.85"'
    (x, y), (u, v), (a, b) = (panel.place(*at) for at in (bend.parameters, best.parameters, (0.0, 0.0)))
    return [
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.5" fill="{INK}"/>',
        text(a, b + 17, "rest", size=12, anchor="middle", more=halo),
        f'<circle cx="{u:.1f}" cy="{v:.1f}" r="4" fill="#ffffff" stroke="{ACCENT}" stroke-width="1.6"/>',
        text(u - 11, v - 2, f"best within the bounds: {best.cost:.3f},", size=12, anchor="end", more=halo),
        text(u - 11, v + 13, "out of reach for a bend that grows", size=12, anchor="end", more=halo),
        f'<circle class="found" cx="{x:.2f}" cy="{y:.2f}" r="6" fill="none" stroke="{MARK}" stroke-width="2.4"/>',
        text(x + 13, y + 4, f"found: {bend.cost:.3f}", size=13, colour=MARK, weight=600, more=halo),
        text(panel.x(0.36), panel.y(3.0), "the tip goes the other way", size=12, colour=SOFT, anchor="middle"),
    ]


def _key() -> list[str]:
    """The scale of z_eff/z_max, grey beyond the bounds and blue within, and what pale blue is."""
    left, low, high = 836.0, FOOT - 96.0, TOP + 34.0
    parts = [
        printed(text(left, TOP + 4, "z_eff / z_max", size=12)),
        text(left, TOP + 20, "1: straight", size=11, colour=SOFT),
    ]
    tall = (low - high) / (len(_LEVELS) + 1)
    for k, level in enumerate([*(_LEVELS + 0.1), _LEVELS[-1]]):
        for column, colours in enumerate((_BEYOND, _WITHIN)):
            parts.append(
                f'<rect x="{left + 17 * column}" y="{high + k * tall:.1f}" width="17" height="{tall + 0.3:.1f}" '
                f'fill="{_shade(level - 0.05, colours)}"/>'
            )
        if k % 2 == 0:
            at = high + k * tall
            parts.append(f'<path d="M{left + 34} {at:.1f}h4" stroke="{SOFT}"/>')
            parts.append(text(left + 42, at + 4, _signed(level, ".1f"), size=11, colour=SOFT))
    parts.append(f'<rect x="{left}" y="{high}" width="34" height="{low - high:.1f}" fill="none" stroke="{GRID}"/>')
    ramp = _shade(0.7, _WITHIN)
    rows = (
        (f'fill="{_shade(0.7, _BEYOND)}"', "beyond a bound"),
        (f'fill="{ramp}" stroke="{ACCENT}" stroke-width="1.4"', "grown into"),
        (f'fill="{ramp}" fill-opacity="0.45" stroke="{ACCENT}" stroke-width="0.8"', "only within"),
    )
    for k, (look, words) in enumerate(rows):
        at = low + 26.0 + 24.0 * k
        parts.append(f'<rect x="{left}" y="{at:.1f}" width="14" height="14" {look}/>')
        parts.append(text(left + 21, at + 11, words, size=11))
    return parts


def _shade(cost: float, colours: Colours) -> str:
    share = min(max((1.0 - cost) / 1.4, 0.0), 1.0)
    return "#" + "".join(f"{round(a + share * (b - a)):02x}" for a, b in zip(*colours, strict=True))


def _signed(value: float, form: str) -> str:
    return format(value, form).replace("-", "−")


def _closed(panel: _Panel, *edges: Array) -> str:
    """Closed ways of an SVG path through corners (n, 2), (m, q_c)."""
    ways = [[panel.place(m, q_c) for m, q_c in corners] for corners in edges]
    return "".join("M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in way) + "Z" for way in ways)
