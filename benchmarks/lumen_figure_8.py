"""Kwok 2013, fig. 8: control bends in a body cavity, four with the base inclined and eight with it upright."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.plots import HALO, INK, SOFT, empty_figure
from vfix_engine.arrays import Array
from vfix_engine.pathway.cavity import ANGLES, CONTOURS, body_cavity
from vfix_engine.snake.bending.bending import BendProblem
from vfix_engine.snake.bending.optimise import DistalBend

_WIDTH, _HEIGHT = 9.0, 10.9  # [in]
_MM = np.array([250.0, 290.0])  # that a view shows
_PER_MM = 3.7 / _MM[1]  # [in/mm]
_NEAR, _FAR = "#8f9aa5", "#d7dde2"  # halves of a contour, this side of its centre and beyond
_COLOURS = ("#0b4f9c", "#6aa3d9", "#b9c2cb")  # bends in the plane of the picture, those between, those across it
_LABELS = (_COLOURS[0], "#3f7cb5")
_X, _Y, _Z = np.eye(3)


class _View(NamedTuple):
    """Which axes of the patient go to the right, up and away from the eye, and the lowest value that is shown, mm."""

    name: str
    right: Array
    up: Array
    away: Array
    low: float
    names: tuple[str, str]  # of the axes to the right and up

    def place(self, points: Array) -> Array:
        """Where points (n, 3) are drawn (n, 2), mm."""
        return np.column_stack([points @ self.right, points @ self.up])


_FRONT = _View("from the front", _X, _Z, _Y, -20.0, ("x", "z"))
_SIDE = _View("from the side", _Y, _Z, -_X, -20.0, ("y", "z"))
_ABOVE = _View("from above", _X, _Y, -_Z, -0.5 * float(_MM[1]), ("x", "y"))


def figure_8(four: tuple[BendProblem, Sequence[DistalBend]], eight: tuple[BendProblem, Sequence[DistalBend]]) -> Figure:
    """Either case from two sides, each bend with its angle ϑ at the tip and its cost in a line below."""
    bound = four[0].bound
    figure = empty_figure(
        _WIDTH,
        _HEIGHT,
        0.4,
        f"Control bends in a body cavity of {CONTOURS} contours of {ANGLES} polar radii",
        f"five links of 28 mm, 12 mm across; bounds of {bound[0]:g} mm, {bound[-1]:g} mm for the last link; "
        "Kwok 2013, fig. 8",
    )
    rows = (
        (four, "a  four bends, the base inclined by 25°", (_FRONT, _SIDE), 9.95),
        (eight, "b  eight bends, the base upright; those between two others are lighter", (_FRONT, _ABOVE), 4.9),
    )
    width, height = _MM * _PER_MM
    for (problem, bends), words, views, top in rows:
        figure.text(0.4 / _WIDTH, top / _HEIGHT, words, fontweight="bold")
        for left, view in zip((0.8, 5.1), views, strict=True):
            place = (left / _WIDTH, (top - 0.35 - height) / _HEIGHT, width / _WIDTH, height / _HEIGHT)
            axes = figure.add_axes(place, xlabel=f"{view.names[0]}, mm", ylabel=f"{view.names[1]}, mm")
            axes.set(xlim=(-0.5 * _MM[0], 0.5 * _MM[0]), ylim=(view.low, view.low + _MM[1]))
            axes.set_title(view.name, fontsize=9, color=SOFT)
            axes.spines[["right", "top"]].set_visible(False)
            axes.tick_params(labelsize=8)
            _draw_contours(axes, view)
            _draw_bends(axes, view, problem, bends)
        costs = ",  ".join(f"{_degrees(bend)} {bend.cost:.2f}".replace("-", "−") for bend in bends)
        below = f"$z_\\mathrm{{eff}}\\,/\\,z_\\mathrm{{max}}$ at ϑ = {costs}"
        figure.text(0.4 / _WIDTH, (top - 4.65) / _HEIGHT, below, fontsize=9, color=SOFT)
    return figure


def _draw_contours(axes: Axes, view: _View) -> None:
    """The cavity's rims: the half beyond the centre pale, the half this side of it darker."""
    found = body_cavity().contours()
    psi = 2.0 * np.pi * np.arange(ANGLES + 1) / ANGLES
    second = np.cross(found.tangent, found.first)
    radius = found.radius[:, np.arange(ANGLES + 1) % ANGLES, None]
    turned = np.cos(psi)[:, None] * found.first[:, None] + np.sin(psi)[:, None] * second[:, None]
    for centre, offset in zip(found.centre, radius * turned, strict=True):
        depth, places = offset @ view.away, view.place(centre + offset)
        near = (depth[:-1] + depth[1:] <= 0.0) & (view.away[2] == 0.0)
        pieces = np.stack([places[:-1], places[1:], np.full_like(places[1:], np.nan)], axis=1)[near]
        axes.plot(*places.T, color=_FAR, linewidth=0.7)
        axes.plot(*pieces.reshape(-1, 2).T, color=_NEAR, linewidth=0.8)


def _draw_bends(axes: Axes, view: _View, problem: BendProblem, bends: Sequence[DistalBend]) -> None:
    """Rest, then the links of each bend as wide as they are, the farthest from the eye first."""
    wide: dict[str, Any] = {"linewidth": 2.0 * problem.snake.radius_mm * _PER_MM * 72.0, "solid_capstyle": "round"}
    rest = view.place(problem.snake.frames(problem.q_rest, problem.base)[:, :3, 3])
    axes.plot(*rest.T, color="#c9d0d6", alpha=0.45, **wide)
    axes.plot(*rest.T, "--", color="#98a2ac", linewidth=1.0)
    placed = [problem.snake.frames(problem.q_rest + bend.delta, problem.base)[:, :3, 3] for bend in bends]
    shown = [k for k in range(len(bends)) if _rank(view, bends[k]) < 2]
    for k in sorted(range(len(bends)), key=lambda k: (k in shown, -float(placed[k].mean(axis=0) @ view.away))):
        places, colour = view.place(placed[k]), _COLOURS[_rank(view, bends[k])]
        axes.plot(*places.T, color=colour, alpha=0.22, **wide)
        axes.plot(*places.T, "o-", color=colour, linewidth=1.8, markersize=4)
        axes.plot(
            *places[-1],
            "o",
            color=colour,
            markersize=8,
            markeredgecolor="#ffffff",
            zorder=5 if k in shown else 2,
            gid="tip",
        )
    axes.plot(*view.place(placed[0][:1])[0], "o", color=INK, markersize=7, markeredgecolor="#ffffff")
    _label(axes, view, [(view.place(placed[k][-2:]), bends[k]) for k in shown])


def _label(axes: Axes, view: _View, ends: Sequence[tuple[Array, DistalBend]]) -> None:
    """ϑ ahead of each tip, lower where another one is already."""
    taken: list[Array] = []
    for (before, tip), bend in ends:
        at = tip + 16.0 * (tip - before) / max(float(np.linalg.norm(tip - before)), 1e-9)
        while any(abs(at[0] - other[0]) < 27.0 and abs(at[1] - other[1]) < 12.0 for other in taken):
            at[1] -= 2.5
        taken.append(at)
        look: dict[str, Any] = {"fontsize": 9, "fontweight": "bold", "bbox": HALO, "zorder": 4}
        look |= {"horizontalalignment": "center", "verticalalignment": "center"}
        axes.text(at[0], at[1], _degrees(bend), color=_LABELS[_rank(view, bend)], **look)


def _rank(view: _View, bend: DistalBend) -> int:
    """0: a bend along an axis that is seen, 1: one between two axes, 2: one that is seen edge-on."""
    quarter = bend.angle / (0.5 * math.pi)
    if abs(quarter - round(quarter)) > 1e-6:
        return 1
    across = np.array([math.cos(bend.angle), math.sin(bend.angle), 0.0])
    return 2 if abs(float(across @ view.away)) > 0.5 else 0


def _degrees(bend: DistalBend) -> str:
    return f"{math.degrees(bend.angle):.0f}°"
