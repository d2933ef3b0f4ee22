"""Benchmarks of what uses the query: the search for control bends, and both controls with the same commands."""

from __future__ import annotations

import time
from typing import Any, Literal

import numpy as np

from benchmarks.lumen_scene import LINKS, Scene
from vfix_engine.snake.bending.bending import BendProblem
from vfix_engine.snake.bending.optimise import control_bends
from vfix_engine.worlds.snake.offline.compare_controls import compare_controls

VERTICES = 500  # section IV.B: enough for five links
BOUND_MM, LAST_BOUND_MM = 8.0, 4.0


def measure(scene: Scene, rounds: int, attack_steps: int) -> dict[str, Any]:
    """Return ``bends``, ms of the search for 4 and for 8 control bends, and ``controls``, figures of both controls."""
    return {"bends": bends(scene, rounds), "controls": compare_controls(attack_steps=attack_steps)}


def bends(scene: Scene, rounds: int) -> dict[str, Any]:
    """Return median ms, evaluations and results of the search for 4 and 8 control bends in the scene's lumen."""
    bound = np.full(LINKS, BOUND_MM)
    bound[-1] = LAST_BOUND_MM
    problem = BendProblem(
        scene.snake, scene.vertices(VERTICES), scene.packed, np.array(scene.window), scene.base(), scene.rest(), bound
    )
    told: dict[str, Any] = {"vertices": VERTICES, "bound_mm": {"body": BOUND_MM, "last": LAST_BOUND_MM}}
    counts: tuple[Literal[4, 8], ...] = (4, 8)
    for count in counts:
        found = control_bends(problem, count)  # not timed: it compiles missing kernels
        seconds = []
        for _ in range(rounds):
            begin = time.perf_counter()
            control_bends(problem, count)
            seconds.append(time.perf_counter() - begin)
        told[str(count)] = {
            "ms": 1e3 * float(np.median(seconds)),
            "evaluations_most": max(int(bend.evaluations) for bend in found),
            "feasible": all(bool(bend.feasible) for bend in found),
        }
    return told
