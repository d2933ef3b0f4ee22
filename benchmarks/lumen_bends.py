"""Kwok 2013, fig. 7(c) and fig. 8, as pictures and numbers: `python -m benchmarks.lumen_bends FOLDER`.

Fig. 7(c): cost over (m, q_c), where the pathway lets the links be, what can be grown into from rest, and the bend that
is found. Fig. 8: control bends in a body cavity of 13 contours with 28 polar radii each, four with the base inclined by
25° and eight with it upright. With each bend go its evaluations, its time and its gaps to a search everywhere: for what
can be grown into, and for anything within the bounds.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.lumen_figure_7c import figure_7c
from benchmarks.lumen_figure_8 import figure_8
from benchmarks.plots import save
from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.query.query import Query
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.bending.bending import DIRECTIONS, BendProblem
from vfix_engine.snake.bending.optimise import control_bends, search_globally

INCLINED = math.radians(-25.0)
ROUNDS, GRID = 15, 101


def in_a_tube(snake: SnakeModel, query: Query) -> BendProblem:
    """Five links straight in a tube of 30 mm radius; bounds of 8 mm, of 4 mm for the last link."""
    centre = np.column_stack([np.zeros((31, 2)), np.linspace(0.0, 300.0, 31)])
    pathway, base = Pathway(centre, np.full(31, 30.0), count=31), np.eye(4)
    base[2, 3] = 60.0
    window = np.array(pathway.window(40.0, 240.0))
    return BendProblem(snake, query, pathway.packed(), window, base, np.zeros(10), np.array([8.0, 8.0, 8.0, 8.0, 4.0]))


def in_a_cavity(snake: SnakeModel, query: Query, inclined: float = INCLINED) -> BendProblem:
    """The body cavity, entered at its lower end, the base turned about x by so many rad; bounds of 3 mm, the tip 1 mm.

    Inclined, the base stands near the ridge and leans away from it; upright it stands on the axis.
    """
    packed, base = body_cavity().packed(), np.eye(4)
    base[1:3, 1:3] = [[math.cos(inclined), -math.sin(inclined)], [math.sin(inclined), math.cos(inclined)]]
    base[:3, 3] = [0.0, -15.0 if inclined else 0.0, 20.0]
    window = np.array([0, len(packed.rows)])
    return BendProblem(snake, query, packed, window, base, np.zeros(10), np.array([3.0, 3.0, 3.0, 3.0, 1.0]))


def bends_drawn() -> dict[str, Figure]:
    """``lumen_cost.svg`` and ``lumen_bends.svg``, by these names."""
    tube, cavity, upright = _problems().values()
    return {
        "lumen_cost.svg": figure_7c(tube),
        "lumen_bends.svg": figure_8((cavity, control_bends(cavity, 4)), (upright, control_bends(upright, 8))),
    }


def main(folder: Path) -> None:
    """Draw both figures into a folder and print the table."""
    save(bends_drawn(), folder)
    for name, case in _problems().items():
        for count in (4, 8):
            print(f"{name}: {count} bends together {_milliseconds(case, count):.1f} ms of processor time")
        for k, bend in enumerate(found := control_bends(case, 8)):
            way = [*DIRECTIONS][k // 2] if k % 2 == 0 else (found[k - 1], found[(k + 1) % 8])
            everywhere = search_globally(case, way, GRID)
            gaps = [bend.cost - best.cost for best in (everywhere.reachable, everywhere.anywhere)]
            depth = " ".join(f"{d:.2f}" for d in case.deviations(bend.delta))
            print(
                f"{math.degrees(bend.angle):4.0f}°  cost {bend.cost:+.3f}  gaps {gaps[0]:+.4f} {gaps[1]:+.4f}  "
                f"{bend.evaluations} evaluations  deviations {depth} mm"
            )


def _problems() -> dict[str, BendProblem]:
    snake = SnakeModel(5)
    query = Query(snake.vertices(500))
    cavity, upright = in_a_cavity(snake, query), in_a_cavity(snake, query, inclined=0.0)
    return {"tube": in_a_tube(snake, query), "cavity": cavity, "cavity, base upright": upright}


def _milliseconds(problem: BendProblem, count: int) -> float:
    """Median processor time of all the bends together."""
    spent = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        control_bends(problem, 8 if count == 8 else 4)
        spent.append(1e3 * (time.process_time() - begin))
    return float(np.median(spent))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
