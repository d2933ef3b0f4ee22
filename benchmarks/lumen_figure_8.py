"""Kwok 2013, fig. 8: control bends in a body cavity, four with the base inclined and eight with it upright."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.svg_plot import INK, SOFT, page, printed, text
from vfix_engine.arrays import Array
from vfix_engine.pathway.cavity import ANGLES, CONTOURS, body_cavity
from vfix_engine.snake.bending.bending import BendProblem
from vfix_engine.snake.bending.optimise import DistalBend

WIDTH, HEIGHT = 860, 1010
_FEET = 478.0, 932.0  # of the two rows, px
_PX = 1.3  # [px/mm]
_NEAR, _FAR = "#8f9aa5", "#d7dde2"  # halves of a contour, this side of its centre and beyond
_COLOURS = ("#0b4f9c", "#6aa3d9", "#b9c2cb")  # bends in the plane of the picture, those between, those across it


class _View(NamedTuple):
    """Which axes of the patient go to the right, up and away from the eye, and where the cavity's foot is, px."""

    right: tuple[float, float, float]
    up: tuple[float, float, float]
    away: tuple[float, float, float]
    left: float
    foot: float
    name: str
    names: tuple[str, str]  # of the axes to the right and up

    def place(self, points: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) in mm."""
        return np.column_stack([self.left + _PX * points @ self.right, self.foot - _PX * points @ self.up])


def figure_8(four: tuple[BendProblem, Sequence[DistalBend]], eight: tuple[BendProblem, Sequence[DistalBend]]) -> str:
    """Either case from two sides, each bend with its angle ϑ at the tip and its cost in a line below."""
    x, y, z, back = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)
    front, side, down = "from the front", "from the side", "from above"
    rows = (
        (
            four,
            "a",
            "four bends, the base inclined by 25°",
            (_View(x, z, y, 210.0, _FEET[0], front, ("x", "z")), _View(y, z, back, 620.0, _FEET[0], side, ("y", "z"))),
        ),
        (
            eight,
            "b",
            "eight bends, the base upright; those between two others are lighter",
            (
                _View(x, z, y, 210.0, _FEET[1], front, ("x", "z")),
                _View(x, y, (0.0, 0.0, -1.0), 620.0, _FEET[1] - 165.0, down, ("x", "y")),
            ),
        ),
    )
    parts = []
    for (problem, bends), letter, words, views in rows:
        top = views[0].foot - 386.0
        parts += [text(40.0, top, letter, weight=700), text(58.0, top, words, weight=600)]
        for view in views:
            parts += _contours(view)
            parts += _bends(view, problem, bends)
            parts.append(text(view.left, top + 24.0, view.name, size=12, colour=SOFT, anchor="middle"))
            parts += _axes(view, view.left - 150.0, views[0].foot + 4.0)
        costs = ",  ".join(f"{_degrees(bend)} {bend.cost:.2f}".replace("-", "−") for bend in bends)
        parts.append(printed(text(40.0, views[0].foot + 38.0, f"z_eff / z_max at ϑ = {costs}", size=12, colour=SOFT)))
    parts += _scale(WIDTH - 60.0, _FEET[0] + 4.0)
    bound = four[0].bound
    return page(
        WIDTH,
        HEIGHT,
        40.0,
        f"Control bends in a body cavity of {CONTOURS} contours of {ANGLES} polar radii",
        f"five links of 28 mm, 12 mm across; bounds of {bound[0]:g} mm, {bound[-1]:g} mm for the last link; "
        "Kwok 2013, fig. 8",
        parts,
    )


def _contours(view: _View) -> list[str]:
    """The cavity's rims: the half beyond the centre first, then the half this side of it, darker."""
    found = body_cavity().contours()
    psi = 2.0 * np.pi * np.arange(ANGLES + 1) / ANGLES
    second = np.cross(found.tangent, found.first)
    radius = found.radius[:, np.arange(ANGLES + 1) % ANGLES, None]
    turned = np.cos(psi)[:, None] * found.first[:, None] + np.sin(psi)[:, None] * second[:, None]
    parts = []
    for beyond in (True, False):
        for centre, offset in zip(found.centre, radius * turned, strict=True):
            depth = offset @ view.away
            pieces = (depth[:-1] + depth[1:] > 0.0) == beyond
            pixels = view.place(centre + offset)
            way = "".join(
                f"M{pixels[k, 0]:.1f} {pixels[k, 1]:.1f}L{pixels[k + 1, 0]:.1f} {pixels[k + 1, 1]:.1f}"
                for k in np.flatnonzero(pieces)
            )
            colour, width = (_FAR, 0.9) if beyond or view.away[2] else (_NEAR, 1.1)
            parts.append(f'<path d="{way}" fill="none" stroke="{colour}" stroke-width="{width}"/>')
    return parts


def _bends(view: _View, problem: BendProblem, bends: Sequence[DistalBend]) -> list[str]:
    """Rest, then the links of each bend as wide as they are, the farthest from the eye first."""
    wide = 2.0 * problem.snake.radius_mm * _PX
    rest = view.place(problem.snake.frames(problem.q_rest, problem.base)[:, :3, 3])
    parts = [_way(rest, "#c9d0d6", wide, 0.45), _way(rest, "#98a2ac", 1.4, 1.0, ' stroke-dasharray="5 4"')]
    placed = [problem.snake.frames(problem.q_rest + bend.delta, problem.base)[:, :3, 3] for bend in bends]
    shown = [k for k in range(len(bends)) if _rank(view, bends[k]) < 2]
    for k in sorted(range(len(bends)), key=lambda k: (k in shown, -float(placed[k].mean(axis=0) @ view.away))):
        pixels, rank = view.place(placed[k]), _rank(view, bends[k])
        colour = _COLOURS[rank]
        parts += [_way(pixels, colour, wide, 0.22), _way(pixels, colour, 2.4, 1.0)]
        parts += [f'<circle cx="{u:.1f}" cy="{v:.1f}" r="2.6" fill="{colour}"/>' for u, v in pixels[:-1]]
        u, v = pixels[-1]
        parts.append(f'<circle class="tip" cx="{u:.1f}" cy="{v:.1f}" r="5" fill="{colour}" stroke="#ffffff"/>')
    x, y = view.place(placed[0][:1])[0]
    parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{INK}" stroke="#ffffff"/>')
    return parts + _labels(view, [placed[k] for k in shown], [bends[k] for k in shown])


def _labels(view: _View, placed: Sequence[Array], bends: Sequence[DistalBend]) -> list[str]:
    """ϑ ahead of each tip, lower where another one is already."""
    halo = 'paint-order="stroke" stroke="#ffffff" stroke-width="3.5" stroke-linejoin="round"'
    taken: list[Array] = []
    parts = []
    for links, bend in zip(placed, bends, strict=True):
        before, tip = view.place(links[-2:])
        ahead = tip - before
        at = tip + 19.0 * ahead / max(float(np.linalg.norm(ahead)), 1e-9)
        while any(abs(at[0] - other[0]) < 34.0 and abs(at[1] - other[1]) < 15.0 for other in taken):
            at[1] += 3.0
        taken.append(at)
        colour = _COLOURS[0] if _rank(view, bend) == 0 else "#3f7cb5"
        parts.append(
            text(at[0], at[1] + 4.5, _degrees(bend), size=12, colour=colour, anchor="middle", weight=600, more=halo)
        )
    return parts


def _rank(view: _View, bend: DistalBend) -> int:
    """0: a bend along an axis that is seen, 1: one between two axes, 2: one that is seen edge-on."""
    quarter = bend.angle / (0.5 * math.pi)
    if abs(quarter - round(quarter)) > 1e-6:
        return 1
    across = (math.cos(bend.angle), math.sin(bend.angle), 0.0)
    return 2 if abs(float(np.dot(across, view.away))) > 0.5 else 0


def _axes(view: _View, x: float, y: float) -> list[str]:
    right, up = view.names
    return [
        f'<path d="M{x} {y - 26}V{y}H{x + 26}" fill="none" stroke="{SOFT}"/>',
        f'<path d="M{x - 3} {y - 24}L{x} {y - 30}L{x + 3} {y - 24}ZM{x + 24} {y - 3}L{x + 30} {y}L{x + 24} {y + 3}Z" '
        f'fill="{SOFT}"/>',
        text(x + 36, y + 4, right, size=12, colour=SOFT),
        text(x - 3, y - 35, up, size=12, colour=SOFT),
    ]


def _scale(right: float, y: float) -> list[str]:
    left = right - 50.0 * _PX
    return [
        f'<path d="M{left} {y - 4}v8M{left} {y}H{right}M{right} {y - 4}v8" stroke="{SOFT}" fill="none"/>',
        text(0.5 * (left + right), y - 8.0, "50 mm", size=12, colour=SOFT, anchor="middle"),
    ]


def _degrees(bend: DistalBend) -> str:
    return f"{math.degrees(bend.angle):.0f}°"


def _way(places: Array, colour: str, width: float, opacity: float, more: str = "") -> str:
    way = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
    return (
        f'<path d="M{way}" fill="none" stroke="{colour}" stroke-width="{width:.1f}" stroke-opacity="{opacity}" '
        f'stroke-linejoin="round" stroke-linecap="round"{more}/>'
    )
