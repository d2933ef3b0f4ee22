"""Kwok 2013, fig. 7(c): what bending costs and where the pathway lets it, over the two parameters of a planar bend.

Within the bounds lies a band a few degrees wide, too thin to be seen over (m, q_c). So there is a second panel over m
and q_c less a multiple of m, the mean angle of the joints weighted by how far each one moves the tip: rays from rest
stay straight lines in it, and the tip goes the wanted way where it is positive, as long as joints do not saturate.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from skimage.measure import approximate_polygon, find_contours

from benchmarks.plots import ACCENT, GRID, HALO, INK, MARK, SOFT, empty_figure
from vfix_engine.arrays import Array
from vfix_engine.snake.bending.bending import BendProblem, bend_angles
from vfix_engine.snake.bending.optimise import DistalBend, optimise_primary, search_globally

_LEVELS = np.round(np.arange(-0.3, 0.95, 0.1), 1)  # of z_eff/z_max, from bent back to straight
_BEYOND = LinearSegmentedColormap.from_list("beyond a bound", ["#76808a", "#f7f8f9"])  # from −0.4 to 1
_WITHIN = LinearSegmentedColormap.from_list("within the bounds", ["#8498b5", "#eff5fb"])
_GROWN = LinearSegmentedColormap.from_list("grown into", ["#08306b", "#deebf7"])
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
    """A part of the plane: m in rad, q_c − ``shear``·m in rad, and where it is drawn."""

    m: Array
    up: Array
    shear: float
    axes: Axes

    def place(self, corners: Array) -> Array:
        """Where bends (n, 2), (m, q_c), are drawn."""
        return np.column_stack([corners[:, 0], np.degrees(corners[:, 1] - self.shear * corners[:, 0])])

    def region(self, *edges: Array) -> Path:
        """What lies within closed edges (n, 2), (m, q_c)."""
        return Path.make_compound_path(*(Path(self.place(corners), closed=True) for corners in map(_closed, edges)))


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


def figure_7c(problem: BendProblem, grid: int = 101) -> Figure:
    """The whole plane as in the paper, and the band in it that keeps the bounds; ``grid`` of the search everywhere."""
    bend, best = optimise_primary(problem, "e+"), search_globally(problem, "e+", grid).anywhere
    grown = np.vstack([[0.0, 0.0], growable(problem, bend)])
    limits = ", ".join(f"{b:g}" for b in problem.bound)
    figure = empty_figure(
        10.0,
        5.4,
        0.7,
        "What a planar bend costs, and where its bounds let it be",
        f"towards +x in a tube of 30 mm radius, b = {limits} mm; right: the framed part, sheared along m; "
        "Kwok 2013, fig. 7c",
    )
    whole, band = (
        _Panel(np.linspace(*m), np.radians(np.linspace(*up)), shear, figure.add_axes((left, 0.13, width, 0.69)))
        for m, up, shear, left, width in (
            ((-0.5, 0.5, 61), (-180.0, 180.0, 73), 0.0, 0.07, 0.22),
            ((-0.2, 0.48, 171), (-4.0, 32.0, 181), weighted(problem), 0.385, 0.44),
        )
    )
    asked = _asked(problem, band)
    kept = _edges(band, asked.excess)
    _draw(whole, _asked(problem, whole), kept, grown)
    ends = np.array([(m, up + band.shear * m) for m in band.m[[0, -1]] for up in band.up[[0, -1]]])[[0, 1, 3, 2]]
    whole.axes.add_patch(PathPatch(whole.region(ends), fill=False, edgecolor=INK, zorder=5))
    whole.axes.set(xlabel="$m$, rad", ylabel="$q_c$, °", xticks=(-0.4, 0.0, 0.4), yticks=range(-180, 181, 90))
    _draw(band, asked, kept, grown)
    band.axes.set(xlabel="$m$, rad", ylabel=f"$q_c$ − {band.shear:.2f} $m$, °", yticks=range(0, 31, 10))
    _write(band, bend, best)
    _add_key(figure)
    return figure


def _asked(problem: BendProblem, panel: _Panel) -> Asked:
    asked = Asked(*(np.empty((len(panel.m), len(panel.up))) for _ in range(3)))
    for i, j in np.ndindex(asked.cost.shape):
        found = ask(problem, m := float(panel.m[i]), float(panel.up[j]) + panel.shear * m)
        for array, value in zip(asked, found, strict=True):
            array[i, j] = value
    return asked


def _draw(panel: _Panel, asked: Asked, kept: list[Array], grown: Array) -> None:
    """The cost in bands, grey, and blue where the bounds are kept: pale what cannot be grown into."""
    axes, place = panel.axes, (panel.m, np.degrees(panel.up))
    axes.set_rasterization_zorder(1)  # the bands are pixels: as outlines they are ten times as long
    within, reach = panel.region(*kept), panel.region(grown)
    for order, (colours, clip) in enumerate(((_BEYOND, None), (_WITHIN, within), (_GROWN, reach))):
        bands = axes.contourf(*place, asked.cost.T, _LEVELS, cmap=colours, extend="both", zorder=0.3 * order)
        if clip is not None:
            bands.set_clip_path(clip, axes.transData)
    axes.add_patch(PathPatch(within, fill=False, edgecolor=ACCENT, linewidth=0.6, zorder=3))
    axes.add_patch(PathPatch(reach, fill=False, edgecolor=ACCENT, linewidth=1.1, zorder=3, gid="grown"))
    axes.contourf(*place, asked.towards.T, [-1e3, 0.0], colors="#ffffff", zorder=4)
    axes.spines[:].set_zorder(5)
    axes.set(xlim=panel.m[[0, -1]], ylim=np.degrees(panel.up[[0, -1]]))


def _edges(panel: _Panel, values: Array) -> list[Array]:
    """The edges (n, 2) of where values on the panel's grid are at most 0, as (m, q_c)."""
    around = np.pad(values, 1, constant_values=float(np.abs(values).max()) + 1e6)
    edges = []
    for corners in find_contours(around, 0.0):
        at = approximate_polygon(corners, 0.04) - 1.0
        m = np.interp(at[:, 0], np.arange(len(panel.m)), panel.m)
        up = np.interp(at[:, 1], np.arange(len(panel.up)), panel.up)
        edges.append(np.column_stack([m, up + panel.shear * m]))
    return edges


def _write(panel: _Panel, bend: DistalBend, best: DistalBend) -> None:
    """The bend that is found, rest, the best within the bounds, and what the regions are."""
    axes = panel.axes
    found, other = panel.place(np.array([bend.parameters, best.parameters]))
    look: dict[str, Any] = {"textcoords": "offset points", "bbox": HALO, "verticalalignment": "center", "zorder": 6}
    axes.plot(0.0, 0.0, "o", color=INK, markersize=5, zorder=6)
    axes.annotate("rest", (0.0, 0.0), (0, -10), horizontalalignment="center", fontsize=9, **look)
    axes.plot(*other, "o", markerfacecolor="#ffffff", markeredgecolor=ACCENT, markersize=6, zorder=6)
    words = f"best within the bounds: {best.cost:.3f},\nout of reach for a bend that grows"
    axes.annotate(words, other, (-8, 0), horizontalalignment="right", fontsize=9, **look)
    axes.plot(*found, "o", fillstyle="none", color=MARK, markersize=10, markeredgewidth=1.8, zorder=6, gid="found")
    axes.annotate(f"found: {bend.cost:.3f}", found, (10, 0), color=MARK, fontweight="bold", **look)
    axes.text(0.36, 3.0, "the tip goes the other way", fontsize=9, color=SOFT, horizontalalignment="center", zorder=6)


def _add_key(figure: Figure) -> None:
    """The scale of z_eff/z_max, grey beyond the bounds and blue within, and what pale blue is."""
    left, (grey, blue) = 0.86, (colours(np.linspace(0.0, 1.0, 14)) for colours in (_BEYOND, _GROWN))
    axes = figure.add_axes((left, 0.34, 0.035, 0.41))
    scale = np.stack([grey, blue], axis=1)
    axes.imshow(scale, origin="lower", extent=(0.0, 1.0, -0.4, 1.0), aspect="auto")
    axes.yaxis.tick_right()
    axes.set(xticks=(), yticks=np.arange(-0.2, 1.1, 0.2))
    axes.tick_params(labelsize=8)
    axes.spines[:].set_color(GRID)
    figure.text(left, 0.8, "$z_\\mathrm{eff}\\,/\\,z_\\mathrm{max}$", fontsize=9)
    figure.text(left, 0.765, "1: straight", fontsize=8, color=SOFT)
    handles = [
        Patch(facecolor=_BEYOND(0.78), label="beyond a bound"),
        Patch(facecolor=_GROWN(0.78), edgecolor=ACCENT, linewidth=1.1, label="grown into"),
        Patch(facecolor=_WITHIN(0.78), edgecolor=ACCENT, linewidth=0.6, label="only within"),
    ]
    look: dict[str, Any] = {"frameon": False, "fontsize": 8, "handlelength": 1.2, "handleheight": 1.2, "borderpad": 0.0}
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left, 0.3), borderaxespad=0.0, **look)


def _closed(corners: Array) -> Array:
    return np.vstack([corners, corners[:1]])
