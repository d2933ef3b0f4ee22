"""Kwok 2013, fig. 7(c) and fig. 8, as pictures and numbers: `python -m benchmarks.lumen_bends FOLDER`.

Fig. 7(c): cost over (m, q_c), where the pathway lets the links be, what can be grown into from rest, and the bend that
is found. Fig. 8: four and eight control bends in a body cavity of 13 contours with 28 polar radii each, the base
inclined by 25°. With each bend go its evaluations, its time and its gap to a search everywhere.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vfix_engine.lumen.bending import DIRECTIONS, BendProblem
from vfix_engine.lumen.cavity import ANGLES, body_cavity
from vfix_engine.lumen.optimise import Bend, control_bends, cost_map, optimise_primary, search_globally, with_gap
from vfix_engine.lumen.pathway import Pathway
from vfix_engine.lumen.query import Query
from vfix_engine.robots.snake import SnakeModel

Array = NDArray[np.float64]

INCLINED = math.radians(-25.0)
ROUNDS, GRID = 15, 101
_COLOURS = ("#1b6ca8", "#c2571a", "#2f8f4e", "#8b3fa0", "#b3222f", "#0f8b8d", "#7a5c00", "#4a5568")


def in_a_tube(snake: SnakeModel, query: Query) -> BendProblem:
    """Five links straight in a tube of 30 mm radius; bounds of 8 mm, of 4 mm for the last link."""
    centre = np.column_stack([np.zeros((31, 2)), np.linspace(0.0, 300.0, 31)])
    pathway, base = Pathway(centre, np.full(31, 30.0), count=31), np.eye(4)
    base[2, 3] = 60.0
    window = np.array(pathway.window(40.0, 240.0))
    return BendProblem(snake, query, pathway.packed(), window, base, np.zeros(10), np.array([8.0, 8.0, 8.0, 8.0, 4.0]))


def in_a_cavity(snake: SnakeModel, query: Query) -> BendProblem:
    """The body cavity, entered at its lower end; bounds of 3 mm, of 1 mm for the last link."""
    packed, base = body_cavity().packed(), np.eye(4)
    base[1:3, 1:3] = [[math.cos(INCLINED), -math.sin(INCLINED)], [math.sin(INCLINED), math.cos(INCLINED)]]
    base[:3, 3] = [0.0, -15.0, 20.0]
    window = np.array([0, len(packed.rows)])
    return BendProblem(snake, query, packed, window, base, np.zeros(10), np.array([3.0, 3.0, 3.0, 3.0, 1.0]))


def draw(folder: Path) -> list[str]:
    """Write ``lumen_cost.svg`` and ``lumen_bends.svg`` into the folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    tube, cavity = _problems()
    pictures = {
        "lumen_cost.svg": figure_7c(tube),
        "lumen_bends.svg": figure_8(cavity, control_bends(cavity, 8)),
    }
    for name, picture in pictures.items():
        (folder / name).write_text(picture, encoding="utf-8")
    return [str(folder / name) for name in pictures]


def main(folder: Path) -> None:
    """Draw both figures into a folder and print the table."""
    draw(folder)
    for name, case in zip(("tube", "cavity"), _problems(), strict=True):
        for count in (4, 8):
            print(f"{name}: {count} bends together {_milliseconds(case, count):.1f} ms of processor time")
        for k, bend in enumerate(found := control_bends(case, 8)):
            way = [*DIRECTIONS][k // 2] if k % 2 == 0 else (found[k - 1], found[(k + 1) % 8])
            gap = with_gap(case, bend, way, GRID).gap
            depth = " ".join(f"{d:.2f}" for d in case.deviations(bend.delta))
            print(
                f"{math.degrees(bend.angle):4.0f}°  cost {bend.cost:+.3f}  gap {gap:+.4f}  "
                f"{bend.evaluations} evaluations  deviations {depth} mm"
            )


def _problems() -> tuple[BendProblem, BendProblem]:
    snake = SnakeModel(5)
    query = Query(snake.vertices(500))
    return in_a_tube(snake, query), in_a_cavity(snake, query)


def figure_7c(problem: BendProblem) -> str:
    """Cost (14) in shades over m and q_c; within the bounds of (17) in colour; exits of rays as a line."""
    m, q_c = np.linspace(-0.45, 0.45, 121), np.linspace(-3.2, 3.2, 121)
    found, survey = cost_map(problem, "e+", m, q_c), search_globally(problem, "e+", GRID)
    bend = optimise_primary(problem, "e+")

    def place(slope: float, last: float) -> tuple[float, float]:
        return 90.0 + 600.0 * (slope + 0.45) / 0.9, 560.0 - 480.0 * (last + 3.2) / 6.4

    parts = [_text(90.0, 34.0, "Cost z/z_max over m and q_c; within the bounds in orange; darker is farther bent", 17)]
    for i, j in np.ndindex(found.cost.shape):
        cost = float(found.cost[i, j])
        if not math.isfinite(cost):
            continue
        x, y = place(float(m[i]), float(q_c[j]))
        shade = (cost + 0.4) / 1.4
        low, high = ((150, 60, 0), (255, 205, 150)) if found.within[i, j] else ((70, 80, 92), (240, 243, 246))
        colour = ",".join(str(round(a + shade * (b - a))) for a, b in zip(low, high, strict=True))
        parts.append(f'<rect x="{x - 2.6:.1f}" y="{y - 2.1:.1f}" width="5.2" height="4.2" fill="rgb({colour})"/>')
    inside = [place(*exit_) for exit_ in survey.exits if abs(exit_[0]) <= 0.45 and abs(exit_[1]) <= 3.2]
    parts.append(_way(inside, "#1b6ca8", 2.0))
    x, y = place(*bend.parameters)
    parts += [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="#b3222f" stroke-width="3"/>',
        _text(90.0, 620.0, "blue: where rays from rest first leave the bounds; red: the bend that is found", 14),
        *(_text(place(v, -3.2)[0] - 12, 582.0, f"{v:+.1f}", 13) for v in (-0.4, -0.2, 0.0, 0.2, 0.4)),
        *(_text(40.0, place(-0.45, math.radians(v))[1] + 4, f"{v:+d}°", 13) for v in (-150, -75, 0, 75, 150)),
        _text(640.0, 600.0, "m, rad", 13),
        _text(30.0, 62.0, "q_c", 13),
    ]
    return _svg(760, 640, parts)


def figure_8(problem: BendProblem, bends: Sequence[Bend]) -> str:
    """The control bends in the cavity from the front (x, z) and from the side (y, z)."""
    found = body_cavity().contours()
    psi = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    second = np.cross(found.tangent, found.first)
    parts = [_text(40.0, 34.0, f"{len(bends)} control bends in a cavity of 13 contours with 28 polar radii each", 17)]
    for axis, (left, name) in enumerate(((210.0, "from the front"), (560.0, "from the side"))):
        spread = found.first[:, None, axis] * np.cos(psi)[None, :] + second[:, None, axis] * np.sin(psi)[None, :]
        high = found.first[:, None, 2] * np.cos(psi)[None, :] + second[:, None, 2] * np.sin(psi)[None, :]
        rim = np.stack(
            [found.centre[:, None, axis] + found.radius * spread, found.centre[:, None, 2] + found.radius * high]
        )
        for k in range(len(found.centre)):
            ring = [_seen(left, *rim[:, k, i]) for i in (*range(ANGLES), 0)]
            parts.append(_way(ring, "#c3cad1", 1.0))
        rest = problem.snake.frames(problem.q_rest, problem.base)[:, :3, 3]
        parts.append(_way([_seen(left, p[axis], p[2]) for p in rest], "#1f2933", 9.0, 0.35))
        for bend, colour in zip(bends, _COLOURS, strict=False):
            links = problem.snake.frames(problem.q_rest + bend.delta, problem.base)[:, :3, 3]
            parts.append(_way([_seen(left, p[axis], p[2]) for p in links], colour, 5.0, 0.85))
            x, y = _seen(left, links[-1, axis], links[-1, 2])
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="{colour}"/>')
        parts.append(_text(left - 50.0, 600.0, name, 14))
    for k, (bend, colour) in enumerate(zip(bends, _COLOURS, strict=False)):
        label = f"{math.degrees(bend.angle):.0f}°: z/z_max {bend.cost:+.2f}"
        parts.append(_text(40.0 + 180.0 * (k % 4), 632.0 + 22.0 * (k // 4), label, 14, colour))
    return _svg(780, 680, parts)


def _milliseconds(problem: BendProblem, count: int) -> float:
    """Median processor time of all the bends together."""
    spent = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        control_bends(problem, 8 if count == 8 else 4)
        spent.append(1e3 * (time.process_time() - begin))
    return float(np.median(spent))


def _seen(left: float, across: float, up: float) -> tuple[float, float]:
    return left + 1.8 * across, 560.0 - 1.8 * up


def _way(places: Iterable[tuple[float, float]], colour: str, width: float, opacity: float = 1.0) -> str:
    way = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
    return (
        f'<path d="M{way}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-opacity="{opacity}" '
        'stroke-linejoin="round" stroke-linecap="round"/>'
    )


def _text(x: float, y: float, text: str, size: int, colour: str = "#1f2933") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{colour}">{text}</text>'


def _svg(width: int, height: int, parts: Iterable[str]) -> str:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif">'
    return "\n".join([head, f'<rect width="{width}" height="{height}" fill="#ffffff"/>', *parts, "</svg>", ""])


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
